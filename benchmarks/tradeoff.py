"""Errors and speed of chosen settings: python -m benchmarks.tradeoff [setting ...]."""

import argparse
from typing import Any

from benchmarks.measure import tradeoff
from benchmarks.measure.tradeoff import SETTINGS, TIME, TOWERS
from benchmarks.report.provenance import describe, provenance
from benchmarks.report.tables import plain
from physics import Fidelity
from physics.scene.validation import positive


def setting(text: str) -> tuple[str, Fidelity]:
    """A name of SETTINGS, or fields of a Fidelity: substep=1e-3,contact_resolution=0.3.

    Raises:
        argparse.ArgumentTypeError: The text is neither, or the Fidelity is not valid.
    """
    if text in SETTINGS:
        return text, SETTINGS[text]
    fields: dict[str, Any] = {}
    for field in text.split(","):
        name, _, value = field.partition("=")
        if not value:
            raise argparse.ArgumentTypeError(
                f"{text!r} is neither one of {', '.join(map(repr, SETTINGS))} nor fields of a "
                "Fidelity, such as substep=1e-3,contact_resolution=0.3"
            )
        try:
            fields[name.strip()] = int(value) if value.strip().isdigit() else float(value)
        except ValueError:
            fields[name.strip()] = value.strip()
    try:
        return text, Fidelity(**fields)
    except (TypeError, ValueError) as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _cubes(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"a tower has at least one cube, got {text!r}")
    return int(text)


def _time(text: str) -> float:
    try:
        return positive("--time", float(text))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def run() -> None:
    """Measures the settings given, or all of SETTINGS."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tradeoff", description=__doc__)
    parser.add_argument(
        "settings", nargs="*", type=setting,
        help=f"{', '.join(map(repr, SETTINGS))}; or fields of a Fidelity: substep=1e-3,skin=0.2",
    )  # fmt: skip
    parser.add_argument(
        "--towers", nargs="*", type=_cubes, default=TOWERS, metavar="CUBES",
        help="heights of the towers; give it after the settings",
    )  # fmt: skip
    parser.add_argument("--time", type=_time, default=TIME, help="s that the towers are observed")
    options = parser.parse_args()
    chosen = dict(options.settings) or SETTINGS
    print(f"{tradeoff.__doc__}\n{describe(provenance())}\n")
    for table in tradeoff.of_settings(chosen, towers=options.towers, time=options.time):
        print(plain(table) + "\n", flush=True)


if __name__ == "__main__":
    run()

"""docs/results.md and the table of the README: text made of the results, and of nothing else."""

import re
import statistics
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from training.results.result import Result, read_results
from training.runs.run_folder import folder_name
from training.settings.config import TrainConfig, load_config
from training.settings.errors import UsageError

PAGE = Path("docs/results.md")
README = Path("README.md")
PICTURES = Path("docs/results")
NONE_YET = (
    "No run is recorded yet: `rigid-envs results` records those that are finished under `runs/`."
)
HEAD = """\
# Results

Trained policies on the environments, each evaluated on episodes that it was not trained on, acting
by its mean. `rigid-envs results` writes this page from the files under `results/`; the settings,
the learning curve and the policy of every row lie there too. `rigid-envs evaluate
results/<algo>/<run>/policy.policy` measures one again, `rigid-envs record` films it, and the
command below a table trains it anew: to the same policy with the commit and packages of then on
the same kind of machine, to much the same with others.

Wall time is that of training alone, without compiling what was compiled before and without
evaluation; the share in the environments is what their steps took of it. Success at the end counts
episodes whose goal is met when they end, success at any time those that met it after some step;
intervals are Wilson's at 95 %. ± is the standard deviation over seeds.
"""
_PLACE = re.compile("(<!-- results -->\n).*?(<!-- /results -->)", re.DOTALL)


def page_text(results: Sequence[Result], repository: Path) -> str:
    """The whole of docs/results.md, of results by kind and seed, and their settings."""
    if not results:
        return f"{HEAD}\n{NONE_YET}\n"
    sections = []
    for group in by_kind(results):
        one = group[0]
        file = one.folder(repository) / "config.yaml"
        sections.append(_section(group, load_config(one.algorithm, one.env_id, file)))
    return "\n".join([HEAD, *sections])


def readme_text(text: str, results: Sequence[Result]) -> str:
    """README's text with the table of the results in its place.

    Raises:
        UsageError: The text has no place for it.
    """
    if not _PLACE.search(text):
        raise UsageError(f"{README} has no lines <!-- results --> and <!-- /results -->")
    block = _summary(results) if results else f"{NONE_YET}\n"
    return _PLACE.sub(lambda found: found[1] + block + found[2], text)


def by_kind(results: Sequence[Result]) -> list[list[Result]]:
    """The results that differ by their seed only, together."""
    return [list(group) for _, group in groupby(results, key=lambda result: result.kind)]


def pictures(kind: str) -> tuple[Path, Path]:
    """Learning curve and film of a kind, in the repository."""
    return PICTURES / f"{kind}.png", PICTURES / f"{kind}.gif"


def write_pages(repository: Path) -> list[Path]:
    """Brings the page and the README up to date.

    Returns:
        Those that were other before.

    Raises:
        UsageError: A result is damaged, or the README has no place for its table.
    """
    written = []
    for path, text in _expected(repository).items():
        file = repository / path
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
            written.append(path)
    return written


def check_pages(repository: Path) -> None:
    """Raises UsageError where the page or the README is out of date, or a file is missing."""
    for path, text in _expected(repository).items():
        file = repository / path
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            raise UsageError(f"{path} is not what the files under results/ say: rigid-envs results")
    for result in read_results(repository):
        needed = [repository / path for path in pictures(result.kind)]
        own = ("config.yaml", "progress.csv", "policy.policy")
        for file in [*needed, *(result.folder(repository) / name for name in own)]:
            if not file.exists():
                raise UsageError(f"{file} is missing: rigid-envs results")


def _expected(repository: Path) -> dict[Path, str]:
    """Text of the page and of the README by their path in the repository."""
    results = read_results(repository)
    try:
        readme = (repository / README).read_text(encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{repository / README} cannot be read: {error.strerror}") from None
    return {PAGE: page_text(results, repository), README: readme_text(readme, results)}


def _arguments(values: Mapping[str, Any]) -> str:
    return ", ".join(f"`{name}: {value}`" for name, value in values.items())


def _section(group: Sequence[Result], settings: TrainConfig) -> str:
    """A task and algorithm: its table, commands, pictures."""
    first, given = group[0], _arguments(group[0].arguments)
    begun = {k: v for k, v in settings.env_kwargs.items() if v != first.arguments.get(k)}
    before = (
        f" Trained with {_arguments(begun)} until the last part, of {settings.finish_timesteps:,} "
        "steps."
        if begun
        else ""
    )
    lines = [
        f"## {first.env_id}, {first.algorithm.upper()}",
        "",
        (f"With {given}." if given else "With the environment's own arguments.") + before,
        "",
        "| seed | steps | wall time | in environments "
        "| success at the end | at any time | commit |",
        "|---:|---:|---:|---:|---:|---:|---|",
    ]
    for one in group:
        lines.append(
            f"| {one.seed} | {one.steps:,} | {one.seconds:.0f} s | "
            f"{100 * one.environment_share:.0f} % | "
            f"{_interval(one.success_at_end)} | {_interval(one.success_at_any_time)} | "
            f"{_short(one.commit)} |"
        )
    if len(group) > 1:
        cells = [
            _over_seeds(group, lambda one: one.steps, "{:,.0f}"),
            _over_seeds(group, lambda one: one.seconds, "{:.0f}", " s"),
            _over_seeds(group, lambda one: 100 * one.environment_share, "{:.0f}", " %"),
            _over_seeds(group, lambda one: 100 * one.success_at_end["rate"], "{:.1f}", " %"),
            _over_seeds(group, lambda one: 100 * one.success_at_any_time["rate"], "{:.1f}", " %"),
        ]
        lines.append(f"| mean | {' | '.join(cells)} | |")
    lines += ["", "```sh", *(one.command for one in group), "```", ""]
    lines += [*_circumstances(group), ""]
    curve, film = (path.relative_to(PAGE.parent).as_posix() for path in pictures(first.kind))
    lines += [f"![Learning curves of {first.kind}]({curve})", ""]
    lines += [f"![Three episodes of the policy of seed {first.seed}]({film})", ""]
    return "\n".join(lines)


def _circumstances(group: Sequence[Result]) -> list[str]:
    """How the runs were evaluated and what with they were made, each said once."""
    lines = []
    for text in (_evaluation, _made_with):
        for said, seeds in _alike(group, text).items():
            which = "" if len(seeds) == len(group) else f"Seed {', '.join(seeds)}: "
            lines.append(f"{which}{said}")
    return lines


def _alike(group: Sequence[Result], text: Callable[[Result], str]) -> dict[str, list[str]]:
    """Seeds by what is said of them."""
    said: dict[str, list[str]] = {}
    for one in group:
        said.setdefault(text(one), []).append(str(one.seed))
    return said


def _evaluation(one: Result) -> str:
    resumed = f" Training was resumed {one.resumed} times." if one.resumed else ""
    return (
        f"Evaluated on {one.episodes:,} episodes from seed {one.first_seed:,} on, "
        f"fidelity {one.fidelity or 'as the environment has it'}.{resumed}"
    )


def _made_with(one: Result) -> str:
    versions = {**one.versions}
    if isinstance(platform := versions.get("platform"), str):
        versions["platform"] = platform.partition("-")[0]  # the kernel's build says nothing here
    return f"Made with {', '.join(f'{name} {value}' for name, value in versions.items())}."


def _summary(results: Sequence[Result]) -> str:
    """The block of the README: a row a kind, and the films."""
    lines = [
        "| task | algorithm | seeds | steps | wall time | success at the end | at any time |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    films = []
    for group in by_kind(results):
        first = group[0]
        extra = first.task.removeprefix(folder_name(first.env_id)).removeprefix("-")
        cells = [
            f"{first.env_id} {extra}".strip(),
            first.algorithm.upper(),
            str(len(group)),
            _over_seeds(group, lambda one: one.steps / 1e6, "{:.2f}", " million"),
            _over_seeds(group, lambda one: one.seconds, "{:.0f}", " s"),
            _over_seeds(group, lambda one: 100 * one.success_at_end["rate"], "{:.1f}", " %"),
            _over_seeds(group, lambda one: 100 * one.success_at_any_time["rate"], "{:.1f}", " %"),
        ]
        lines.append(f"| {' | '.join(cells)} |")
        film = pictures(first.kind)[1].as_posix()
        films.append(f"![{first.env_id}, {first.algorithm.upper()}]({film})")
    return "\n".join([*lines, "", *films, ""])


def _short(commit: str | None) -> str:
    if commit is None:
        return "–"
    digits, dash, dirty = commit.partition("-")
    return f"{digits[:10]}{dash}{dirty}"


def _interval(share: dict[str, float]) -> str:
    low, rate, high = (f"{100 * share[name]:.1f}" for name in ("low", "rate", "high"))
    return f"{rate} % ({low} to {high})"


def _over_seeds(
    group: Sequence[Result], value: Callable[[Result], float], form: str, unit: str = ""
) -> str:
    """Mean ± standard deviation; of a single seed its value."""
    values = [value(one) for one in group]
    mean = form.format(statistics.fmean(values))
    if len(values) == 1:
        return f"{mean}{unit}"
    return f"{mean} ± {form.format(statistics.stdev(values))}{unit}"

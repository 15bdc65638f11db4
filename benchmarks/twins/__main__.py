"""python -m benchmarks.twins record | identify | compare."""

import argparse
from pathlib import Path

from benchmarks.twins import identify, recordings, replay
from rigid_envs.twins import TWINS


def main() -> None:
    """Runs one of the commands."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.twins", description=__doc__)
    parser.add_argument(
        "command", choices=("record", "identify", "compare"),
        help="record: play scripts in the originals, and write what happened to data/; identify: "
        "print what twins take from it, and train the Panda arm; compare: print how far twins "
        "differ from what was recorded",
    )  # fmt: skip
    parser.add_argument("--python", type=Path, help="interpreter that has the originals")
    parser.add_argument("--arm", action="store_true", help="identify: the Panda arm, too (7 min)")
    options = parser.parse_args()
    if options.command == "record":
        for name, kind in recordings.KINDS.items():
            recordings.record(kind, options.python).save(name)
            print(name)
        for twin in TWINS.values():
            recordings.save_starts(twin.original, options.python)
            print(f"starts of {twin.original}")
    elif options.command == "identify":
        frequency, damping, stride, sag = identify.servo(recordings.Recording.load("fetch-motions"))
        print(f"Fetch hand: frequency {frequency:.1f} rad/s, damping ratio {damping:.2f}, stride "
              f"{1e3 * stride:.1f} mm, sag {1e3 * sag.round(5)} mm")  # fmt: skip
        sliding, creeping = identify.braking(recordings.Recording.load("fetch-slides"))
        print(f"FetchSlide's puck: sliding {sliding:.2f} m/s^2, creeping {creeping:.2f} 1/s")
        if options.arm:
            print(f"Panda arm: {identify.panda_arm(options.python)}")
    else:
        print("\n".join(replay.summary()))


if __name__ == "__main__":
    main()

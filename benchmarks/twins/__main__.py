"""python -m benchmarks.twins record | identify | compare | speed | films | scripts."""

import argparse
from pathlib import Path

from benchmarks.twins import films, identify, public_scripts, recordings, replay, speed
from rigid_envs.twins import TWINS


def main() -> None:
    """Runs one of the commands."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.twins", description=__doc__)
    parser.add_argument(
        "command", choices=("record", "identify", "compare", "speed", "films", "scripts"),
        help="record: play scripts in the originals, and write what happened to data/; identify: "
        "print what twins take from it; compare: print how far twins differ from what was "
        "recorded; speed: steps per second beside the originals (5 min); films: draw recorded "
        "policies in twins and originals; scripts: fetch public scripts and run them on twins "
        "(15 min)",
    )  # fmt: skip
    parser.add_argument("--python", type=Path, help="interpreter that has the originals")
    options = parser.parse_args()
    if options.command == "record":
        for name, kind in recordings.KINDS.items():
            recordings.record(kind, options.python).save(name)
            print(name)
        for twin in TWINS.values():
            recordings.save_starts(twin.original, options.python)
            print(f"starts of {twin.original}")
    elif options.command == "identify":
        frequency, damping = identify.servo(recordings.Recording.load("fetch-motions"))
        print(f"Fetch hand: frequency {frequency:.1f} rad/s, damping ratio {damping:.2f}")
        presses = recordings.Recording.load("fetch-presses")
        sliding, creeping, sinking, firm = identify.pressing(presses)
        print(f"it presses on the table: sliding {sliding:.2f}, creeping {creeping:.2f}, "
              f"sinking {sinking:.2f} above {1e3 * firm:.1f} mm")  # fmt: skip
        holding, creeping = identify.grips(recordings.Recording.load("fetch-grips"))
        print(f"and then its fingers: holding {holding:.1f}, creeping {creeping:.3f}")
        slides = recordings.Recording.load("fetch-slides")
        free = identify.Slides.of(slides)
        deceleration, damping, gliding = free.braking()
        print(f"FetchSlide's puck: deceleration {deceleration:.2f} m/s^2, damping "
              f"{damping:.2f} 1/s, gliding {gliding:.3f} m/s")  # fmt: skip
        print(f"ends of slides are off by {1e3 * free.misses():.0f} mm in the median")
        print(f"its restitution: {identify.restitution(slides):.2f}")
        low, high = free.glides(deceleration, damping)
        print(f"nine of ten glide at {low:.3f} to {high:.3f} m/s")
    elif options.command == "scripts":
        for line in public_scripts.table():
            print(line, flush=True)
    elif options.command == "films":
        films.draw(options.python)
    elif options.command == "speed":
        for row in speed.table(options.python):
            print(row, flush=True)
    else:
        print("\n".join(replay.summary()))


if __name__ == "__main__":
    main()

"""The command line: `rigid-envs COMMAND`, as train, evaluate, record, results, play, view.

It starts without Stable-Baselines3 or torch; a command that needs a missing package names the extra
that installs it. Flags have the names of rl-baselines3-zoo where it has the same option.
"""

import argparse
import sys
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from training.commands import extras, flags, handlers, shared_flags, values
from training.settings.errors import UsageError


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command.

    Args:
        arguments: Arguments after the program's name; by default those of the process.

    Returns:
        Exit status: 0 for success, 2 for a mistake of the user, 130 after Ctrl-C.
    """
    try:
        options = _parser().parse_args(arguments)
        extras.require(*options.needs)
        status: int = options.run(options)
    except UsageError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return handlers.INTERRUPTED
    return status


def _version() -> str:
    try:
        return metadata.version("rigid-envs")
    except metadata.PackageNotFoundError:
        return "(source tree, not installed)"


def _parser() -> argparse.ArgumentParser:
    parser = flags.Parser(
        prog="rigid-envs", description="Train, evaluate and record policies for RigidEnvs."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {_version()}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    train_extra = ("train", extras.TRAIN_EXTRA)

    def command(
        name: str,
        run: Any,
        summary: str,
        needs: tuple[str, Sequence[str]] = train_extra,
    ) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=summary, description=summary)
        added.set_defaults(run=run, needs=needs)
        return added

    training = command("train", handlers.train, "Train a policy into a new run folder.")
    shared_flags.add_training(training)
    flags.add_runs(training)

    evaluation = command("evaluate", handlers.evaluate, "Measure the success rate of a policy.")
    shared_flags.add_policy(evaluation)
    shared_flags.add_episodes(evaluation, 1000)
    flags.add_original(evaluation)

    recording = command(
        "record", handlers.record, "Record a video of a policy (mp4 or GIF) and a still image."
    )
    shared_flags.add_policy(recording)
    shared_flags.add_episodes(recording, 8)
    recording.add_argument(
        "-o",
        "--output",
        type=Path,
        help="mp4 or (smaller) GIF to write (default: video.mp4 in the run folder; for a policy "
        "file, <policy>.mp4 next to it)",
    )

    exporting = command("export", handlers.export, "Copy the policy of a run into one small file.")
    flags.add_export(exporting)

    scripted = command(
        "scripted",
        handlers.scripted,
        "Measure the success rate of the scripted controller of an environment.",
    )
    scripted.add_argument(
        "--env", default=flags.DEFAULT_ENV, help="environment id (default: %(default)s)"
    )
    shared_flags.add_episodes(scripted, 1000)

    playing = command(
        "play",
        handlers.play,
        "Control an environment with the keyboard in a window.",
        ("render", extras.RENDER_EXTRA),
    )
    flags.add_play(playing)

    viewing = command(
        "view",
        handlers.view,
        "Show many worlds side by side in a browser, with controls that act at once.",
        ("view", extras.VIEW_EXTRA),
    )
    flags.add_view(viewing)

    scene = command(
        "scene", handlers.scene, "Run many bodies in one world and show its speed.", ("train", ())
    )
    flags.add_scene(scene)

    compiling = command(
        "compile",
        handlers.compile_kernels,
        "Compile kernels ahead of time, for images and clusters.",
        ("train", ()),
    )
    flags.add_compiling(compiling)

    plotting = command("plot", handlers.plot, "Plot the learning curve of one or several runs.")
    flags.add_plot(plotting)

    recording_results = command(
        "results", handlers.results, "Record finished runs and generate docs/results.md."
    )
    flags.add_results(recording_results)

    dataset = command(
        "dataset",
        handlers.dataset,
        "Record episodes of a policy as a dataset for Minari.",
        ("data", extras.DATA_EXTRA),
    )
    flags.add_dataset(dataset)

    tuning = command(
        "tune",
        handlers.tune,
        "Search training settings by many short trials.",
        ("tune", extras.TUNE_EXTRA),
    )
    shared_flags.add_training(tuning)
    flags.add_tuning(tuning)

    fidelity = command(
        "tune-fidelity",
        handlers.tune_fidelity,
        "Find the cheapest fidelity whose error in an environment is within a tolerance.",
        ("train", ("yaml",)),
    )
    flags.add_fidelity_tuning(fidelity)

    demonstration = command(
        "demo",
        handlers.demo,
        "Train a policy, evaluate it, record a video and plot the learning curve.",
    )
    shared_flags.add_training(demonstration)
    demonstration.add_argument(
        "--n-episodes",
        type=values.count,
        default=1000,
        help="episodes of the evaluation (default: %(default)s)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())

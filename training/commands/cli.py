"""The command line: `rigid-envs COMMAND`, as train, evaluate, record, results, play.

Starts without Stable-Baselines3 or torch: each command imports what it needs, and says which extra
installs what is missing. Flags follow rl-baselines3-zoo where it has a counterpart.
"""

import argparse
import importlib.util
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from importlib import metadata
from pathlib import Path
from typing import Any

from training.commands.flags import (
    DEMO_ENV,
    Parser,
    add_episodes,
    add_export,
    add_play,
    add_plot,
    add_policy,
    add_results,
    add_training,
    add_tuning,
    count,
)
from training.commands.options import (
    config_of,
    configured,
    env_kwargs_of,
    policy_of,
    refuse_contradictions,
    run_folder_of,
)
from training.settings.errors import UsageError

TRAIN_EXTRA = (
    "stable_baselines3",
    "torch",
    "yaml",
    "rich",
    "tensorboard",
    "matplotlib",
    "imageio",
    "imageio_ffmpeg",
    "PIL",
)
RENDER_EXTRA = ("pygame",)
TUNE_EXTRA = (*TRAIN_EXTRA, "optuna")
INTERRUPTED = 130
"""Exit status of a command ended by Ctrl-C, as shells have it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command.

    Args:
        arguments: Words after the program's name; those of the process if not given.

    Returns:
        Exit status: 0 if done, 2 for a mistake of the user, 130 if interrupted.
    """
    try:
        options = _parser().parse_args(arguments)
        _require(*options.needs)
        with _telling_of_compilation() if options.simulates else nullcontext():
            status: int = options.run(options)
    except UsageError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    return status


def _train(options: argparse.Namespace) -> int:
    # first: a mistake in settings should not wait for torch
    config = config_of(options) if options.resume is None else None
    if config is None:
        refuse_contradictions(options)

    from training.commands.demo import print_training
    from training.runs.run_folder import RunFolder
    from training.sb3.train import resume, train

    machine = {
        "device": options.device,
        "num_threads": options.num_threads,
        "save_every": options.save_freq,
    }
    if config is None:
        trained = resume(RunFolder(options.resume), **machine)
    else:
        trained = train(config, options.log_folder, **machine)
    print_training(trained)
    return INTERRUPTED if trained.interrupted else 0


def _evaluate(options: argparse.Namespace) -> int:
    from training.results.evaluate import FIRST_SEED, evaluate, print_evaluation

    policy = policy_of(options)
    seed = FIRST_SEED if options.seed is None else options.seed
    result = evaluate(policy, options.n_episodes, seed=seed, **env_kwargs_of(options))
    print_evaluation(policy, result)
    return 0


def _record(options: argparse.Namespace) -> int:
    from training.results.evaluate import FIRST_SEED
    from training.results.record import record

    policy = policy_of(options)
    given = Path(options.policy) if options.policy else None
    beside = (policy.folder or options.log_folder / policy.name) / "video.mp4"
    if given is not None and given.suffix == ".policy":  # its folder may hold others
        beside = given.with_suffix(".mp4")
    video, still = record(
        policy,
        options.output or beside,
        episodes=options.n_episodes,
        seed=FIRST_SEED if options.seed is None else options.seed,
        **env_kwargs_of(options),
    )
    print(f"video   {video}\npicture {still}")
    return 0


def _export(options: argparse.Namespace) -> int:
    from training.policies.export import export_run
    from training.policies.policy_header import Success
    from training.policies.trained_policy import trained_policy
    from training.results.evaluate import FIRST_SEED, evaluate

    folder = run_folder_of(options)
    success = None
    if options.n_episodes is not None:
        policy = trained_policy(folder.path, algo=options.algo)
        result = evaluate(policy, options.n_episodes, seed=FIRST_SEED)
        success = Success(
            options.n_episodes,
            float(result.success_at_end.mean()),
            policy.env_kwargs.get("fidelity"),
            FIRST_SEED,
        )
    output = options.output or Path(f"{folder.path.name}.policy")
    for file in export_run(folder, output, success=success, sb3=options.sb3):
        print(file)
    return 0


def _scripted(options: argparse.Namespace) -> int:
    options.policy = "scripted"
    return _evaluate(options)


def _play(options: argparse.Namespace) -> int:
    from training.commands.play import play

    flags = {
        "fidelity": options.fidelity,
        "reward_type": options.reward,
        "blocks": options.blocks,
        "show_forces": options.show_forces or None,
        "show_particles": options.show_particles or None,
    }
    arguments = {name: value for name, value in flags.items() if value is not None}
    if options.env_kwargs:
        _require("train", ("yaml",))
        arguments = {**env_kwargs_of(options), **arguments}
    play(options.env, seed=options.seed, **arguments)
    return 0


def _plot(options: argparse.Namespace) -> int:
    from training.results.plot import plot_learning_curves
    from training.runs.run_folder import RunFolder

    folders = [RunFolder(path) for path in options.runs] or [run_folder_of(options)]
    print(plot_learning_curves(folders, options.output))
    return 0


def _results(options: argparse.Namespace) -> int:
    from training.results.results import SOURCE, check_repository, update_results
    from training.results.results_page import check_pages

    repository = options.repository or SOURCE
    if not options.check:
        update_results(
            options.runs,
            options.log_folder,
            repository,
            episodes=options.n_episodes,
            replace=options.replace,
        )
        return 0
    if options.runs or options.replace:
        raise UsageError("--check records nothing: leave the run folders and --replace away")
    check_repository(repository)
    check_pages(repository)
    print("docs/results.md and README.md are what results/ says")
    return 0


def _tune(options: argparse.Namespace) -> int:
    config = config_of(options)

    from training.commands.tuning import PART, tune
    from training.settings.config import SACConfig, parse_settings

    # as many steps as were asked for, or a part of those that the settings have; none to finish on
    steps = config.n_timesteps if options.n_timesteps else max(1, config.n_timesteps // PART)
    full = configured(options)
    kept: dict[str, Any] = {}
    if isinstance(full, SACConfig) and "learning_starts" not in parse_settings(
        options.hyperparams, "--hyperparams"
    ):  # the same share of the steps is blind
        kept["learning_starts"] = full.learning_starts
        blind = full.learning_starts * steps // full.n_timesteps
        config = config.replace(learning_starts=blind)
    short = config.replace(n_timesteps=steps, finish_timesteps=0, finish_env_kwargs={})
    best = tune(
        short,
        options.log_folder,
        trials=options.n_trials,
        episodes=options.n_episodes,
        storage=options.storage,
        study_name=options.study_name,
        device=options.device,
        num_threads=options.num_threads,
    )
    if best.settings is not None:
        print(f"# {best.summary}")
        settings = best.settings.replace(
            **kept,
            n_timesteps=full.n_timesteps,
            finish_timesteps=full.finish_timesteps,
            finish_env_kwargs=full.finish_env_kwargs,
        )
        print(settings.as_yaml(), end="")
    return INTERRUPTED if best.interrupted else 0


def _demo(options: argparse.Namespace) -> int:
    config = config_of(options)

    from training.commands.demo import demo

    demo(
        config,
        options.log_folder,
        episodes=options.n_episodes,
        device=options.device,
        num_threads=options.num_threads,
    )
    return 0


def _require(extra: str, modules: Sequence[str]) -> None:
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        raise UsageError(
            f'this command needs {", ".join(missing)}: pip install "rigid-envs[{extra}]"'
        )


@contextmanager
def _telling_of_compilation() -> Iterator[None]:
    """Says on stderr what else would look like a command that hangs."""
    from physics.jit import telling  # not for --help, which it would make wait

    def tell(name: str) -> None:
        if name == "advance":
            print("compiling what this scene needs, once: 10 to 30 s", file=sys.stderr, flush=True)

    with telling(tell):
        yield


def _version() -> str:
    try:
        return metadata.version("rigid-envs")
    except metadata.PackageNotFoundError:
        return "from a source tree that is not installed"


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="rigid-envs", description="Train and watch policies on rigid bodies.")
    parser.add_argument("--version", action="version", version=f"%(prog)s {_version()}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(
        name: str,
        run: Any,
        summary: str,
        needs: tuple[str, Sequence[str]] = ("train", TRAIN_EXTRA),
        simulates: bool = True,
    ) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=summary, description=summary)
        added.set_defaults(run=run, needs=needs, simulates=simulates)
        return added

    training = command("train", _train, "Train a policy into a run folder of its own.")
    add_training(training)
    training.add_argument(
        "--resume", type=Path, metavar="RUN", help="go on with this run from its last checkpoint"
    )
    training.add_argument(
        "--save-freq", type=count, help="steps between checkpoints (default: a tenth of the run)"
    )

    evaluation = command("evaluate", _evaluate, "Measure how often a policy succeeds.")
    add_policy(evaluation)
    add_episodes(evaluation, 1000)

    recording = command("record", _record, "Film a policy: an mp4 or a GIF, and a still.")
    add_policy(recording)
    add_episodes(recording, 8)
    recording.add_argument(
        "-o",
        "--output",
        type=Path,
        help="mp4 or GIF to write, the latter small (default: video.mp4 in the run folder, or "
        "named as the policy file, beside it)",
    )

    exporting = command("export", _export, "Copy the policy of a run into one small file.")
    add_export(exporting)

    scripted = command("scripted", _scripted, "Measure the scripted controller of an environment.")
    scripted.add_argument("--env", default=DEMO_ENV, help="environment id (default: %(default)s)")
    add_episodes(scripted, 1000)

    playing = command(
        "play", _play, "Drive the tool by keyboard in a window.", ("render", RENDER_EXTRA)
    )
    add_play(playing)

    plotting = command(
        "plot", _plot, "Draw the learning curve of a run, or of several seeds.", simulates=False
    )
    add_plot(plotting)

    add_results(command("results", _results, "Record finished runs and write docs/results.md."))

    tuning = command(
        "tune", _tune, "Search settings by many short trainings.", ("tune", TUNE_EXTRA)
    )
    add_training(tuning)
    add_tuning(tuning)

    demonstration = command("demo", _demo, "Train, evaluate, film and plot, in one go.")
    add_training(demonstration)
    demonstration.add_argument(
        "--n-episodes", type=count, default=1000, help="to evaluate on (default: %(default)s)"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())

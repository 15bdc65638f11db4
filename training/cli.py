"""The command line: `rigid-envs COMMAND`, as train, evaluate, record, results, play.

Starts without Stable-Baselines3 or torch: each command imports what it needs, and says which extra
installs what is missing. Flags follow rl-baselines3-zoo where it has a counterpart.
"""

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from training.errors import UsageError
from training.flags import (
    DEMO_ALGO,
    DEMO_ENV,
    Parser,
    add_environment,
    add_episodes,
    add_latest,
    add_policy,
    add_results,
    add_training,
    add_tuning,
    count,
    whole,
)

if TYPE_CHECKING:
    from training.config import TrainConfig
    from training.policy import Policy
    from training.run_folder import RunFolder

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
# what commands tell an environment, or a function beside its arguments, themselves
OWN = {
    "seed": "give --seed",
    "episodes": "give --n-episodes",
    "num_envs": "only train takes it, as --n-envs",
    "env_id": "give --env; play takes it as its first word",
    "render_mode": "the command chooses it",
    "autoreset_mode": "the command chooses it",
    "vectorization_mode": "the command chooses it",
    "fps": "it is 25",
    "policy": "it is the first word",
    "video": "give --output",
    "quiet": "there is no such choice",
    "gif_width": "there is no such choice",
}
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
    config = _config(options) if options.resume is None else None
    if config is None:
        _refuse_contradictions(options)

    from training.demo import print_training
    from training.run_folder import RunFolder
    from training.train import resume, train

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
    from training.evaluate import FIRST_SEED, evaluate, print_evaluation

    policy = _policy(options)
    seed = FIRST_SEED if options.seed is None else options.seed
    result = evaluate(policy, options.n_episodes, seed=seed, **_env_kwargs(options))
    print_evaluation(policy, result)
    return 0


def _record(options: argparse.Namespace) -> int:
    from training.evaluate import FIRST_SEED
    from training.record import record

    policy = _policy(options)
    given = Path(options.policy) if options.policy else None
    beside = (policy.folder or options.log_folder / policy.name) / "video.mp4"
    if given is not None and given.suffix == ".policy":  # its folder may hold others
        beside = given.with_suffix(".mp4")
    video, still = record(
        policy,
        options.output or beside,
        episodes=options.n_episodes,
        seed=FIRST_SEED if options.seed is None else options.seed,
        **_env_kwargs(options),
    )
    print(f"video   {video}\npicture {still}")
    return 0


def _export(options: argparse.Namespace) -> int:
    from training.evaluate import FIRST_SEED, evaluate
    from training.export import export_run
    from training.policy_header import Success
    from training.trained_policy import trained_policy

    folder = _run_folder(options)
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
    from training.play import play

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
        arguments = {**_env_kwargs(options), **arguments}
    play(options.env, seed=options.seed, **arguments)
    return 0


def _plot(options: argparse.Namespace) -> int:
    from training.plot import plot_learning_curves
    from training.run_folder import RunFolder

    folders = [RunFolder(path) for path in options.runs] or [_run_folder(options)]
    print(plot_learning_curves(folders, options.output))
    return 0


def _results(options: argparse.Namespace) -> int:
    from training.results import SOURCE, check_repository, update_results
    from training.results_page import check_pages

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
    config = _config(options)

    from training.tuning import PART, tune

    # as many steps as were asked for, or a part of those that the settings have
    short = (
        config
        if options.n_timesteps
        else config.replace(n_timesteps=max(1, config.n_timesteps // PART))
    )
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
        full = _configured(options).n_timesteps
        print(best.settings.replace(n_timesteps=full).as_yaml(), end="")
    return INTERRUPTED if best.interrupted else 0


def _demo(options: argparse.Namespace) -> int:
    config = _config(options)

    from training.demo import demo

    demo(
        config,
        options.log_folder,
        episodes=options.n_episodes,
        device=options.device,
        num_threads=options.num_threads,
    )
    return 0


def _config(options: argparse.Namespace) -> "TrainConfig":
    return _changed(_configured(options), options)


def _configured(options: argparse.Namespace) -> "TrainConfig":
    """The settings of the file."""
    from training.config import load_config

    return load_config(options.algo or DEMO_ALGO, options.env or DEMO_ENV, options.config)


def _changed(config: "TrainConfig", options: argparse.Namespace) -> "TrainConfig":
    """The settings, with those that flags give in their place."""
    from training.config import parse_settings

    changes = parse_settings(options.hyperparams, "--hyperparams")
    for name in ("n_timesteps", "n_envs", "seed"):
        if getattr(options, name) is not None:
            changes[name] = getattr(options, name)
    changed_env = _env_kwargs(options)
    if changed_env:
        changes["env_kwargs"] = {**config.env_kwargs, **changed_env}
    return config.replace(**changes)


def _refuse_contradictions(options: argparse.Namespace) -> None:
    """Raises UsageError where flags would make the run to resume another one."""
    from training.run_folder import RunFolder

    if options.config is not None:
        raise UsageError("--config does not go with --resume: a run goes on with its own settings")
    config = RunFolder(options.resume).config()
    for name, given, own in (
        ("--algo", options.algo, config.algo),
        ("--env", options.env, config.env_id),
    ):
        if given not in (None, own):
            raise UsageError(f"{name} is {given!r}, but {options.resume} is a run of {own!r}")
    asked = _changed(config, options).as_mapping()
    for name, value in config.as_mapping().items():
        if asked[name] != value:
            raise UsageError(
                f"{name} is asked to be {asked[name]!r}, but {options.resume} has {value!r}, "
                "and a run goes on as it began: leave it away, or train anew"
            )


def _env_kwargs(options: argparse.Namespace) -> dict[str, Any]:
    from training.config import parse_settings

    given = parse_settings(options.env_kwargs, "--env-kwargs")
    for name in given:
        if name in OWN:
            raise UsageError(f"--env-kwargs: {name!r} is none of the environment's: {OWN[name]}")
    fidelity = {} if options.fidelity is None else {"fidelity": options.fidelity}
    return {**given, **fidelity}


def _policy(options: argparse.Namespace) -> "Policy":
    from training.policy import SCRIPTED, scripted_policy
    from training.trained_policy import trained_policy

    if options.policy == SCRIPTED:
        return scripted_policy(options.env or DEMO_ENV, **_env_kwargs(options))
    return trained_policy(
        Path(options.policy) if options.policy else _run_folder(options).path,
        algo=options.algo,
        env_id=options.env,
        deterministic=not options.stochastic,
        device=options.device,
        trust_pickle=options.trust_pickle,
    )


def _run_folder(options: argparse.Namespace) -> "RunFolder":
    from training.run_folder import RunFolder, latest_run

    if options.policy is not None:
        return RunFolder(Path(options.policy))
    return latest_run(options.log_folder, options.algo or DEMO_ALGO, options.env or DEMO_ENV)


def _require(extra: str, modules: Sequence[str]) -> None:
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        raise UsageError(
            f'this command needs {", ".join(missing)}: pip install "rigid-envs[{extra}]"'
        )


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="rigid-envs", description="Train and watch policies on rigid bodies.")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(
        name: str,
        run: Any,
        summary: str,
        needs: tuple[str, Sequence[str]] = ("train", TRAIN_EXTRA),
    ) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=summary, description=summary)
        added.set_defaults(run=run, needs=needs)
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
        help="mp4 or GIF to write, the latter small (default: video.mp4 in the run folder)",
    )

    exporting = command("export", _export, "Copy the policy of a run into one small file.")
    exporting.add_argument("policy", nargs="?", metavar="RUN", help="run folder (default: latest)")
    add_latest(exporting)
    exporting.add_argument(
        "-o", "--output", type=Path, help="file to write (default: <run>.policy, in this folder)"
    )
    exporting.add_argument(
        "-n", "--n-episodes", type=count, help="measure success on as many, and say so in the file"
    )
    exporting.add_argument(
        "--sb3", action="store_true", help="copy Stable-Baselines3's model and statistics too"
    )

    scripted = command("scripted", _scripted, "Measure the scripted controller of an environment.")
    scripted.add_argument("--env", default=DEMO_ENV, help="environment id (default: %(default)s)")
    add_episodes(scripted, 1000)

    playing = command(
        "play", _play, "Drive the tool by keyboard in a window.", ("render", RENDER_EXTRA)
    )
    playing.add_argument(
        "env", nargs="?", default=DEMO_ENV, help="environment id (default: %(default)s)"
    )
    playing.add_argument("--seed", type=whole, help="of the first episode (default: any)")
    playing.add_argument("--reward", choices=("sparse", "dense"), help="reward to show")
    playing.add_argument("--blocks", type=count, help="cubes to stack")
    playing.add_argument("--show-forces", action="store_true", help="draw contact forces")
    playing.add_argument(
        "--show-particles", action="store_true", help="draw what touches, not exact shapes"
    )
    add_environment(playing)

    plotting = command("plot", _plot, "Draw the learning curve of a run, or of several seeds.")
    plotting.add_argument(
        "runs",
        nargs="*",
        type=Path,
        metavar="RUN",
        help="run folder (default: latest); several are drawn with their mean and spread",
    )
    plotting.set_defaults(policy=None)
    add_latest(plotting)
    plotting.add_argument(
        "-o",
        "--output",
        type=Path,
        help="PNG (default: learning_curve.png in the run folder; of several, beside them)",
    )

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

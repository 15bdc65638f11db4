"""The command line: `rigid-envs train | evaluate | record | scripted | play | plot | demo`.

Starts without Stable-Baselines3 or torch: each command imports what it needs, and says which extra
installs what is missing. Flags follow rl-baselines3-zoo where it has a counterpart.
"""

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from training.errors import UsageError

if TYPE_CHECKING:
    from training.config import TrainConfig
    from training.policy import Policy
    from training.run_folder import RunFolder

DEMO_ALGO = "ppo"
DEMO_ENV = "RigidEnvs/Push-v0"
TRAIN_EXTRA = (
    "stable_baselines3",
    "torch",
    "yaml",
    "rich",
    "tensorboard",
    "matplotlib",
    "imageio",
    "imageio_ffmpeg",
)
RENDER_EXTRA = ("pygame",)
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
    config = _config(options)  # first: a mistake in it should not wait for torch

    from training.demo import print_training
    from training.train import train

    trained = train(
        config,
        options.log_folder,
        device=options.device,
        num_threads=options.num_threads,
        save_every=options.save_freq,
    )
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
    folder = policy.folder or options.log_folder / policy.name
    video, still = record(
        policy,
        options.output or folder / "video.mp4",
        episodes=options.n_episodes,
        seed=FIRST_SEED if options.seed is None else options.seed,
        **_env_kwargs(options),
    )
    print(f"video   {video}\npicture {still}")
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
    from training.plot import plot_learning_curve

    print(plot_learning_curve(_run_folder(options), options.output))
    return 0


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
    from training.config import load_config, parse_settings

    config = load_config(options.algo, options.env, options.config)
    changes = parse_settings(options.hyperparams, "--hyperparams")
    for name in ("n_timesteps", "n_envs", "seed"):
        if getattr(options, name) is not None:
            changes[name] = getattr(options, name)
    changed_env = _env_kwargs(options)
    if changed_env:
        changes["env_kwargs"] = {**config.env_kwargs, **changed_env}
    return config.replace(**changes)


def _env_kwargs(options: argparse.Namespace) -> dict[str, Any]:
    from training.config import parse_settings

    given = parse_settings(options.env_kwargs, "--env-kwargs")
    for name in given:
        if name in OWN:
            raise UsageError(f"--env-kwargs: {name!r} is none of the environment's: {OWN[name]}")
    fidelity = {} if options.fidelity is None else {"fidelity": options.fidelity}
    return {**given, **fidelity}


def _policy(options: argparse.Namespace) -> "Policy":
    from training.policy import SCRIPTED, scripted_policy, trained_policy

    if options.policy == SCRIPTED:
        return scripted_policy(options.env or DEMO_ENV, **_env_kwargs(options))
    return trained_policy(
        Path(options.policy) if options.policy else _run_folder(options).path,
        algo=options.algo,
        env_id=options.env,
        deterministic=not options.stochastic,
        device=options.device,
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


class _Parser(argparse.ArgumentParser):
    """Raises the user's mistakes instead of printing the whole usage and leaving."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see {self.prog} --help)")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="rigid-envs", description="Train and watch policies on rigid bodies.")
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
    _add_training(training)
    training.add_argument(
        "--save-freq", type=_count, help="steps between checkpoints (default: a tenth of the run)"
    )

    evaluation = command("evaluate", _evaluate, "Measure how often a policy succeeds.")
    _add_policy(evaluation)
    _add_episodes(evaluation, 1000)

    recording = command("record", _record, "Film a policy: an mp4 and a still.")
    _add_policy(recording)
    _add_episodes(recording, 8)
    recording.add_argument(
        "-o", "--output", type=Path, help="mp4 to write (default: video.mp4 in the run folder)"
    )

    scripted = command("scripted", _scripted, "Measure the scripted controller of an environment.")
    scripted.add_argument("--env", default=DEMO_ENV, help="environment id (default: %(default)s)")
    _add_episodes(scripted, 1000)

    playing = command(
        "play", _play, "Drive the tool by keyboard in a window.", ("render", RENDER_EXTRA)
    )
    playing.add_argument(
        "env", nargs="?", default=DEMO_ENV, help="environment id (default: %(default)s)"
    )
    playing.add_argument("--seed", type=_whole, help="of the first episode (default: any)")
    playing.add_argument("--reward", choices=("sparse", "dense"), help="reward to show")
    playing.add_argument("--blocks", type=_count, help="cubes to stack")
    playing.add_argument("--show-forces", action="store_true", help="draw contact forces")
    playing.add_argument(
        "--show-particles", action="store_true", help="draw what touches, not exact shapes"
    )
    _add_environment(playing)

    plotting = command("plot", _plot, "Draw the learning curve of a run.")
    plotting.add_argument("policy", nargs="?", metavar="RUN", help="run folder (default: latest)")
    _add_latest(plotting)
    plotting.add_argument(
        "-o", "--output", type=Path, help="PNG (default: learning_curve.png in the run folder)"
    )

    demonstration = command("demo", _demo, "Train, evaluate, film and plot, in one go.")
    _add_training(demonstration)
    demonstration.add_argument(
        "--n-episodes", type=_count, default=1000, help="to evaluate on (default: %(default)s)"
    )
    return parser


def _add_training(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--algo", default=DEMO_ALGO, help="algorithm, ppo or sac (default: %(default)s)"
    )
    parser.add_argument("--env", default=DEMO_ENV, help="environment id (default: %(default)s)")
    parser.add_argument("--config", type=Path, help="YAML file (default: configs/<algo>.yaml)")
    parser.add_argument("-n", "--n-timesteps", type=_count, help="environment steps to train for")
    parser.add_argument("--n-envs", type=_count, help="worlds simulated side by side")
    parser.add_argument("--seed", type=_whole, help="seed of worlds and network")
    parser.add_argument(
        "-params",
        "--hyperparams",
        nargs="+",
        default=[],
        metavar="KEY:VALUE",
        help="settings over those of the file, as in n_epochs:4 gamma:0.95",
    )
    parser.add_argument("--num-threads", type=_count, help="threads of torch (default: at most 2)")
    _add_folder(parser)
    _add_environment(parser)
    _add_device(parser)


def _add_policy(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "policy",
        nargs="?",
        metavar="POLICY",
        help='run folder, model.zip or "scripted" (default: latest run of --algo on --env)',
    )
    _add_latest(parser)
    _add_device(parser)
    parser.add_argument("--stochastic", action="store_true", help="draw actions, not their mean")


def _add_latest(parser: argparse.ArgumentParser) -> None:
    """What finds the latest run, and describes a model.zip that lies in no run folder."""
    parser.add_argument("--algo", help=f"algorithm, ppo or sac (default: the run's, {DEMO_ALGO})")
    parser.add_argument("--env", help=f"environment id (default: the run's, {DEMO_ENV})")
    _add_folder(parser)


def _add_folder(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-f",
        "--log-folder",
        type=Path,
        default=Path("runs"),
        help="where run folders are (default: %(default)s)",
    )


def _add_episodes(parser: argparse.ArgumentParser, default: int) -> None:
    parser.add_argument(
        "-n", "--n-episodes", type=_count, default=default, help="(default: %(default)s)"
    )
    parser.add_argument("--seed", type=_whole, help="of the first episode (default: 1000000)")
    _add_environment(parser)


def _add_environment(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--fidelity", help="fidelity preset (default: as configured)")
    parser.add_argument(
        "--env-kwargs",
        nargs="+",
        default=[],
        metavar="KEY:VALUE",
        help="arguments of the environment, as in reward_type:sparse",
    )


def _add_device(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--device", default="cpu", help="torch device of the networks (default: %(default)s)"
    )


def _count(text: str) -> int:
    """Reads an integer of at least 1; 1e6 and 1_000_000 are fine."""
    value = _whole(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} should be an integer of at least 1")
    return value


def _whole(text: str) -> int:
    """Reads an integer of at least 0."""
    try:
        value = float(text)
        if value >= 0 and value.is_integer():
            return int(value)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"{text!r} should be an integer of at least 0")


if __name__ == "__main__":
    sys.exit(main())

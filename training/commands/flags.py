"""Flags that several commands share, and what their words may be."""

import argparse
from pathlib import Path
from typing import NoReturn

from training.settings.errors import UsageError

DEMO_ALGO = "ppo"
DEMO_ENV = "RigidEnvs/Push-v0"


class Parser(argparse.ArgumentParser):
    """Raises the user's mistakes instead of printing the whole usage and leaving."""

    def error(self, message: str) -> NoReturn:
        """Raises UsageError, whose line the caller prints."""
        raise UsageError(f"{message} (see {self.prog} --help)")


def add_training(parser: argparse.ArgumentParser) -> None:
    """What decides a training run, and the machine it runs on."""
    parser.add_argument(
        "--algo", help=f"algorithm, ppo or sac (default: {DEMO_ALGO}, or that of the run)"
    )
    parser.add_argument("--env", help=f"environment id (default: {DEMO_ENV}, or that of the run)")
    parser.add_argument("--config", type=Path, help="YAML file (default: configs/<algo>.yaml)")
    parser.add_argument("-n", "--n-timesteps", type=count, help="environment steps to train for")
    parser.add_argument("--n-envs", type=count, help="worlds simulated side by side")
    parser.add_argument("--seed", type=whole, help="seed of worlds and network")
    parser.add_argument(
        "-params",
        "--hyperparams",
        nargs="+",
        default=[],
        metavar="KEY:VALUE",
        help="settings over those of the file, as in n_epochs:4 gamma:0.95",
    )
    parser.add_argument("--num-threads", type=count, help="threads of torch (default: at most 2)")
    add_folder(parser)
    add_environment(parser)
    add_device(parser)


def add_policy(parser: argparse.ArgumentParser) -> None:
    """What acts, and how."""
    parser.add_argument(
        "policy",
        nargs="?",
        metavar="POLICY",
        help='run folder, .policy file, model.zip or "scripted" '
        "(default: latest run of --algo on --env)",
    )
    add_latest(parser)
    add_device(parser)
    parser.add_argument(
        "--stochastic",
        action="store_true",
        help="draw actions, not their mean; takes model.zip, and so --trust-pickle",
    )
    parser.add_argument(
        "--trust-pickle",
        action="store_true",
        help="load model.zip, which can run any code in it: only if you trust who made it",
    )


def add_latest(parser: argparse.ArgumentParser) -> None:
    """What finds the latest run, and describes a model.zip that lies in no run folder."""
    parser.add_argument("--algo", help=f"algorithm, ppo or sac (default: the run's, {DEMO_ALGO})")
    parser.add_argument("--env", help=f"environment id (default: the run's, {DEMO_ENV})")
    add_folder(parser)


def add_export(parser: argparse.ArgumentParser) -> None:
    """What is copied, and where to."""
    parser.add_argument("policy", nargs="?", metavar="RUN", help="run folder (default: latest)")
    add_latest(parser)
    parser.add_argument(
        "-o", "--output", type=Path, help="file to write (default: <run>.policy, in this folder)"
    )
    parser.add_argument(
        "-n", "--n-episodes", type=count, help="measure success on as many, and say so in the file"
    )
    parser.add_argument(
        "--sb3", action="store_true", help="copy Stable-Baselines3's model and statistics too"
    )


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Which runs are drawn, and where to."""
    parser.add_argument(
        "runs",
        nargs="*",
        type=Path,
        metavar="RUN",
        help="run folder (default: latest); several are drawn with their mean and spread",
    )
    parser.set_defaults(policy=None)
    add_latest(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        help="PNG (default: learning_curve.png in the run folder; of several, beside them)",
    )


def add_play(parser: argparse.ArgumentParser) -> None:
    """What is played, and what of it is shown."""
    parser.add_argument(
        "env", nargs="?", default=DEMO_ENV, help="environment id (default: %(default)s)"
    )
    parser.add_argument("--seed", type=whole, help="of the first episode (default: any)")
    parser.add_argument("--reward", choices=("sparse", "dense"), help="reward to show")
    parser.add_argument("--blocks", type=count, help="cubes to stack")
    parser.add_argument("--show-forces", action="store_true", help="draw contact forces")
    parser.add_argument(
        "--show-particles", action="store_true", help="draw what touches, not exact shapes"
    )
    add_environment(parser)


def add_results(parser: argparse.ArgumentParser) -> None:
    """What is recorded, and where."""
    parser.add_argument(
        "runs",
        nargs="*",
        type=Path,
        metavar="RUN",
        help="run folder (default: all that are finished and not recorded yet)",
    )
    add_folder(parser)
    parser.add_argument(
        "-n", "--n-episodes", type=count, default=1000, help="(default: %(default)s)"
    )
    parser.add_argument(
        "--replace", action="store_true", help="put these runs in the place of others of their seed"
    )
    parser.add_argument(
        "--check", action="store_true", help="only say whether the texts are what results/ says"
    )
    parser.add_argument(
        "--repository", type=Path, help="clone that keeps results (default: this one)"
    )


def add_tuning(parser: argparse.ArgumentParser) -> None:
    """How much is tried, and where it is kept."""
    parser.add_argument(
        "--n-trials",
        type=count,
        default=50,
        help="trainings in all, of former commands too (default: %(default)s)",
    )
    parser.add_argument(
        "--n-episodes",
        type=count,
        default=1000,
        help="to measure each policy on (default: %(default)s)",
    )
    parser.add_argument(
        "--storage",
        help="SQLite file or URL of a database (default: <environment>_tuning.db among the runs)",
    )
    parser.add_argument("--study-name", help="of the study in it (default: <algo>-<environment>)")


def add_folder(parser: argparse.ArgumentParser) -> None:
    """Where runs are kept."""
    parser.add_argument(
        "-f",
        "--log-folder",
        type=Path,
        default=Path("runs"),
        help="where run folders are (default: %(default)s)",
    )


def add_episodes(parser: argparse.ArgumentParser, default: int) -> None:
    """How many episodes to play, from which seed, on which environment."""
    parser.add_argument(
        "-n", "--n-episodes", type=count, default=default, help="(default: %(default)s)"
    )
    parser.add_argument("--seed", type=whole, help="of the first episode (default: 1000000)")
    add_environment(parser)


def add_environment(parser: argparse.ArgumentParser) -> None:
    """Arguments of the environment."""
    parser.add_argument("--fidelity", help="fidelity preset (default: as configured)")
    parser.add_argument(
        "--env-kwargs",
        nargs="+",
        default=[],
        metavar="KEY:VALUE",
        help="arguments of the environment, as in reward_type:sparse",
    )


def add_device(parser: argparse.ArgumentParser) -> None:
    """Where networks run."""
    parser.add_argument(
        "--device", default="cpu", help="torch device of the networks (default: %(default)s)"
    )


def count(text: str) -> int:
    """Reads an integer of at least 1; 1e6 and 1_000_000 are fine."""
    return _integer(text, 1)


def whole(text: str) -> int:
    """Reads an integer of at least 0."""
    return _integer(text, 0)


def _integer(text: str, least: int) -> int:
    try:
        value = float(text)
        if value >= least and value.is_integer():
            return int(value)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"{text!r} should be an integer of at least {least}")

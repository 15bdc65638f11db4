"""Command-line flags of all commands, and the valid values of their numbers."""

import argparse
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from training.commands.seeds import seeds
from training.settings.errors import UsageError

DEFAULT_ALGO = "ppo"
DEFAULT_ENV = "RigidEnvs/Push-v0"


class Parser(argparse.ArgumentParser):
    """Raises UsageError for invalid arguments instead of printing the usage and exiting."""

    def error(self, message: str) -> NoReturn:
        """Raises UsageError, whose line the caller prints."""
        raise UsageError(f"{message} (see {self.prog} --help)")


def add_training(parser: argparse.ArgumentParser) -> None:
    """Flags for the settings of training, and for the machine."""
    parser.add_argument(
        "--algo",
        help=f"algorithm: ppo or sac (default: {DEFAULT_ALGO}; with --resume, that of the run)",
    )
    parser.add_argument(
        "--env",
        help=f"environment id (default: {DEFAULT_ENV}; with --resume, that of the run)",
    )
    parser.add_argument(
        "--config", type=Path, help="YAML file of settings (default: configs/<algo>.yaml)"
    )
    parser.add_argument(
        "-n", "--n-timesteps", type=count, help="environment steps, summed over worlds"
    )
    parser.add_argument("--n-envs", type=count, help="number of worlds simulated in parallel")
    parser.add_argument("--seed", type=whole, help="seed of worlds, network and sampling")
    parser.add_argument(
        "-params",
        "--hyperparams",
        nargs="+",
        default=[],
        metavar="KEY:VALUE",
        help="settings that replace those of the file, as in n_epochs:4 gamma:0.95",
    )
    parser.add_argument(
        "--demonstrations",
        metavar="DATASET",
        help="Minari dataset from which SAC samples a part of each batch; see rigid-envs dataset",
    )
    parser.add_argument(
        "--num-threads", type=count, default=1, help="number of torch threads (default: 1)"
    )
    add_folder(parser)
    add_environment(parser)
    add_device(parser)


def add_runs(parser: argparse.ArgumentParser) -> None:
    """Flags of train: which runs, and their checkpoints."""
    parser.add_argument(
        "--seeds", type=seeds, metavar="LIST",
        help="train one run for each of these seeds, as in 0-9 or 0-2,5",
    )  # fmt: skip
    add_ray(parser)
    parser.add_argument(
        "--resume", type=Path, metavar="RUN", help="resume this run from its last checkpoint"
    )
    parser.add_argument(
        "--save-freq",
        type=count,
        help="steps between checkpoints (default: a tenth of the run)",
    )


def add_ray(parser: argparse.ArgumentParser) -> None:
    """The flag for a Ray cluster."""
    parser.add_argument(
        "--ray", nargs="?", const="", metavar="ADDRESS",
        help="work on the nodes of the Ray cluster at HOST:PORT (default: that of this machine, or "
        "a new one); each run or trial takes --num-threads CPUs",
    )  # fmt: skip


def add_policy(parser: argparse.ArgumentParser) -> None:
    """Flags for the choice of a policy."""
    parser.add_argument(
        "policy",
        nargs="?",
        metavar="POLICY",
        help='run folder, .safetensors file, model.zip, "trained" (comes with it) or "scripted" '
        "(default: the run started last)",
    )
    add_latest(parser)
    add_device(parser)
    parser.add_argument(
        "--stochastic",
        action="store_true",
        help="sample actions instead of using their mean; reads model.zip, so it requires "
        "--trust-pickle",
    )
    parser.add_argument(
        "--trust-pickle",
        action="store_true",
        help="load model.zip, which can run any code; use it only if you trust its author",
    )


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Flags of a scene of many bodies."""
    parser.add_argument(
        "scene", metavar="SCENE", help="chess, tori, pyramid, dominoes, rubble or heap"
    )
    parser.add_argument(
        "--bodies", type=count, default=1000, help="number of bodies (default: %(default)s)"
    )
    parser.add_argument(
        "--seconds", type=positive, default=2.0, help="simulated time (default: %(default)s)"
    )
    parser.add_argument("--seed", type=whole, help="of what is random in the scene (default: 0)")
    parser.add_argument("--threads", type=count, help="(default: all cores)")
    parser.add_argument(
        "--fidelity", help="preset of the physics (default: the fidelity that suits the scene)"
    )
    parser.add_argument("--video", type=Path, metavar="FILE", help="mp4 or GIF to write")
    parser.add_argument(
        "--size", type=count, default=480,
        help="width and height of the video in pixels (default: %(default)s)",
    )  # fmt: skip


def add_fidelity_tuning(parser: argparse.ArgumentParser) -> None:
    """Flags of the search for a fidelity."""
    parser.set_defaults(
        algo=None, fidelity=None, stochastic=False, trust_pickle=False, device="cpu"
    )
    parser.add_argument(
        "--env", help=f"environment id (default: that of the policy, or {DEFAULT_ENV})"
    )
    parser.add_argument(
        "--policy", default="scripted", metavar="POLICY",
        help='whose actions are repeated: run folder, .safetensors file, "trained" or "scripted" '
        "(default)",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=positive, default=1e-3,
        help="largest error, in the unit of the metric (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--metric", default="position",
        help="position (m), orientation (rad), velocity (m/s), energy (relative) or penetration "
        "(m); default: position",
    )  # fmt: skip
    parser.add_argument(
        "--time", type=positive, default=1.0, help="s of each episode (default: %(default)s)"
    )
    parser.add_argument(
        "--law",
        help="contact law of the reference: spring or impulse (default: impulse, or spring where "
        "only that converges)",
    )
    parser.add_argument("--seed", type=whole, help="of the first episode (default: 0)")
    add_env_kwargs(parser)
    add_folder(parser)


def add_latest(parser: argparse.ArgumentParser) -> None:
    """Flags that select the run started last, or describe a model.zip outside a run folder."""
    parser.add_argument(
        "--algo",
        help="algorithm: ppo or sac (default: that of the policy or of the run started last)",
    )
    parser.add_argument(
        "--env",
        help=f"environment id (default: likewise; of trained and scripted: {DEFAULT_ENV})",
    )
    add_folder(parser)


def add_export(parser: argparse.ArgumentParser) -> None:
    """Flags of export."""
    parser.add_argument(
        "policy", nargs="?", metavar="RUN", help="run folder (default: the run started last)"
    )
    add_latest(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        help="file to write (default: <run>.safetensors in the current folder)",
    )
    parser.add_argument(
        "-n",
        "--n-episodes",
        type=count,
        help="measure the success rate on this many episodes and store it in the file",
    )
    parser.add_argument(
        "--sb3",
        action="store_true",
        help="also copy Stable-Baselines3's model and observation statistics",
    )


def add_plot(parser: argparse.ArgumentParser) -> None:
    """Flags of plot."""
    parser.add_argument(
        "runs",
        nargs="*",
        type=Path,
        metavar="RUN",
        help="run folder (default: the run started last); several runs are plotted with their mean "
        "and range",
    )
    parser.set_defaults(policy=None)
    add_latest(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        help="PNG to write (default: learning_curve.png in the run folder; for several runs, a "
        "file next to their folders)",
    )


def add_play(parser: argparse.ArgumentParser) -> None:
    """Flags of play."""
    parser.add_argument(
        "env", nargs="?", default=DEFAULT_ENV, help="environment id (default: %(default)s)"
    )
    parser.add_argument("--seed", type=whole, help="seed of the first episode (default: random)")
    parser.add_argument("--reward", choices=("sparse", "dense"), help="reward type to display")
    parser.add_argument("--blocks", type=count, help="number of cubes (Stack only)")
    parser.add_argument("--show-forces", action="store_true", help="draw contact forces")
    parser.add_argument(
        "--show-particles",
        action="store_true",
        help="draw the particles used for contact instead of the exact shapes",
    )
    add_environment(parser)


def add_view(parser: argparse.ArgumentParser) -> None:
    """Flags of view."""
    parser.add_argument(
        "--env", help=f"environment id (default: that of the policy, or {DEFAULT_ENV})"
    )
    parser.add_argument(
        "--policy",
        metavar="POLICY",
        help='run folder, .safetensors file, "trained" or "scripted" (default: random actions)',
    )
    parser.add_argument(
        "--num-worlds", type=count, default=16, help="number of worlds (default: %(default)s)"
    )
    parser.add_argument(
        "--seed", type=whole, default=0, help="seed of the first world (default: %(default)s)"
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to listen on (default: %(default)s, which only this machine can reach)",
    )
    parser.add_argument(
        "--port", type=port, default=8080, help="port to listen on (default: %(default)s)"
    )
    add_environment(parser)
    # a model.zip is not accepted: it would have to be unpickled
    parser.set_defaults(algo=None, device="cpu", stochastic=False, trust_pickle=False)


def add_dataset(parser: argparse.ArgumentParser) -> None:
    """Flags of dataset."""
    parser.add_argument(
        "--env", help=f"environment id (default: that of the policy, or {DEFAULT_ENV})"
    )
    parser.add_argument(
        "--policy",
        default="scripted",
        metavar="POLICY",
        help='run folder, .safetensors file, "trained", "scripted" (default) or "random"',
    )
    parser.add_argument(
        "-n",
        "--episodes",
        dest="n_episodes",
        type=count,
        default=1000,
        help="number of episodes (default: %(default)s)",
    )
    parser.add_argument(
        "--dataset-id",
        metavar="NAME",
        help="name in Minari (default: of environment and policy, as rigid-envs/push/scripted-v0)",
    )
    parser.add_argument("--seed", type=whole, help="seed of the first episode (default: 2000000)")
    parser.add_argument("--replace", action="store_true", help="replace a dataset of the same name")
    add_environment(parser)
    # a model.zip is not accepted: it would have to be unpickled
    parser.set_defaults(algo=None, device="cpu", stochastic=False, trust_pickle=False)


def add_results(parser: argparse.ArgumentParser) -> None:
    """Flags of results."""
    parser.add_argument(
        "runs",
        nargs="*",
        type=Path,
        metavar="RUN",
        help="run folder (default: all finished runs that are not recorded yet)",
    )
    add_folder(parser)
    parser.add_argument(
        "-n",
        "--n-episodes",
        type=count,
        default=1000,
        help="episodes of each evaluation (default: %(default)s)",
    )
    parser.add_argument(
        "--replace", action="store_true", help="replace recorded runs that have the same seed"
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="write nothing; fail if docs/results.md or README.md is out of date",
    )
    parser.add_argument(
        "--repository",
        type=Path,
        help="clone of this project that stores the results (default: the one of this program)",
    )


def add_tuning(parser: argparse.ArgumentParser) -> None:
    """Flags of tune."""
    parser.add_argument(
        "--n-trials",
        type=count,
        default=50,
        help="number of trials in total, including those of earlier calls (default: %(default)s)",
    )
    parser.add_argument(
        "--n-episodes",
        type=count,
        default=1000,
        help="episodes of each evaluation (default: %(default)s)",
    )
    parser.add_argument(
        "--storage",
        help="SQLite file or database URL (default: <environment>_tuning.db in the folder of runs)",
    )
    add_ray(parser)
    parser.add_argument(
        "--study-name", help="name of the study in the database (default: <algo>-<environment>)"
    )


def add_folder(parser: argparse.ArgumentParser) -> None:
    """The flag for the folder of runs."""
    parser.add_argument(
        "-f",
        "--log-folder",
        type=Path,
        default=Path("runs"),
        help="folder of the run folders (default: %(default)s)",
    )


def add_episodes(parser: argparse.ArgumentParser, default: int) -> None:
    """Flags for episodes to play: their number, seeds and environment."""
    parser.add_argument(
        "-n",
        "--n-episodes",
        type=count,
        default=default,
        help="number of episodes (default: %(default)s)",
    )
    parser.add_argument("--seed", type=whole, help="seed of the first episode (default: 1000000)")
    add_environment(parser)


def add_environment(parser: argparse.ArgumentParser) -> None:
    """Flags for arguments of the environment."""
    parser.add_argument(
        "--fidelity",
        help="fidelity preset: fast, balanced, accurate or solid (default: as in the settings or "
        "the policy, otherwise balanced)",
    )
    add_env_kwargs(parser)


def add_env_kwargs(parser: argparse.ArgumentParser) -> None:
    """The flag for arguments of the environment."""
    parser.add_argument(
        "--env-kwargs",
        nargs="+",
        default=[],
        metavar="KEY:VALUE",
        help="arguments of the environment, as in reward_type:sparse",
    )


def add_device(parser: argparse.ArgumentParser) -> None:
    """The flag for the device of the networks."""
    parser.add_argument(
        "--device", default="cpu", help="torch device of the networks (default: %(default)s)"
    )


def count(text: str) -> int:
    """Parses an integer of at least 1; 1e6 and 1_000_000 are valid."""
    return _integer(text, 1)


def whole(text: str) -> int:
    """Parses an integer of at least 0."""
    return _integer(text, 0)


def port(text: str) -> int:
    """Parses a port: an integer from 0, for a free one, to 65535."""
    value = _integer(text, 0)
    if value > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} should be a port, at most 65535")
    return value


def positive(text: str) -> float:
    """Parses a finite number above 0."""
    with suppress(ValueError):
        value = float(text)
        if 0.0 < value < float("inf"):
            return value
    raise argparse.ArgumentTypeError(f"{text!r} should be a finite number above 0")


def _integer(text: str, least: int) -> int:
    with suppress(ValueError):
        value = float(text)
        if value >= least and value.is_integer():
            return int(value)
    raise argparse.ArgumentTypeError(f"{text!r} should be an integer of at least {least}")

"""Command-line flags that several commands have."""

import argparse
from pathlib import Path

from training.commands.values import count, whole

DEFAULT_ALGO = "ppo"
DEFAULT_ENV = "RigidEnvs/Push-v0"


def add_training(parser: argparse.ArgumentParser) -> None:
    """Flags for the settings of training, and for the machine."""
    parser.add_argument(
        "--algo",
        help=f"algorithm: ppo or sac (default: {DEFAULT_ALGO})",
    )
    parser.add_argument(
        "--env",
        help=f"environment id (default: {DEFAULT_ENV})",
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

"""The parser of the command line, and the flags that one command has."""

import argparse
from pathlib import Path
from typing import NoReturn

from training.commands.seeds import seeds
from training.commands.shared_flags import (
    DEFAULT_ENV,
    add_env_kwargs,
    add_environment,
    add_folder,
    add_latest,
    add_ray,
)
from training.commands.values import count, port, positive, whole
from training.settings.errors import UsageError


class Parser(argparse.ArgumentParser):
    """Raises UsageError for invalid arguments instead of printing the usage and exiting."""

    def error(self, message: str) -> NoReturn:
        """Raises UsageError, whose line the caller prints."""
        raise UsageError(f"{message} (see {self.prog} --help)")


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


def add_compiling(parser: argparse.ArgumentParser) -> None:
    """Flags of compiling ahead of time."""
    parser.add_argument(
        "ids", nargs="*", metavar="ID", help="environments (default: all tasks but twins)"
    )
    parser.add_argument(
        "--fidelity", nargs="+", default=[], metavar="PRESET",
        help="fast, balanced, accurate or solid (default: all)",
    )  # fmt: skip
    parser.add_argument(
        "--general-only", action="store_true",
        help="only the general kernels, which run nearly every scene",
    )  # fmt: skip
    parser.add_argument(
        "--level",
        help="x86-64-v3 or x86-64-v4: for all processors of this level, instead of for this one",
    )  # fmt: skip
    parser.add_argument(
        "--into", type=Path, metavar="FOLDER",
        help="write the kernels there, for a wheel (default: the cache of this machine)",
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


def add_original(parser: argparse.ArgumentParser) -> None:
    """Flags of an evaluation in another suite's environment."""
    parser.add_argument(
        "--in",
        dest="original",
        metavar="ID",
        help="play the episodes in the original of a twin instead, as FetchPush-v4 or PandaPush-v3",
    )
    parser.add_argument(
        "--python",
        type=Path,
        metavar="INTERPRETER",
        help="interpreter that has the original (default: that of `make twins`, or this one)",
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
        "--n-episodes",
        dest="n_episodes",
        type=count,
        default=1000,
        help="number of episodes (default: %(default)s)",
    )
    parser.add_argument(
        "--dataset-id",
        metavar="NAME",
        help="name in Minari (default: of task and policy, as rigid-envs/push/scripted-v0)",
    )
    parser.add_argument("--seed", type=whole, help="seed of the first episode (default: 2000000)")
    parser.add_argument(
        "--action-noise",
        type=float,
        default=0.0,
        metavar="DEVIATION",
        help="standard deviation of noise on the actions (default: 0)",
    )
    parser.add_argument(
        "--slowdown",
        type=float,
        default=0.0,
        metavar="S",
        help="multiply each step's movement by a number drawn from 1 - S to 1 (default: 0)",
    )
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
        help="write nothing; fail if docs/results.md, docs/twins.md or README.md is out of date",
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

"""Where the time of training goes: python -m benchmarks.learning [--tasks push throw].

Trains by PPO with the settings of configs/ppo.yaml for a fixed number of steps, and measures the
time of each part without that of the parts that it calls. Networks are torch's time; buffers,
normalisation, monitor and the loops around them are that of Stable-Baselines3.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import perf_counter
from typing import Any
from unittest.mock import patch

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import DictRolloutBuffer
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import save
from benchmarks.report.tables import Cell, Table, plain
from rigid_envs import RigidVectorEnv
from training.sb3.evaluation import SuccessEvaluation
from training.sb3.train import train
from training.sb3.vec_env import RigidVecEnv
from training.settings.config_file import load_config

STEPS = 400_000
IDS = {"push": "RigidEnvs/Push-v0", "throw": "RigidEnvs/Throw-v0", "stack": "RigidEnvs/Stack-v0"}
# function, whose time it is, and part; a part may have several functions
PARTS: list[tuple[Any, str, str, str]] = [
    (RigidVectorEnv, "step", "this project", "environments: physics, observation, reward"),
    (RigidVecEnv, "step_wait", "this project", "adapter to VecEnv"),
    (VecMonitor, "step_wait", "Stable-Baselines3", "monitor"),
    (VecNormalize, "step_wait", "Stable-Baselines3", "normalisation"),
    (ActorCriticPolicy, "forward", "torch", "networks: actions and values"),
    (DictRolloutBuffer, "add", "Stable-Baselines3", "buffer: storing steps"),
    (DictRolloutBuffer, "compute_returns_and_advantage", "Stable-Baselines3", "buffer: advantages"),
    (DictRolloutBuffer, "_get_samples", "Stable-Baselines3", "buffer: minibatches"),
    (ActorCriticPolicy, "evaluate_actions", "torch", "networks: learning"),
    (torch.Tensor, "backward", "torch", "networks: learning"),
    (torch.optim.Adam, "step", "torch", "networks: learning"),
    (PPO, "train", "Stable-Baselines3", "loop over minibatches, losses"),
    (PPO, "collect_rollouts", "Stable-Baselines3", "loop over steps, callbacks"),
    (SuccessEvaluation, "_on_rollout_end", "this project", "evaluation of the mean action"),
]


class Clock:
    """Adds up the time of functions, each without that of other timed functions that it calls."""

    def __init__(self) -> None:
        self.seconds: dict[tuple[str, str], float] = {}
        self._inner = [0.0]  # of the calls in progress: time of what they called

    def timed(self, function: Callable[..., Any], part: tuple[str, str]) -> Callable[..., Any]:
        """The function, with its time added to a part."""

        def call(*arguments: Any, **keywords: Any) -> Any:
            self._inner.append(0.0)
            start = perf_counter()
            try:
                return function(*arguments, **keywords)
            finally:
                whole = perf_counter() - start
                own = whole - self._inner.pop()
                self._inner[-1] += whole
                self.seconds[part] = self.seconds.get(part, 0.0) + own

        return call


@contextmanager
def clocked() -> Iterator[Clock]:
    """Times the functions of PARTS meanwhile."""
    clock = Clock()
    with ExitStack() as patches:
        for owner, name, whose, part in PARTS:
            timed = clock.timed(getattr(owner, name), (part, whose))
            patches.enter_context(patch.object(owner, name, timed))
        yield clock


def measure(task: str, steps: int) -> Table:
    """The time of each part in a training of a task."""
    config = load_config("ppo", IDS[task]).replace(
        n_timesteps=steps, target_success_rate=None, finetune_timesteps=0, finetune_env_kwargs={}
    )
    with tempfile.TemporaryDirectory() as folder:
        # compiles the kernels
        train(config.replace(n_timesteps=config.n_envs), Path(folder), quiet=True)
        with clocked() as clock:
            result = train(config, Path(folder), quiet=True)
    parts = {**clock.seconds}
    parts["the rest: checkpoints, start", "all"] = result.seconds - sum(parts.values())
    rows: list[list[Cell]] = [
        [part, whose, 1e6 * seconds / result.steps, seconds / result.seconds]
        for (part, whose), seconds in sorted(parts.items(), key=lambda item: -item[1])
    ]
    rows.append(["all", "", 1e6 * result.seconds / result.steps, 1.0])
    title = f"Training {task.capitalize()}: {result.steps / result.seconds:,.0f} steps a second"
    return Table(f"learning {task}", title, ["part", "whose", "us a step", "fraction"], rows)


def main() -> None:
    """Prints and saves the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.learning", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--tasks", nargs="+", choices=list(IDS), default=["push", "throw"])
    parser.add_argument("--steps", type=int, default=STEPS, help="of a training (%(default)s)")
    options = parser.parse_args()
    this_run = provenance()
    print(describe(this_run))
    for task in options.tasks:
        table = measure(task, options.steps)
        print(plain(table) + "\n", flush=True)
        save([table], this_run, keep=True)


if __name__ == "__main__":
    main()

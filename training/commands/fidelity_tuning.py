"""Finds the cheapest fidelity that moves a task's solids as a fine simulation does."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from physics import Tuned, World, tune
from physics.scene.fidelity import LAWS
from physics.scene.validation import choice
from physics.tuning.metrics import METRICS
from physics.tuning.motion import FRAME
from rigid_envs.episodes.runner import Runner
from rigid_envs.vector_env import RigidVectorEnv
from training.policies.policy import Policy
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError

Array = np.ndarray

WORLDS = 16  # episodes
RECORDED_AT = "balanced"  # fidelity at which the actions are recorded


def recorded(
    policy: Policy, steps: int, seed: int, **env_kwargs: Any
) -> tuple[RigidVectorEnv, Array]:
    """Plays episodes, and returns their environment at the start and the actions.

    Args:
        policy: what acts.
        steps: number of environment steps.
        seed: of the first episode.
        env_kwargs: arguments of the environment that replace those of the policy's training.

    Returns:
        The vector environment, reset to the start of the episodes, and actions [steps, worlds, n].

    Raises:
        UsageError: bodies are to be randomized, or it isn't an environment of rigid-envs.
    """
    if env_kwargs.get("randomize"):
        raise UsageError(
            "--env-kwargs: 'randomize' is not allowed here: errors are measured with the "
            "parameters of the scene, so leave it out"
        )
    kwargs = {**policy.env_kwargs, **env_kwargs, "max_episode_steps": -1}
    kwargs.setdefault("fidelity", RECORDED_AT)
    kwargs.pop("randomize", None)  # of a policy that was trained with it
    envs = make_vector_env(policy.env_id, WORLDS, **kwargs).unwrapped
    if not isinstance(envs, RigidVectorEnv):
        raise UsageError(f"{policy.env_id} has no fidelity: it isn't an environment of rigid-envs")
    if envs.runner.task.parts > 1:
        raise UsageError(
            f"{policy.env_id} commands its drives {envs.runner.task.parts} times in a step, which "
            "can't be repeated at other fidelities: tune with an environment that does so once"
        )
    policy.check(envs.single_observation_space)
    observation, _ = envs.reset(seed=seed)
    actions = []
    for _ in range(steps):
        # as the environment takes them, for rounding them would change the motion
        actions.append(np.asarray(policy.act(observation), dtype=np.float32))
        observation, *_ = envs.step(actions[-1])
    envs.reset(seed=seed)
    return envs, np.stack(actions).astype(np.float64)


def course(runner: Runner, actions: Array) -> tuple[Callable[[World], None], Any]:
    """What happens in the worlds of an environment: its present state, then these actions."""
    world, task = runner.world, runner.task
    states = {
        name: getattr(world, name).copy()
        for name in ("position", "orientation", "linear_velocity", "angular_velocity")
    }
    drives = {"drive_position": world.drive_position.copy()}

    def start(simulated: World) -> None:
        simulated.set_state(**states, **drives)

    def control(simulated: World, frame: int) -> None:
        task.act(simulated, simulated.read(), actions[frame])

    return start, control


def run(
    policy: Policy,
    tolerance: float,
    metric: str,
    time: float,
    law: str | None,
    seed: int,
    **env_kwargs: Any,
) -> Tuned:
    """Tunes for the episodes of a policy, whose actions are repeated at every fidelity.

    For arguments see `tune` and `recorded`.
    """
    choice("metric", metric, METRICS)  # at once, not after kernels have been compiled
    if law is not None:
        choice("law", law, LAWS)
    envs, actions = recorded(policy, max(1, round(time / FRAME)), seed, **env_kwargs)
    runner = envs.runner
    start, control = course(runner, np.clip(actions, -1.0, 1.0))
    print(f"{policy.env_id}, {WORLDS} episodes of {policy.name}, the first {time:g} s")
    tuned = tune(
        runner.world.scene, tolerance, metric, time=time, law=law, start=start, control=control,
        worlds=WORLDS, progress=_show,
    )  # fmt: skip
    _show("")
    print(tuned)
    return tuned


def _show(line: str) -> None:
    """A line that replaces the last one; nothing where the output is not a terminal."""
    if sys.stderr.isatty():
        print(f"\r{line:60}", end="" if line else "\r", file=sys.stderr, flush=True)

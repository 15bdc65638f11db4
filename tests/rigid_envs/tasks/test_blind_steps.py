"""Blind actions: the physics of no task breaks, whatever they do, and none is solved by chance."""

import functools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from physics.rotation import rotate
from rigid_envs.tasks.block import Block
from rigid_envs.tasks.push import HALF
from tests.rigid_envs.rollout import (
    PRESETS,
    PUSH,
    PUSH_T,
    SLIDE,
    STACK,
    THROW,
    make_vec,
    random_actions,
    steps_of,
)

CUBE = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
T = np.concatenate([part.ends[0] for part in Block.of("t").shape.parts])  # corners, in its frame


def lowest_of(corners):
    """Height [n] m of the lowest corner of the body that Push observes."""

    def lowest(world, observation):
        turn = observation["observation"][:, None, 9:13].astype(float)
        return observation["observation"][:, 8] + rotate(turn, corners)[..., 2].min(axis=1)

    return lowest


def lowest_centre(world, observation):
    return world.position[..., 2].min(axis=1)


def lowest_of_cubes_and_fingers(world, observation):
    return np.minimum(lowest_centre(world, observation), world.drive_position[..., 2].min(axis=1))


@dataclass(frozen=True)
class Task:
    """How many blind steps of a task are tried at a preset, and what they may do."""

    env_id: str
    worlds: int
    steps: int  # of a world; an episode takes one more than its length, for the reset
    stress_steps: int
    options: dict[str, Any] = field(default_factory=dict)
    lowest: Any = lowest_centre
    ground: dict[str, float] = field(default_factory=dict)  # m, by preset, if not 0
    energy: tuple[float, float] = (0.0, np.inf)  # J, the largest total one is between these
    kinetic: float = np.inf  # J
    within: float = np.inf  # m, from the origin along an axis
    level: float | None = None  # m, the height of the finger
    at_end: bool = False  # an episode that is solved only on the way does not count


# a finger that rams a cube presses it in by its speed times the step, and then it's out; at
# 2.2 m/s, twice over, is what an elastic blow could give: 0.97 J
RAMMED = {
    "ground": {"fast": -0.015, "balanced": -0.01, "accurate": -0.01, "solid": -0.01},
    "energy": (0.02, 0.97),
    "within": 1.0,
    "at_end": True,
}
POSTS = {"obstacles": 4, "target_yaw": True}
TASKS = {
    "push": Task(PUSH, 1024, 102, 1000, lowest=lowest_of(CUBE), **RAMMED),
    "push among posts": Task(PUSH, 256, 102, 102, POSTS, lowest_of(CUBE), **RAMMED),
    "push a T": Task(PUSH, 256, 102, 408, {"block": "t", "obstacles": 2}, lowest_of(T), **RAMMED),
    # the finger stays at its level, so the T stays flat
    "push_t": Task(PUSH_T, 256, 301, 1204, level=0.016),
    "slide": Task(SLIDE, 256, 204, 400),
    # a hand presses a cube in with 14 N, and pads at 1.6 m/s push it out
    "stack": Task(STACK, 256, 100, 4000, lowest=lowest_of_cubes_and_fingers, kinetic=2.0),
    # a hand reaches 4 m/s, and squeezes a ball out at no more than as much again
    "throw": Task(THROW, 512, 102, 2000, kinetic=0.5 * 0.05 * 8.0**2),
}
FOUR = [(name, preset) for name in ("push", "stack", "throw") for preset in PRESETS]
CASES = [
    *FOUR,
    *(("push among posts", preset) for preset in PRESETS),
    ("push a T", "balanced"),
    ("push a T", "solid"),
    ("push_t", "balanced"),
    ("slide", "balanced"),
]


@dataclass
class Seen:
    """The extremes of all steps, and how many random episodes ended, and were solved."""

    finite: bool = True
    lowest: float = np.inf
    energy: float = 0.0
    kinetic: float = 0.0
    furthest: float = 0.0
    levels: tuple[float, float] = (np.inf, -np.inf)
    episodes: int = 0
    solved: int = 0


@functools.cache  # both tests look at the same steps
def played(name, fidelity, stress) -> Seen:
    """Random actions in even worlds, full ones for ten steps each in odd worlds."""
    task, seen = TASKS[name], Seen()
    worlds = task.worlds // (1 if stress or fidelity != "accurate" else 4)  # that takes longest
    envs = make_vec(worlds, task.env_id, fidelity=fidelity, **task.options)
    envs.reset(seed=0)
    world = envs._runner.world
    solved = np.zeros(worlds, dtype=bool)
    steps = task.stress_steps if stress else task.steps
    actions = random_actions(steps, worlds, size=envs.single_action_space.shape[0])
    # np.minimum and np.maximum keep what is not a number
    for observation, _, terminated, truncated, info in steps_of(envs, actions):
        inside = ~info["out_of_bounds"]
        seen.finite &= all(np.isfinite(values).all() for values in observation.values())
        seen.lowest = np.minimum(seen.lowest, task.lowest(world, observation)[inside].min())
        kinetic = world.kinetic_energy()
        seen.kinetic = np.maximum(seen.kinetic, kinetic[inside].max())
        seen.energy = np.maximum(seen.energy, (kinetic + world.potential_energy())[inside].max())
        seen.furthest = np.maximum(seen.furthest, np.abs(world.position[inside]).max())
        heights = world.drive_position[..., 2]
        low, high = seen.levels
        seen.levels = np.minimum(low, heights.min()), np.maximum(high, heights.max())
        solved = info["is_success"] | (solved & (not task.at_end))
        ended = terminated | truncated
        seen.episodes += ended[::2].sum()
        seen.solved += (ended & solved)[::2].sum()
        solved &= ~ended
    return seen


@pytest.mark.parametrize(("name", "fidelity"), CASES)
def test_blind_steps_stay_physical(name, fidelity, stress):
    """In the long form a world plays up to 40 times as many steps."""
    task, seen = TASKS[name], played(name, fidelity, stress)
    assert seen.finite
    assert seen.lowest > task.ground.get(fidelity, 0.0)
    assert task.energy[0] < seen.energy < task.energy[1]
    assert seen.kinetic < task.kinetic
    assert seen.furthest <= task.within
    if task.level is not None:
        np.testing.assert_allclose(seen.levels, task.level, rtol=0.0, atol=2e-3)


@pytest.mark.parametrize(("name", "fidelity"), [*FOUR, ("push a T", "balanced"), *CASES[-2:]])
def test_a_random_policy_hardly_ever_solves_it(name, fidelity, stress):
    seen = played(name, fidelity, stress)
    assert seen.episodes >= TASKS[name].worlds // 8  # a quarter at accurate, and half are random
    assert seen.solved < 0.02 * seen.episodes

"""No reward can be farmed: what doesn't solve a task never earns what solving it does."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from rigid_envs.tasks import push
from rigid_envs.wrappers import Stage, goal_potential
from rigid_envs.wrappers.vector import (
    ActionPenalty,
    PotentialShaping,
    SmoothnessPenalty,
    StagedReward,
    SuccessBonus,
    TimePenalty,
)
from tests.rigid_envs.rollout import PUSH, make_vec
from training.scripted import CONTROLLERS

Array = np.ndarray
# takes observations and the number of the step, gives actions
Policy = Callable[[dict[str, Array], int], Array]

WORLDS = 64
SEED = 500
GAMMAS = (1.0, 0.98)


@dataclass(frozen=True)
class Case:
    """A task, ways to spend its time without solving it, and its rewards as users build them.

    Args:
        idlers: policies that don't try to solve it.
        stages: of its staged reward.
        steps: of an episode.
        solved: least share of worlds that the controller has to solve.
    """

    idlers: dict[str, Policy]
    stages: list[Stage]
    steps: int
    solved: float


def toward(observation: dict[str, Array], place: Array) -> Array:
    """Actions of Push that bring the finger to a place [n, 3]."""
    return np.clip((place - observation["observation"][:, :3]) / push.STRIDE, -1.0, 1.0)


def nothing(observation: dict[str, Array], step: int) -> Array:
    return np.zeros((len(observation["observation"]), 3))


def hover_above(observation: dict[str, Array], step: int) -> Array:
    return toward(observation, observation["achieved_goal"] + np.array([0.0, 0.0, 0.05]))


def wait_behind(observation: dict[str, Array], step: int) -> Array:
    """Where the reach term is best: at the cube's side away from the goal, without pushing."""
    cube, away = _cube_and_away(observation)
    place = cube + 0.06 * away
    high = np.linalg.norm((observation["observation"][:, :3] - place)[:, :2], axis=1) > 0.02
    place[:, 2] += np.where(high, 0.06, 0.0)  # over the cube, not into it
    return toward(observation, place)


def shake(observation: dict[str, Array], step: int) -> Array:
    """Pushes the cube to and fro across the way to the goal, from either side in turns."""
    cube, away = _cube_and_away(observation)
    side = np.stack([-away[:, 1], away[:, 0], np.zeros(len(away))], axis=1)
    elsewhere = cube + (0.06 if step // 13 % 2 else -0.06) * side
    return CONTROLLERS[PUSH]({**observation, "desired_goal": elsewhere})


def stop_short(observation: dict[str, Array], step: int) -> Array:
    """Does all of it but the last: nearly solved pays nearly as much, step after step."""
    actions = CONTROLLERS[PUSH](observation)
    apart = np.linalg.norm(observation["desired_goal"] - observation["achieved_goal"], axis=1)
    return np.where(apart[:, None] < 2.2 * push.THRESHOLD, 0.0, actions)


def _cube_and_away(observation: dict[str, Array]) -> tuple[Array, Array]:
    """The cube [n, 3], and the direction [n, 3] to it from the goal."""
    cube = observation["achieved_goal"].astype(float)
    away = cube - observation["desired_goal"]
    return cube, away / np.linalg.norm(away, axis=1, keepdims=True)


CASES = {
    PUSH: Case(
        {
            "nothing": nothing,
            "hover above": hover_above,
            "wait behind": wait_behind,
            "shake": shake,
            "stop short": stop_short,
        },
        [
            Stage("reach", start=-0.4, done=-0.03),
            Stage("distance", start=-0.4, done=-push.THRESHOLD, weight=2.0),
            Stage("success", start=0.0, done=1.0, weight=3.0),
        ],
        50,
        0.95,
    ),
}


def dense(case: Case, env_id: str, **kwargs: Any) -> Any:
    return make_vec(WORLDS, env_id, reward_type="dense", **kwargs)


def staged(case: Case, env_id: str, **kwargs: Any) -> Any:
    return StagedReward(make_vec(WORLDS, env_id, **kwargs), case.stages)


def shaped(case: Case, env_id: str, **kwargs: Any) -> Any:
    return PotentialShaping(make_vec(WORLDS, env_id, **kwargs), goal_potential, 0.98)


def all_at_once(case: Case, env_id: str, **kwargs: Any) -> Any:
    """Costs as small as they should be beside what a solved step pays."""
    envs = SmoothnessPenalty(ActionPenalty(staged(case, env_id, **kwargs), 0.01), 0.01)
    return TimePenalty(SuccessBonus(envs, 1.0), 0.1)


REWARDS = [dense, staged, shaped, all_at_once]


def returns(envs: Any, policy: Policy, steps: int) -> tuple[Array, Array]:
    """Returns [gamma, world] of each world's first episode, and whether [world] it ended solved."""
    observation, info = envs.reset(seed=SEED)
    total = np.zeros((len(GAMMAS), envs.num_envs))
    solved, going = info["is_success"], np.ones(envs.num_envs, dtype=bool)
    for step in range(steps):
        observation, reward, terminated, truncated, info = envs.step(policy(observation, step))
        total += np.power(GAMMAS, step)[:, None] * np.where(going, reward, 0.0)
        solved = np.where(going, info["is_success"], solved)
        going &= ~(terminated | truncated)
    return total, solved


@pytest.mark.parametrize("terminate", [False, True], ids=["goes on", "ends when solved"])
@pytest.mark.parametrize("build", REWARDS, ids=lambda build: build.__name__)
@pytest.mark.parametrize("env_id", CASES)
def test_solving_earns_more_than_idling_in_every_world(env_id, build, terminate):
    case = CASES[env_id]
    envs = build(case, env_id, terminate_on_success=terminate)
    controller = CONTROLLERS[env_id]
    earned, solved = returns(envs, lambda observation, step: controller(observation), case.steps)
    assert solved.mean() >= case.solved
    for name, policy in case.idlers.items():
        farmed, by_chance = returns(envs, policy, case.steps)
        worst = (earned - farmed)[:, solved & ~by_chance].min()
        assert worst > 0.0, f"{name} earns {-worst:.3g} more than solving in some world"


@pytest.mark.parametrize("env_id", CASES)
def test_idlers_do_not_solve_the_task(env_id):
    case = CASES[env_id]
    envs = make_vec(WORLDS, env_id)
    for name, policy in case.idlers.items():
        assert returns(envs, policy, case.steps)[1].mean() < 0.1, name


def test_the_shaken_cube_goes_to_and_fro():
    envs = make_vec(WORLDS)
    observation, _ = envs.reset(seed=SEED)
    path, start = np.zeros(WORLDS), observation["achieved_goal"]
    for step in range(50):
        before = observation["achieved_goal"]
        observation = envs.step(shake(observation, step))[0]
        path += np.linalg.norm(observation["achieved_goal"] - before, axis=1)
    there = np.linalg.norm(observation["achieved_goal"] - start, axis=1)
    assert np.median(path) > 0.1
    assert np.median(path / there) > 1.5

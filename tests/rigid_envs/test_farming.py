"""No reward can be farmed: what doesn't solve a task never earns what solving it does."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from rigid_envs.tasks import push, throw
from rigid_envs.tasks.goals import distance
from rigid_envs.tasks.stack import HALF, THRESHOLD, Stack
from rigid_envs.wrappers import Stage, goal_potential
from rigid_envs.wrappers.vector import (
    ActionPenalty,
    PotentialShaping,
    SmoothnessPenalty,
    StagedReward,
    SuccessBonus,
    TimePenalty,
)
from tests.rigid_envs.rollout import PUSH, STACK, THROW, make_vec
from training.scripted import CONTROLLERS

Array = np.ndarray
# takes observations and the number of the step, gives actions
Policy = Callable[[dict[str, Array], int], Array]

WORLDS = 64
OPEN, CLOSE = 1.0, -1.0  # the grip
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
        worlds: number of them.
        env_id: the environment.
        options: its arguments.
        chance: share of worlds below which idlers have to stay that end solved.
    """

    idlers: dict[str, Policy]
    stages: list[Stage]
    steps: int
    solved: float
    worlds: int = WORLDS
    env_id: str = PUSH
    options: dict[str, Any] = field(default_factory=dict)
    chance: float = 0.1

    def solve(self, observation: dict[str, Array], step: int) -> Array:
        """The scripted controller, told of the options that it takes."""
        posts = {k: v for k, v in self.options.items() if k == "obstacles"}
        return CONTROLLERS[self.env_id](observation, **posts)


def always(*action: float) -> Policy:
    """The same action whatever is seen."""
    return lambda observation, step: np.tile(action, (len(observation["observation"]), 1))


# --- Push: its cube -----------------------------------------------------------------------------


def toward(observation: dict[str, Array], place: Array) -> Array:
    """Actions of Push that bring the finger to a place [n, 3]."""
    return np.clip((place - observation["observation"][:, :3]) / push.STRIDE, -1.0, 1.0)


def hover_above(observation: dict[str, Array], step: int) -> Array:
    return toward(observation, _cube_and_away(observation)[0] + np.array([0.0, 0.0, 0.05]))


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
    goals = {"achieved_goal": cube, "desired_goal": elsewhere}
    return CONTROLLERS[PUSH]({**observation, **goals})


def stop_short(observation: dict[str, Array], step: int) -> Array:
    """Does all of it but the last: nearly solved pays nearly as much, step after step."""
    actions = CONTROLLERS[PUSH](observation)
    missing = distance(observation["desired_goal"], observation["achieved_goal"])
    return np.where(missing[:, None] < 2.2 * push.THRESHOLD, 0.0, actions)


def bring_it_as_it_lies(observation: dict[str, Array], step: int) -> Array:
    """Where a yaw is asked for: pushes the cube there without a look at it, unless it has it."""
    achieved, desired = (observation[f"{kind}_goal"] for kind in ("achieved", "desired"))
    goals = {"achieved_goal": achieved[:, :3], "desired_goal": desired[:, :3]}
    near = distance(*goals.values()) < 2.0 * push.THRESHOLD
    turned = distance(achieved[:, 3:], desired[:, 3:]) < 1.2 * push.THRESHOLD
    actions = CONTROLLERS[PUSH]({**observation, **goals})
    return np.where((near & turned)[:, None], 0.0, actions)


def _cube_and_away(observation: dict[str, Array]) -> tuple[Array, Array]:
    """The cube [n, 3], and the direction [n, 3] to it from the goal."""
    cube = observation["achieved_goal"][:, :3].astype(float)
    away = cube - observation["desired_goal"][:, :3]
    return cube, away / np.linalg.norm(away, axis=1, keepdims=True)


# --- Stack: its first cube and its last ---------------------------------------------------------


def lead(
    task: type[Stack] | type[throw.Throw], observation: dict[str, Array], place: Array, grip: Any
) -> Array:
    """Actions that bring a hand to a place [n, 3], with a grip [n] or of all."""
    reference = observation["observation"][:, 8:11].astype(float)
    strides = np.clip((place - reference) / task.hand.stride, -1.0, 1.0)
    return np.concatenate([strides, np.broadcast_to(grip, (len(place), 1))], axis=1)


def hover_above_the_first(observation: dict[str, Array], step: int) -> Array:
    place = observation["achieved_goal"][:, :3] + np.array([0.0, 0.0, 0.05])
    return lead(Stack, observation, place, OPEN)


def grip_and_shake(observation: dict[str, Array], step: int) -> Array:
    """Once the first cube is in the fingers, it goes to and fro."""
    actions = CONTROLLERS[STACK](observation)
    apart = np.abs(observation["achieved_goal"][:, :3] - observation["observation"][:, :3])
    gripped = (apart.max(axis=1) < 0.75 * HALF) & (
        observation["observation"][:, 6] < 2.0 * HALF + 0.003
    )
    return np.where(gripped[:, None], [0.5 if step // 4 % 2 else -0.5, 0.0, 0.0, CLOSE], actions)


def _missing(observation: dict[str, Array], cube: int) -> Array:
    """[n] m, of a cube from its place."""
    part = slice(3 * cube, 3 * cube + 3)
    way = observation["achieved_goal"][:, part] - observation["desired_goal"][:, part]
    return np.linalg.norm(way, axis=1)


def hold_in_place(cube: int) -> Policy:
    """Does all of it until a cube is in its place, where it isn't let go."""

    def policy(observation: dict[str, Array], step: int) -> Array:
        actions = CONTROLLERS[STACK](observation)
        there = _missing(observation, cube) < THRESHOLD
        return np.where(there[:, None], [0.0, 0.0, 0.0, CLOSE], actions)

    return policy


def leave_the_last(observation: dict[str, Array], step: int) -> Array:
    """Does all of it but the last cube."""
    actions = CONTROLLERS[STACK](observation)
    released = observation["observation"][:, 6] > 2.0 * HALF + 0.014
    done = (_missing(observation, 0) < THRESHOLD) & released
    return np.where(done[:, None], [0.0, 0.0, 0.0, OPEN], actions)


# --- Throw: its ball ----------------------------------------------------------------------------


def shake_the_ball(observation: dict[str, Array], step: int) -> Array:
    """To and fro along the way to the target, so that the ball would fly far at times."""
    return always(1.0 if step // 3 % 2 else -1.0, 0.0, 0.0, CLOSE)(observation, step)


def reach_out(observation: dict[str, Array], step: int) -> Array:
    """Holds the ball as near to the target as the hand can."""
    return lead(throw.Throw, observation, observation["desired_goal"], CLOSE)


def swing_and_hold_on(observation: dict[str, Array], step: int) -> Array:
    """Does all of it but to let go."""
    actions = CONTROLLERS[THROW](observation)
    actions[:, 3] = CLOSE
    return actions


OF_PUSH = {
    "nothing": always(0.0, 0.0, 0.0),
    "hover above": hover_above,
    "wait behind": wait_behind,
    "shake": shake,
}
STAGES_OF_PUSH = [
    Stage("reach", start=-0.4, done=-0.03),
    Stage("distance", start=-0.4, done=-push.THRESHOLD, weight=2.0),
    Stage("success", start=0.0, done=1.0, weight=3.0),
]
CASES = {
    PUSH: Case({**OF_PUSH, "stop short": stop_short}, STAGES_OF_PUSH, 50, 0.95),
    "Push with a yaw": Case(
        {**OF_PUSH, "bring it as it lies": bring_it_as_it_lies},
        STAGES_OF_PUSH,
        50,
        0.95,
        options={"target_yaw": True},
        chance=0.4,  # a third of all cubes lie within 15 degrees of a yaw
    ),
    "Push with posts": Case(
        {**OF_PUSH, "stop short": stop_short},
        STAGES_OF_PUSH,
        50,
        0.95,
        options={"obstacles": 4},
    ),
    STACK: Case(
        {
            "nothing": always(0.0, 0.0, 0.0, 0.0),
            "hover above the first": hover_above_the_first,
            "grip and shake": grip_and_shake,
            "hold the first in its place": hold_in_place(0),
            "hold the last in its place": hold_in_place(1),
            "leave the last": leave_the_last,
        },
        [
            Stage("stage", start=0.0, done=0.85, weight=2.0),
            Stage("success", start=0.0, done=1.0, weight=2.0),
        ],
        100,
        0.95,
        worlds=24,
        env_id=STACK,
    ),
    THROW: Case(
        {
            "nothing": always(0.0, 0.0, 0.0, 0.0),
            "hold": always(0.0, 0.0, 0.0, CLOSE),
            "drop": always(0.0, 0.0, 0.0, OPEN),
            "shake": shake_the_ball,
            "reach out": reach_out,
            "swing and hold on": swing_and_hold_on,
        },
        [
            Stage("aim", start=-1.5, done=-throw.THRESHOLD),
            Stage("success", start=0.0, done=1.0, weight=2.0),
        ],
        50,
        0.95,
        worlds=200,  # few targets are so near that reaching out for them comes close to a hit
        env_id=THROW,
    ),
}


def made(case: Case, **kwargs: Any) -> Any:
    return make_vec(case.worlds, case.env_id, **case.options, **kwargs)


def dense(case: Case, **kwargs: Any) -> Any:
    return made(case, reward_type="dense", **kwargs)


def staged(case: Case, **kwargs: Any) -> Any:
    return StagedReward(made(case, **kwargs), case.stages)


def shaped(case: Case, **kwargs: Any) -> Any:
    return PotentialShaping(made(case, **kwargs), goal_potential, 0.98)


def all_at_once(case: Case, **kwargs: Any) -> Any:
    """Costs as small as they should be beside what a solved step pays."""
    envs = SmoothnessPenalty(ActionPenalty(staged(case, **kwargs), 0.01), 0.01)
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
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_solving_earns_more_than_idling_in_every_world(case, build, terminate):
    envs = build(case, terminate_on_success=terminate)
    earned, solved = returns(envs, case.solve, case.steps)
    assert solved.mean() >= case.solved
    for name, policy in case.idlers.items():
        farmed, by_chance = returns(envs, policy, case.steps)
        worst = (earned - farmed)[:, solved & ~by_chance].min()
        assert worst > 0.0, f"{name} earns {-worst:.3g} more than solving in some world"


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_idlers_do_not_solve_the_task(case):
    envs = made(case)
    for name, policy in case.idlers.items():
        assert returns(envs, policy, case.steps)[1].mean() < case.chance, name


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


def last(env_id: str, idler: str) -> tuple[dict[str, Array], dict[str, Array], Array]:
    """Observation and info at the end of an idler's episodes, and the places [step, world, 3]."""
    case = CASES[env_id]
    envs = make_vec(WORLDS, env_id)
    observation, info = envs.reset(seed=SEED)
    places = [observation["achieved_goal"][:, :3]]
    for step in range(case.steps):
        observation, _, _, _, info = envs.step(case.idlers[idler](observation, step))
        places.append(observation["achieved_goal"][:, :3])
    return observation, info, np.array(places)


@pytest.mark.parametrize(
    ("idler", "grasp"), [("leave the last", 0.0), ("hold the last in its place", 1.0)]
)
def test_a_tower_is_built_but_for_its_last_cube_or_for_letting_go(idler, grasp):
    info = last(STACK, idler)[1]
    assert not info["is_success"].any()
    assert ((info["placed"] == 1.0) & (info["grasp"] == grasp)).mean() > 0.9


def test_the_gripped_cube_is_held_and_goes_to_and_fro():
    _, info, places = last(STACK, "grip and shake")
    assert info["grasp"].mean() > 0.9
    path = np.abs(np.diff(places[-40:, :, 0], axis=0)).sum(axis=0)
    assert np.median(path) > 4.0 * np.median(np.ptp(places[-40:, :, 0], axis=0))


def test_the_ball_that_is_shaken_or_held_out_does_not_land():
    shaken, held_out = (last(THROW, idler) for idler in ("shake", "reach out"))
    for _, info, _ in (shaken, held_out):
        assert not info["landed"].any()
    assert np.median(np.abs(np.diff(shaken[2][:, :, 0], axis=0)).sum(axis=0)) > 1.0
    assert held_out[2][-1, :, 0].min() > 0.9 * throw.Throw.hand.high[0]

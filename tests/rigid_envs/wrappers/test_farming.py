"""No reward can be farmed: a policy that does not solve a task earns less than one that does.

Rewards do not change what happens in an episode. So each task is played once by all policies, and
every wrapper is applied to the same recorded steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import VectorEnv

from rigid_envs.tasks import push, throw
from rigid_envs.tasks.goals import distance
from rigid_envs.tasks.stack import Stack
from rigid_envs.tasks.stack.tower import HALF, THRESHOLD
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
from training.scripted import controller_for

Array = np.ndarray
# from observations and the number of the step to actions
Policy = Callable[[dict[str, Array], int], Array]

SOLVER = "solve"
OPEN, CLOSE = 1.0, -1.0  # the grip
SEED = 500
GAMMAS = (1.0, 0.98)


@dataclass(frozen=True)
class Case:
    """A task, policies that spend its time without solving it, and the stages of a staged reward.

    Args:
        idlers: policies that do not try to solve the task.
        stages: of its staged reward.
        steps: of an episode.
        solved: smallest fraction of worlds that the controller has to solve.
        worlds: number of worlds of each policy.
        env_id: the environment.
        options: its arguments.
        chance: the fraction of worlds that an idler solves by chance has to be smaller.
    """

    idlers: dict[str, Policy]
    stages: list[Stage]
    steps: int
    solved: float
    worlds: int = 64
    env_id: str = PUSH
    options: dict[str, Any] = field(default_factory=dict)
    chance: float = 0.1

    @property
    def policies(self) -> dict[str, Policy]:
        """All policies by name; the first one is the scripted controller."""
        return {SOLVER: self.solve, **self.idlers}

    def solve(self, observation: dict[str, Array], step: int) -> Array:
        """The scripted controller, with the options that it needs."""
        posts = {k: v for k, v in self.options.items() if k == "obstacles"}
        return controller_for(self.env_id)(observation, **posts)


def always(*action: float) -> Policy:
    """The same action for all observations."""
    return lambda observation, step: np.tile(action, (len(observation["observation"]), 1))


# --- Push: its cube -----------------------------------------------------------------------------


def toward(observation: dict[str, Array], place: Array) -> Array:
    """Actions of Push that bring the finger to a place [n, 3]."""
    return np.clip((place - observation["observation"][:, :3]) / push.Push.finger.stride, -1.0, 1.0)


def hover_above(observation: dict[str, Array], step: int) -> Array:
    return toward(observation, _cube_and_away(observation)[0] + np.array([0.0, 0.0, 0.05]))


def wait_behind(observation: dict[str, Array], step: int) -> Array:
    """Stays where the reach term is best: at the far side of the cube, without pushing."""
    cube, away = _cube_and_away(observation)
    place = cube + 0.06 * away
    high = np.linalg.norm((observation["observation"][:, :3] - place)[:, :2], axis=1) > 0.02
    place[:, 2] += np.where(high, 0.06, 0.0)  # over the cube, not into it
    return toward(observation, place)


def shake(observation: dict[str, Array], step: int) -> Array:
    """Pushes the cube to and fro across the direction to the goal, from alternating sides."""
    cube, away = _cube_and_away(observation)
    side = np.stack([-away[:, 1], away[:, 0], np.zeros(len(away))], axis=1)
    elsewhere = cube + (0.06 if step // 13 % 2 else -0.06) * side
    goals = {"achieved_goal": cube, "desired_goal": elsewhere}
    return controller_for(PUSH)({**observation, **goals})


def stop_short(observation: dict[str, Array], step: int) -> Array:
    """Solves the task almost: stops just outside of the threshold."""
    actions = controller_for(PUSH)(observation)
    missing = distance(observation["desired_goal"], observation["achieved_goal"])
    return np.where(missing[:, None] < 2.2 * push.THRESHOLD, 0.0, actions)


def bring_it_as_it_lies(observation: dict[str, Array], step: int) -> Array:
    """With a goal yaw: ignores it, and stops outside of the threshold if it is right anyway."""
    achieved, desired = (observation[f"{kind}_goal"] for kind in ("achieved", "desired"))
    goals = {"achieved_goal": achieved[:, :3], "desired_goal": desired[:, :3]}
    near = distance(*goals.values()) < 2.0 * push.THRESHOLD
    turned = distance(achieved[:, 3:], desired[:, 3:]) < 1.2 * push.THRESHOLD
    actions = controller_for(PUSH)({**observation, **goals})
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
    """Grips the first cube and moves it to and fro."""
    actions = controller_for(STACK)(observation)
    offset = np.abs(observation["achieved_goal"][:, :3] - observation["observation"][:, :3])
    gripped = (offset.max(axis=1) < 0.75 * HALF) & (
        observation["observation"][:, 6] < 2.0 * HALF + 0.003
    )
    return np.where(gripped[:, None], [0.5 if step // 4 % 2 else -0.5, 0.0, 0.0, CLOSE], actions)


def _missing(observation: dict[str, Array], cube: int) -> Array:
    """Distance [n] m of a cube from its goal."""
    part = slice(3 * cube, 3 * cube + 3)
    offset = observation["achieved_goal"][:, part] - observation["desired_goal"][:, part]
    return np.linalg.norm(offset, axis=1)


def hold_in_place(cube: int) -> Policy:
    """Stacks until a cube is at its goal, and does not release it there."""

    def policy(observation: dict[str, Array], step: int) -> Array:
        actions = controller_for(STACK)(observation)
        there = _missing(observation, cube) < THRESHOLD
        return np.where(there[:, None], [0.0, 0.0, 0.0, CLOSE], actions)

    return policy


def leave_the_last(observation: dict[str, Array], step: int) -> Array:
    """Stacks all cubes except the last one."""
    actions = controller_for(STACK)(observation)
    released = observation["observation"][:, 6] > 2.0 * HALF + 0.014
    done = (_missing(observation, 0) < THRESHOLD) & released
    return np.where(done[:, None], [0.0, 0.0, 0.0, OPEN], actions)


# --- Throw: its ball ----------------------------------------------------------------------------


def shake_the_ball(observation: dict[str, Array], step: int) -> Array:
    """Moves to and fro along x, so that a ball released at the right time would fly far."""
    return always(1.0 if step // 3 % 2 else -1.0, 0.0, 0.0, CLOSE)(observation, step)


def reach_out(observation: dict[str, Array], step: int) -> Array:
    """Holds the ball as near to the target as the hand can reach."""
    return lead(throw.Throw, observation, observation["desired_goal"], CLOSE)


def swing_and_hold_on(observation: dict[str, Array], step: int) -> Array:
    """Throws without releasing the ball."""
    actions = controller_for(THROW)(observation)
    actions[:, 3] = CLOSE
    return actions


PUSH_IDLERS = {
    "nothing": always(0.0, 0.0, 0.0),
    "hover above": hover_above,
    "wait behind": wait_behind,
    "shake": shake,
}
PUSH_STAGES = [
    Stage("reach", start=-0.4, done=-0.03),
    Stage("distance", start=-0.4, done=-push.THRESHOLD, weight=2.0),
    Stage("success", start=0.0, done=1.0, weight=3.0),
]
CASES = {
    PUSH: Case({**PUSH_IDLERS, "stop short": stop_short}, PUSH_STAGES, 50, 0.95),
    "Push with a yaw": Case(
        {**PUSH_IDLERS, "bring it as it lies": bring_it_as_it_lies},
        PUSH_STAGES,
        50,
        0.95,
        options={"target_yaw": True},
        chance=0.4,  # a third of all cubes lie within 15 degrees of a yaw
    ),
    "Push with posts": Case(
        {**PUSH_IDLERS, "stop short": stop_short},
        PUSH_STAGES,
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


@dataclass(frozen=True)
class Recording:
    """Steps of a vector environment in which each policy of a case has `case.worlds` worlds."""

    envs: VectorEnv
    start: tuple[Any, ...]
    actions: list[Array]
    steps: list[tuple[Any, ...]]


@cache
def record(name: str, terminate: bool) -> Recording:
    """Plays the first episode of each world; all policies start from the same seeds."""
    case = CASES[name]
    count = case.worlds * len(case.policies)
    options = {**case.options, "terminate_on_success": terminate}
    envs = make_vec(count, case.env_id, reward_type="dense", **options)
    seeds = list(range(SEED, SEED + case.worlds)) * len(case.policies)
    start = envs.reset(seed=seeds)
    actions, steps, observation = [], [], start[0]
    for step in range(case.steps):
        parts = [
            policy(
                {key: values[worlds_of(case, name)] for key, values in observation.items()}, step
            )
            for name, policy in case.policies.items()
        ]
        actions.append(np.concatenate(parts))
        steps.append(envs.step(actions[-1]))
        observation = steps[-1][0]
    return Recording(envs, start, actions, steps)


def worlds_of(case: Case, policy: str) -> slice:
    """The worlds of a policy in a recording."""
    first = case.worlds * list(case.policies).index(policy)
    return slice(first, first + case.worlds)


class Playback(VectorEnv):
    """Returns the recorded steps again, with the rewards of an environment, to its wrappers."""

    def __init__(self, recording: Recording, envs: VectorEnv) -> None:
        self._envs = envs
        self.num_envs, self.metadata, self.reward = envs.num_envs, envs.metadata, envs.reward
        self.observation_space, self.action_space = envs.observation_space, envs.action_space
        self.single_observation_space = envs.single_observation_space
        self.single_action_space = envs.single_action_space
        self._recording = recording

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        self._steps = zip(self._recording.actions, self._recording.steps, strict=True)
        return self._recording.start

    def step(self, actions: Array) -> tuple[Any, Array, Array, Array, dict[str, Any]]:
        recorded, (observation, _, *ends, info) = next(self._steps)
        assert actions is recorded
        goals = observation["achieved_goal"], observation["desired_goal"]
        return observation, self.compute_reward(*goals, info), *ends, info

    def compute_reward(self, achieved: Array, desired: Array, info: Any) -> Any:
        return self._envs.compute_reward(achieved, desired, info)


def dense(name: str, terminate: bool) -> Any:
    return Playback(recording := record(name, terminate), recording.envs)


def sparse(name: str, terminate: bool) -> Any:
    recording, case = record(name, terminate), CASES[name]
    return Playback(recording, make_vec(recording.envs.num_envs, case.env_id, **case.options))


def staged(name: str, terminate: bool) -> Any:
    return StagedReward(sparse(name, terminate), CASES[name].stages)


def shaped(name: str, terminate: bool) -> Any:
    return PotentialShaping(sparse(name, terminate), goal_potential, 0.98)


def all_at_once(name: str, terminate: bool) -> Any:
    """With costs that are small compared with what a solved step pays, as they should be."""
    envs = SmoothnessPenalty(ActionPenalty(staged(name, terminate), 0.01), 0.01)
    return TimePenalty(SuccessBonus(envs, 1.0), 0.1)


REWARDS = [dense, staged, shaped, all_at_once]


def returns(envs: Any) -> tuple[Array, Array]:
    """Returns [gamma, world] of the first episodes, and whether [world] each ended solved."""
    _, info = envs.reset()
    total = np.zeros((len(GAMMAS), envs.num_envs))
    solved, running = info["is_success"], np.ones(envs.num_envs, dtype=bool)
    for step, actions in enumerate(envs.unwrapped._recording.actions):
        _, reward, terminated, truncated, info = envs.step(actions)
        total += np.power(GAMMAS, step)[:, None] * np.where(running, reward, 0.0)
        solved = np.where(running, info["is_success"], solved)
        running &= ~(terminated | truncated)
    return total, solved


@pytest.mark.parametrize("terminate", [False, True], ids=["continues", "ends when solved"])
@pytest.mark.parametrize("build", REWARDS, ids=lambda build: build.__name__)
@pytest.mark.parametrize("name", CASES)
def test_solving_earns_more_than_idling_in_every_world(name, build, terminate):
    case = CASES[name]
    total, solved = returns(build(name, terminate))
    solver = worlds_of(case, SOLVER)
    assert solved[solver].mean() >= case.solved
    for idler in case.idlers:
        worlds = worlds_of(case, idler)
        compared = solved[solver] & ~solved[worlds]
        worst = (total[:, solver] - total[:, worlds])[:, compared].min()
        assert worst > 0.0, f"{idler} earns {-worst:.3g} more than solving in some world"


@pytest.mark.parametrize("name", CASES)
def test_idlers_do_not_solve_the_task(name):
    case = CASES[name]
    _, solved = returns(sparse(name, False))
    for idler in case.idlers:
        assert solved[worlds_of(case, idler)].mean() < case.chance, idler


# --- the idlers do what their names say -----------------------------------------------------------


def last_step(name: str, idler: str) -> tuple[dict[str, Array], Array]:
    """Info after the last step of an idler's episodes, and the positions [step, world, 3]."""
    recording, worlds = record(name, False), worlds_of(CASES[name], idler)
    results = [recording.start, *recording.steps]
    info = {key: values[worlds] for key, values in results[-1][-1].items()}
    return info, np.array([result[0]["achieved_goal"][worlds, :3] for result in results])


def test_the_shaken_cube_goes_to_and_fro():
    _, positions = last_step(PUSH, "shake")
    path = np.linalg.norm(np.diff(positions, axis=0), axis=2).sum(axis=0)
    assert np.median(path) > 0.1
    assert np.median(path / np.linalg.norm(positions[-1] - positions[0], axis=1)) > 1.5


@pytest.mark.parametrize(
    ("idler", "grasp"), [("leave the last", 0.0), ("hold the last in its place", 1.0)]
)
def test_a_tower_is_built_except_for_its_last_cube_or_the_release(idler, grasp):
    info, _ = last_step(STACK, idler)
    assert not info["is_success"].any()
    assert ((info["placed"] == 1.0) & (info["grasp"] == grasp)).mean() > 0.9


def test_the_gripped_cube_is_held_and_goes_to_and_fro():
    info, positions = last_step(STACK, "grip and shake")
    assert info["grasp"].mean() > 0.9
    path = np.abs(np.diff(positions[-40:, :, 0], axis=0)).sum(axis=0)
    assert np.median(path) > 4.0 * np.median(np.ptp(positions[-40:, :, 0], axis=0))


def test_the_ball_that_is_shaken_or_held_out_does_not_land():
    shaken, held_out = (last_step(THROW, idler) for idler in ("shake", "reach out"))
    for info, _ in (shaken, held_out):
        assert not info["landed"].any()
    assert np.median(np.abs(np.diff(shaken[1][:, :, 0], axis=0)).sum(axis=0)) > 1.0
    assert held_out[1][-1, :, 0].min() > 0.9 * throw.Throw.hand.high[0]

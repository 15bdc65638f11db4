"""Environments, actions and comparisons that several test files use."""

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv

import rigid_envs  # noqa: F401  (registers the ids)

NAMES = ("PickAndPlace", "Push", "PushT", "Reach", "Slide", "Stack", "Throw")
IDS = [f"RigidEnvs/{task}-v0" for task in NAMES]
PICK_AND_PLACE, PUSH, PUSH_T, REACH, SLIDE, STACK, THROW = IDS
DENSE_IDS = [f"RigidEnvs/{task}Dense-v0" for task in NAMES]
PRESETS = ["fast", "balanced", "accurate", "solid"]
REWARDS = ["sparse", "dense"]
EPISODE = 50


def make(env_id: str = PUSH, **kwargs: Any) -> gym.Env:
    """The environment without the wrappers of gym.make."""
    return gym.make(env_id, **kwargs).unwrapped


def make_vec(num_envs: int, env_id: str = PUSH, **kwargs: Any) -> VectorEnv:
    return gym.make_vec(env_id, num_envs=num_envs, **kwargs)


def random_actions(steps: int, worlds: int, seed: int = 0, size: int = 3) -> np.ndarray:
    """[steps, worlds, size]; odd worlds keep full actions for ten steps."""
    random = np.random.default_rng(seed)
    actions = random.uniform(-1.0, 1.0, (steps, worlds, size))
    full = np.sign(random.uniform(-1.0, 1.0, (-(-steps // 10), worlds, size))).repeat(10, axis=0)
    actions[:, 1::2] = full[:steps, 1::2]
    return actions.astype(np.float32)


def toward_cube(observation: dict[str, np.ndarray]) -> np.ndarray:
    """Actions [..., 3] that run the finger into the cube, so that there are contacts."""
    return np.clip(20.0 * observation["observation"][..., 19:22], -1.0, 1.0)


def push_blindly(observation: dict[str, np.ndarray], noise: np.ndarray) -> np.ndarray:
    """Actions that depend on every bit of the observation, and keep touching the cube."""
    return np.clip(toward_cube(observation) + 0.5 * noise, -1.0, 1.0)


def put_cubes_on_goals(env: Any, worlds: np.ndarray | None = None, shift: float = 0.0) -> None:
    """Puts the cube on its goal, or `shift` m away from it, in some worlds; in all if None."""
    runner = env._runner
    worlds = np.ones(runner.count, dtype=bool) if worlds is None else worlds
    goals = runner.goals[worlds, None].astype(float)
    runner.world.set_state(position=goals + np.array([shift, 0.0, 0.0]), worlds=worlds)


def steps_of(env: gym.Env | VectorEnv, actions: np.ndarray) -> Iterator[tuple[Any, ...]]:
    for action in actions:
        yield env.step(action)


def one_world(result: tuple[Any, ...], world: int) -> tuple[Any, ...]:
    """One world's part of a vector environment's step or reset, as a single environment's."""
    *head, info = result
    entries = {
        k: v[world].item() if v.ndim == 1 else v[world]
        for k, v in info.items()
        if not k.startswith(("_", "final"))
    }
    return *(_row(part, world) for part in head), entries


def _row(part: Any, world: int) -> Any:
    return {k: v[world] for k, v in part.items()} if isinstance(part, dict) else part[world].item()


def some_worlds(result: tuple[Any, ...], worlds: Any) -> tuple[Any, ...]:
    """Some worlds' part of a vector environment's step or reset, as arrays."""
    return tuple(
        {k: v[worlds] for k, v in part.items()} if isinstance(part, dict) else part[worlds]
        for part in result
    )


def assert_same(a: Any, b: Any) -> None:
    """Compares nested dicts and tuples of arrays and numbers, bitwise."""
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_same(a[key], b[key])
    elif isinstance(a, tuple | list):
        assert len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            assert_same(x, y)
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        if a.dtype == object:
            assert_same(a.tolist(), b.tolist())
        else:
            np.testing.assert_array_equal(a, b)
    else:
        assert type(a) is type(b)
        assert a == b


def assert_untouched(env: Any, before: dict[str, Any]) -> None:
    """The state of an environment is still the one that `get_state` returned."""
    after = env.get_state()
    assert_same(_in_bytes(after), _in_bytes(before))


def _in_bytes(state: dict[str, Any]) -> dict[str, Any]:
    """With the world's arrays as bytes, since NaN does not equal NaN."""
    world = {name: array.tobytes() for name, array in state["world"].state._asdict().items()}
    return {**state, "world": world}

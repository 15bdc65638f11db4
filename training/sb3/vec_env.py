"""Adapter from a Gymnasium vector environment to Stable-Baselines3's `VecEnv`.

Stable-Baselines3 has no converter from Gymnasium's `VectorEnv`. The two interfaces differ in what
they report at the end of an episode; a mistake there raises no error but slows down learning. Only
worlds whose episode has just ended are looped over in Python.
"""

import time
from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

Observation = dict[str, np.ndarray]

_EMPTY_INFO: dict[str, Any] = {}
"""The info of every world whose episode continues: one shared object instead of one per world."""


class RigidVecEnv(VecEnv):
    """A Stable-Baselines3 `VecEnv` over a Gymnasium vector environment with dict observations.

    At the end of an episode the info of its world contains `terminal_observation` (a copy),
    `TimeLimit.truncated`, and the environment's info of the last step, such as `is_success`. All
    worlds are one environment object, so attributes and methods apply to all worlds at once.

    Args:
        envs: Vector environment with autoreset mode SAME_STEP; `close` closes it.

    Raises:
        TypeError: It is not a vector environment.
        ValueError: The vector environment has another autoreset mode.
    """

    def __init__(self, envs: VectorEnv):
        if not isinstance(envs, VectorEnv):
            raise TypeError(
                f"envs must be a vector environment, from gym.make_vec, got {envs}; "
                "Stable-Baselines3 takes a single environment as it is"
            )
        mode = envs.metadata.get("autoreset_mode")
        if mode != AutoresetMode.SAME_STEP:
            raise ValueError(
                f"autoreset_mode is {mode}, should be {AutoresetMode.SAME_STEP}: "
                'gym.make_vec(..., autoreset_mode="SameStep")'
            )
        self.envs = envs
        self.seconds_in_envs = 0.0
        """Wall time spent inside the vector environment's steps so far, in seconds."""
        self._actions: np.ndarray | None = None
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> Observation:
        """Starts new episodes in all worlds; world i gets the seed passed to `seed` plus i."""
        observation, infos = self.envs.reset(seed=self._seeds[0], options=self._shared_options())
        self.reset_infos = _info_per_world(infos, np.arange(self.num_envs))
        self._reset_seeds()
        self._reset_options()
        return _copied(observation)

    def step_async(self, actions: np.ndarray) -> None:
        """Stores the actions `(num_envs, action_dim)` for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[Observation, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Steps all worlds. Worlds that end are reset, and return the new episode's observation.

        Returns:
            Observations `{key: (num_envs, k)}`, rewards `(num_envs,)` float32, dones `(num_envs,)`
            bool, and an info for each world. Nothing shares memory with the environment.
        """
        start = time.perf_counter()
        observation, rewards, terminated, truncated, infos = self.envs.step(self._actions)
        self.seconds_in_envs += time.perf_counter() - start

        dones = np.logical_or(terminated, truncated)
        info_list = [_EMPTY_INFO] * self.num_envs
        ended = np.flatnonzero(dones)
        if ended.size:
            last_infos = _info_per_world(infos["final_info"], ended)
            new_infos = _info_per_world(infos, ended)
            cut_short = (truncated & ~terminated)[ended].tolist()
            for world, info, new_info, cut in zip(
                ended.tolist(), last_infos, new_infos, cut_short, strict=True
            ):
                info["terminal_observation"] = _copied(infos["final_obs"][world])
                info["TimeLimit.truncated"] = cut
                info_list[world] = info
                self.reset_infos[world] = new_info
        return _copied(observation), np.array(rewards, dtype=np.float32), dones, info_list

    def replace(self, envs: VectorEnv) -> None:
        """Closes the vector environment and uses another one, which must be reset next.

        Raises:
            ValueError: Its spaces or its number of worlds differ.
        """
        self.check_compatible(envs)
        self.envs.close()
        self.envs = envs

    def check_compatible(self, envs: VectorEnv) -> None:
        """Raises ValueError if a vector environment cannot replace the present one."""
        for name in ("num_envs", "single_observation_space", "single_action_space"):
            old, new = getattr(self.envs, name), getattr(envs, name)
            if old != new:
                raise ValueError(f"{name} is {new}, should be {old}")

    def close(self) -> None:
        """Closes the vector environment."""
        self.envs.close()

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A frame of each world."""
        frames: Any = self.envs.render()
        return list(frames)

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The attribute of the vector environment, repeated for each index."""
        return [self._find(attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Sets an attribute of the vector environment, for all worlds.

        Raises:
            ValueError: `indices` does not name all worlds.
        """
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise ValueError(
                f"indices is {indices}, should be None: all worlds share {attr_name!r}"
            )
        setattr(self.envs.unwrapped, attr_name, value)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Calls the method of the vector environment once; repeats its result for each index."""
        result = self._find(method_name)(*method_args, **method_kwargs)
        return [result] * len(list(self._get_indices(indices)))

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Whether the vector environment is wrapped in `wrapper_class`, repeated for each index."""
        wrapped = any(isinstance(layer, wrapper_class) for layer in self._layers())
        return [wrapped] * len(list(self._get_indices(indices)))

    def _layers(self) -> list[VectorEnv]:
        """The vector environment's wrappers from the outside in, then the environment."""
        layers = [self.envs]
        while isinstance(layers[-1], VectorWrapper):
            layers.append(layers[-1].env)
        return layers

    def _find(self, name: str) -> Any:
        """The attribute of the outermost layer that has it, because wrappers override rewards."""
        for layer in self._layers():
            if hasattr(layer, name):
                return getattr(layer, name)
        raise AttributeError(f"{self.envs} has no attribute {name!r}")

    def _shared_options(self) -> dict[str, Any] | None:
        """The options of the next reset, which must be the same for all worlds."""
        first = self._options[0]
        if any(options is not first and options != first for options in self._options):
            raise ValueError("options differ between worlds, should be the same for all")
        return deepcopy(first) or None


def _copied(observation: Any) -> Any:
    if not isinstance(observation, dict):  # obs_type="flat"
        return np.array(observation)
    return {key: np.array(value) for key, value in observation.items()}


def _info_per_world(infos: dict[str, Any], worlds: np.ndarray) -> list[dict[str, Any]]:
    """The infos of the given worlds, one dict each, from arrays over all worlds."""
    keys = [
        key
        for key, value in infos.items()
        if isinstance(value, np.ndarray) and not key.startswith("_") and key != "final_obs"
    ]
    columns = [infos[key][worlds] for key in keys]
    rows = [column.tolist() if column.ndim == 1 else list(column) for column in columns]
    if not keys:
        return [{} for _ in worlds]
    return [dict(zip(keys, values, strict=True)) for values in zip(*rows, strict=True)]

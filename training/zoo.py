"""Lets rl-baselines3-zoo train on all worlds at once: `--gym-packages rigid_envs training.zoo`.

The zoo builds n_envs single environments and steps them one after another. On import, this module
names `batched` as the class of its vector environments, by the attribute that the zoo keeps for
simulators that are batched themselves. Nothing else of the zoo changes: it reads the same settings,
normalises, evaluates and writes the same files.
"""

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium as gym
from rl_zoo3.exp_manager import ExperimentManager
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecMonitor

from rigid_envs import RigidEnv, RigidVectorEnv
from rigid_envs.wrappers import single, vector
from training.sb3.vec_env import RigidVecEnv
from training.settings.errors import UsageError

# what gym.make wraps an environment in; the vector environment does all of this itself
_OF_GYM_MAKE = (
    gym.wrappers.PassiveEnvChecker,
    gym.wrappers.OrderEnforcing,
    gym.wrappers.TimeLimit,
)
# reward wrappers of single environments: those of vector environments
_REWARDS = {
    kind: getattr(vector, kind.__name__)
    for kind in single.RewardWrapper.__subclasses__()
    if kind.__module__ == single.__name__
}


def batched(env_fns: Sequence[Callable[[], gym.Env]], **kwargs: Any) -> VecEnv:
    """One vector environment with as many worlds as there are functions.

    Args:
        env_fns: Each makes the same single environment, with wrappers. The first one is called, to
            see which environment it makes, with which arguments; others than `RigidEnv` itself are
            stepped one after another, as without this module.
        **kwargs: Of `DummyVecEnv`, which environments of others get.

    Returns:
        `RigidVecEnv` with the reward wrappers of the single environment, in a `VecMonitor` if that
        is in a `Monitor`; the returns that it logs are those after the reward wrappers.

    Raises:
        UsageError: A wrapper that vector environments don't have.
    """
    env = env_fns[0]()
    if type(env.unwrapped) is not RigidEnv:
        env.close()
        return DummyVecEnv(list(env_fns), **kwargs)
    spec = env.spec  # of the wrapped one, which knows a limit of steps that replaces the task's
    assert spec is not None
    arguments = {**spec.kwargs, "max_episode_steps": spec.max_episode_steps or -1}
    layers = []
    while isinstance(env, gym.Wrapper):
        layers.append(env)
        env = env.env
    env.close()
    for layer in layers:
        if not isinstance(layer, (Monitor, *_OF_GYM_MAKE)) and type(layer) not in _REWARDS:
            raise UsageError(
                f"env_wrapper is {type(layer).__name__}, should be one of rigid_envs.wrappers, "
                "which vector environments have, too; without training.zoo any wrapper will do"
            )
    envs: Any = RigidVectorEnv(num_envs=len(env_fns), autoreset_mode="SameStep", **arguments)
    monitor = None
    for layer in reversed(layers):
        if isinstance(layer, Monitor):
            monitor = layer
        elif isinstance(layer, single.RewardWrapper):
            envs = _REWARDS[type(layer)](envs, **vars(layer.rule))
    worlds = RigidVecEnv(envs)
    if monitor is None:
        return worlds
    file = None
    if monitor.results_writer is not None:
        file = monitor.results_writer.file_handler.name
    monitor.close()
    return VecMonitor(worlds, file, getattr(monitor, "info_keywords", ()))


if not hasattr(ExperimentManager, "default_vec_env_cls"):
    raise ImportError("training.zoo needs rl_zoo3 2.9 or newer")
# the zoo only calls it, and a function that isn't static would become its method
ExperimentManager.default_vec_env_cls = staticmethod(batched)  # type: ignore[assignment]

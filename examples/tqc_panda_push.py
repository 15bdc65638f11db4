"""TQC of sb3-contrib learns PandaPush from its sparse reward, by hindsight experience replay.

    pip install sb3-contrib            # needs the Stable-Baselines3 of its own version
    python examples/tqc_panda_push.py  # a few minutes on two cores

TQC is rl-baselines3-zoo's algorithm for panda-gym's tasks. There a step of one world is followed by
one update; here 32 worlds step together, and four updates follow.
"""

import argparse
import time
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from sb3_contrib import TQC
from stable_baselines3 import HerReplayBuffer

import rigid_envs  # noqa: F401  (registers the ids)
from training.sb3.vec_env import RigidVecEnv

EPISODES = 500  # of an evaluation


def make(worlds: int, env_id: str) -> RigidVecEnv:
    """Worlds of a task, for Stable-Baselines3."""
    envs = gym.make_vec(env_id, num_envs=worlds, autoreset_mode=AutoresetMode.SAME_STEP)
    return RigidVecEnv(envs)


def success(model: TQC, envs: RigidVecEnv) -> float:
    """Fraction of episodes that the mean action solves, one in each world."""
    envs.seed(1_000_000)
    now: Any = envs.reset()
    solved, playing = np.zeros(envs.num_envs, bool), np.ones(envs.num_envs, bool)
    while playing.any():
        now, _, ended, infos = envs.step(model.predict(now, deterministic=True)[0])
        for world in np.flatnonzero(playing & ended):
            solved[world] = infos[world]["is_success"]
        playing &= ~ended
    return float(solved.mean())


def main(arguments: list[str] | None = None) -> float:
    """Trains a policy, evaluates it after every part of the steps, and returns the last success."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--env", default="RigidEnvs/PandaPush-v0", help="id (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--every", type=int, default=25_000, help="steps between evaluations")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    test = make(EPISODES, options.env)
    model = TQC(
        "MultiInputPolicy",
        make(32, options.env),
        learning_rate=1e-3,
        learning_starts=min(10_000, options.every),
        batch_size=512,
        tau=0.05,
        gamma=0.95,
        train_freq=1,
        gradient_steps=4,
        ent_coef=0.02,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
        policy_kwargs={"net_arch": [128, 128]},
        seed=options.seed,
    )
    spent, rate = 0.0, 0.0
    while model.num_timesteps < options.steps:
        start = time.perf_counter()
        model.learn(options.every, reset_num_timesteps=False)
        spent += time.perf_counter() - start
        rate = success(model, test)
        print(f"{model.num_timesteps:>9,} steps  {spent:6.1f} s  solved {rate:6.1%}", flush=True)
    return rate


if __name__ == "__main__":
    main()

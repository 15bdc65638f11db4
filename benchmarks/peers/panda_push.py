"""Speed of panda-gym's PandaPush-v3: random actions, sparse reward, a reset after each episode.

usage: panda_push.py SECONDS [WORLDS [PIXELS]]

It imports nothing of this project, so that it can run in a separate virtual environment. For every
line on its standard input it steps for SECONDS and prints the number of environment steps. Several
worlds run in Gymnasium's AsyncVectorEnv, with one process per world. With PIXELS, a picture of that
width and height is drawn after each step, by PyBullet's software renderer.
"""

import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any

import gymnasium as gym
import numpy as np
import panda_gym  # noqa: F401  (registers the environments)

ID, EPISODE = "PandaPush-v3", 50


def single(pixels: int) -> Callable[[int], None]:
    """A function that makes the n-th step of one environment, and a picture if `pixels` > 0."""
    drawn: Any = {"render_mode": "rgb_array", "renderer": "Tiny"}
    drawn |= {"render_width": pixels, "render_height": pixels}
    env = gym.make(ID, **(drawn if pixels else {}))
    env.reset(seed=0)
    actions = [env.action_space.sample() for _ in range(EPISODE)]

    def step(n: int) -> None:
        _, _, terminated, truncated, _ = env.step(actions[n % EPISODE])
        if pixels:
            env.render()
        if terminated or truncated:
            env.reset()

    return step


def vector(worlds: int) -> Callable[[int], None]:
    """A function that makes the n-th step of all environments; they reset by themselves."""
    envs = gym.make_vec(ID, num_envs=worlds, vectorization_mode="async")
    envs.reset(seed=0)
    size = envs.single_action_space.shape or ()
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (EPISODE, worlds, *size)).astype(np.float32)

    def step(n: int) -> None:
        envs.step(actions[n % EPISODE])

    return step


def serve(seconds: float, worlds: int, pixels: int) -> None:
    """Works for one turn per line of standard input."""
    step = single(pixels) if worlds == 1 else vector(worlds)
    for _ in sys.stdin:
        steps, start = 0, perf_counter()
        while perf_counter() - start < seconds:
            step(steps)
            steps += 1
        print("steps", steps * worlds, flush=True)


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[2:]]
    serve(float(sys.argv[1]), *numbers, *(1, 0)[len(numbers) :])

"""Speed of panda-gym's PandaPush-v3: random actions, sparse reward, a reset after each episode.

It needs only panda-gym and stands alone, to run in an environment of its own. At each line on its
standard input it steps for as many seconds as its argument says and prints the number of steps.
"""

import sys
from time import perf_counter

import gymnasium as gym
import panda_gym  # noqa: F401  (registers the environments)


def serve(seconds: float) -> None:
    """Takes a turn at each line, until there are no more."""
    env = gym.make("PandaPush-v3")
    env.reset(seed=0)
    actions = [env.action_space.sample() for _ in range(50)]
    for _ in sys.stdin:
        steps, start = 0, perf_counter()
        while perf_counter() - start < seconds:
            _, _, terminated, truncated, _ = env.step(actions[steps % 50])
            steps += 1
            if terminated or truncated:
                env.reset()
        print("steps", steps, flush=True)


if __name__ == "__main__":
    serve(float(sys.argv[1]))

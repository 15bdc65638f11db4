"""Environment steps a second of panda-gym's PandaPush-v3, one figure a round. Needs only panda-gym.

Arguments: number of rounds, seconds a round. It stands alone, to run in an environment of its own.
"""

import sys
from time import perf_counter

import gymnasium as gym
import panda_gym  # noqa: F401  (registers the environments)


def measure(rounds: int, seconds: float) -> list[float]:
    """Random actions, sparse reward, reset at the end of each episode."""
    env = gym.make("PandaPush-v3")
    env.reset(seed=0)
    actions = [env.action_space.sample() for _ in range(50)]
    rates = []
    for _ in range(rounds):
        steps, start = 0, perf_counter()
        while (spent := perf_counter() - start) < seconds:
            _, _, terminated, truncated, _ = env.step(actions[steps % 50])
            steps += 1
            if terminated or truncated:
                env.reset()
        rates.append(steps / spent)
    return rates


if __name__ == "__main__":
    print(*measure(int(sys.argv[1]), float(sys.argv[2])))

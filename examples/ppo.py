"""PPO in one file of plain PyTorch, on a vector environment that simulates all worlds at once.

    python examples/ppo.py                                    # Push, 1 to 2 minutes on two cores
    python examples/ppo.py --env RigidEnvs/ThrowDense-v0 --gamma 0.97

It is proximal policy optimisation (Schulman et al. 2017) with generalised advantage estimates
(Schulman et al. 2016). Observations are normalised by their running mean and variance. The loop is
written out, so that it can be changed; `rigid-envs train` has checkpoints, logs and more settings.
"""

import argparse
import math
import time

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn
from torch.distributions import Normal

import rigid_envs  # noqa: F401  (registers the ids)

Array = np.ndarray


class Normalizer:
    """Scales observations by the mean and variance of all that it has seen."""

    def __init__(self, size: int) -> None:
        self.mean, self.variance, self.count = np.zeros(size), np.ones(size), 1e-4

    def update(self, batch: Array) -> None:
        """Adds a batch [n, size] by the parallel formula of Chan et al. (1979)."""
        mean, variance, count = batch.mean(axis=0), batch.var(axis=0), len(batch)
        apart, total = mean - self.mean, self.count + count
        self.mean = self.mean + apart * count / total
        squares = self.variance * self.count + variance * count
        self.variance = (squares + apart**2 * self.count * count / total) / total
        self.count = total

    def __call__(self, batch: Array) -> torch.Tensor:
        """A batch [n, size], scaled."""
        scaled = (batch - self.mean) / np.sqrt(self.variance + 1e-8)
        return torch.as_tensor(np.clip(scaled, -10.0, 10.0), dtype=torch.float32)


class Agent(nn.Module):
    """Two networks: the mean of a normal distribution of actions, and the value of a state."""

    def __init__(self, observations: int, actions: int, width: int = 64) -> None:
        super().__init__()
        self.actor = self._network(observations, actions, width, 0.01)
        self.critic = self._network(observations, 1, width, 1.0)
        self.log_std = nn.Parameter(torch.full((actions,), -0.5))

    @staticmethod
    def _network(inputs: int, outputs: int, width: int, gain: float) -> nn.Sequential:
        layers = [nn.Linear(inputs, width), nn.Linear(width, width), nn.Linear(width, outputs)]
        for layer, scale in zip(layers, (math.sqrt(2.0), math.sqrt(2.0), gain), strict=True):
            nn.init.orthogonal_(layer.weight, scale)
            nn.init.zeros_(layer.bias)
        return nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])

    def value(self, x: torch.Tensor) -> torch.Tensor:
        """Values [n] of observations [n, size]."""
        return self.critic(x)[:, 0]

    def distribution(self, x: torch.Tensor) -> Normal:
        """Of actions, for observations [n, size]."""
        return Normal(self.actor(x), self.log_std.exp())


def flat(observation: dict[str, Array]) -> Array:
    """One row a world: the state, and both goals."""
    return np.concatenate([observation[key] for key in sorted(observation)], axis=1)


def train(options: argparse.Namespace) -> float:
    """Trains an agent and prints its progress; returns the last success rate."""
    torch.manual_seed(options.seed)
    torch.set_num_threads(options.threads)
    envs = gym.make_vec(
        options.env, num_envs=options.num_envs, autoreset_mode=AutoresetMode.SAME_STEP
    )
    observation = flat(envs.reset(seed=options.seed)[0])
    size, actions = observation.shape[1], envs.single_action_space.shape[0]
    agent, normalizer = Agent(size, actions), Normalizer(size)
    optimizer = torch.optim.Adam(agent.parameters(), lr=options.learning_rate, eps=1e-5)

    steps, worlds = options.num_steps, options.num_envs
    x = torch.zeros(steps, worlds, size)
    taken, log_probs = torch.zeros(steps, worlds, actions), torch.zeros(steps, worlds)
    rewards, values = np.zeros((steps, worlds)), np.zeros((steps + 1, worlds))
    ends = np.zeros((steps, worlds), dtype=bool)
    start, success = time.perf_counter(), 0.0

    for update in range(1, options.total_steps // (steps * worlds) + 1):
        # collect
        solved = []
        with torch.no_grad():
            for t in range(steps):
                normalizer.update(observation)
                x[t] = normalizer(observation)
                distribution = agent.distribution(x[t])
                taken[t] = distribution.sample()
                log_probs[t] = distribution.log_prob(taken[t]).sum(-1)
                values[t] = agent.value(x[t]).numpy()
                new, rewards[t], terminated, truncated, info = envs.step(taken[t].numpy())
                observation, ends[t] = flat(new), terminated | truncated
                if ends[t].any():
                    last = info["final_obs"][ends[t]]
                    stacked = {key: np.stack([one[key] for one in last]) for key in last[0]}
                    # an episode that was cut off would have gone on: its value counts
                    cut = truncated[ends[t]] & ~terminated[ends[t]]
                    beyond = agent.value(normalizer(flat(stacked))).numpy()
                    rewards[t, ends[t]] += options.gamma * beyond * cut
                    solved += info["final_info"]["is_success"][ends[t]].tolist()
            values[steps] = agent.value(normalizer(observation)).numpy()

        # generalised advantage estimates, from the last step to the first
        advantages, following = np.zeros((steps, worlds)), np.zeros(worlds)
        for t in reversed(range(steps)):
            goes_on = ~ends[t]
            error = rewards[t] + options.gamma * values[t + 1] * goes_on - values[t]
            following = error + options.gamma * options.gae_lambda * goes_on * following
            advantages[t] = following
        returns = torch.as_tensor(advantages + values[:steps], dtype=torch.float32).flatten()
        advantage = torch.as_tensor(advantages, dtype=torch.float32).flatten()
        batch = (x.flatten(0, 1), taken.flatten(0, 1), log_probs.flatten(), advantage, returns)

        # update: several passes over the batch
        for _ in range(options.epochs):
            for part in torch.randperm(steps * worlds).split(options.batch_size):
                seen, action, before, gain, target = (whole[part] for whole in batch)
                distribution = agent.distribution(seen)
                ratio = (distribution.log_prob(action).sum(-1) - before).exp()
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                clipped = ratio.clamp(1.0 - options.clip, 1.0 + options.clip)
                policy_loss = -torch.min(ratio * gain, clipped * gain).mean()
                value_loss = (agent.value(seen) - target).square().mean()
                optimizer.zero_grad()
                (policy_loss + 0.5 * value_loss).backward()
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()

        if solved:
            success = float(np.mean(solved))
            done, spent = update * steps * worlds, time.perf_counter() - start
            print(f"{done:>10,} steps  {spent:6.1f} s  solved {success:6.1%}", flush=True)
        if success >= options.stop_at:
            break
    envs.close()
    return success


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Settings of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--env", default="RigidEnvs/PushDense-v0", help="id (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--total-steps", type=int, default=5_000_000, help="rounded down to whole updates"
    )
    parser.add_argument("--num-envs", type=int, default=1024)
    parser.add_argument("--num-steps", type=int, default=50, help="of a world for an update")
    parser.add_argument("--batch-size", type=int, default=6400)
    parser.add_argument("--epochs", type=int, default=4)
    parser.add_argument("--learning-rate", type=float, default=1e-3)
    parser.add_argument("--gamma", type=float, default=0.95)
    parser.add_argument("--gae-lambda", type=float, default=0.95)
    parser.add_argument("--clip", type=float, default=0.2)
    parser.add_argument("--threads", type=int, default=1, help="of torch; more need idle cores")
    parser.add_argument("--stop-at", type=float, default=0.97, help="success rate")
    options = parser.parse_args(arguments)
    rollout = options.num_envs * options.num_steps
    if options.total_steps < rollout:
        parser.error(
            f"--total-steps is {options.total_steps}, should be at least num-envs x num-steps, "
            f"{rollout}"
        )
    return options


if __name__ == "__main__":
    train(parse())

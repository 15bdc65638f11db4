"""Imitation of demonstrations, then TD3+BC: SAC's networks, but no entropy.

With a sparse reward, SAC's actor leaves the demonstrated actions before the critic has learned that
they are good: it climbs the critic's slope, which is wrong where no action was tried. Here it first
is fitted to the demonstrations alone (behaviour cloning), and then maximises

    Q(s, mean action) / mean |Q|  -  weight * squared distance to the demonstrated action

as in TD3+BC (Fujimoto and Gu, A minimalist approach to offline reinforcement learning, NeurIPS
2021), with new episodes besides. The noise of its actions is constant.
"""

import math
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.utils import polyak_update
from torch.nn.functional import mse_loss

from training.sb3.demonstration_buffers import DemonstrationBuffer

LEARNING_RATE, LEAST_LEARNING_RATE = 1e-3, 1e-5
"""At the start and at the end of cloning, between which it falls linearly."""
WEIGHT_DECAY = 0.3
"""Of AdamW while cloning: a network that fits few demonstrations exactly errs between them."""
BATCH = 256
"""Demonstrated actions in a gradient step of cloning."""
NOISE = 0.06
"""Standard deviation of the actions about the mean action, before the hyperbolic tangent."""


class CloningSAC(SAC):
    """SAC's networks and buffers, with an actor that imitates demonstrations; see the module.

    It has no entropy term: `ent_coef` has no effect.

    Args:
        *args: As for SAC.
        cloning_steps: Gradient steps in which the actor only imitates, before the first update.
        cloning_weight: Weight of the distance to the demonstrated actions afterwards.
        **kwargs: As for SAC; the buffer is a `DemonstrationBuffer`.
    """

    def __init__(
        self, *args: Any, cloning_steps: int = 0, cloning_weight: float = 0.0, **kwargs: Any
    ):
        self.cloning_steps, self.cloning_weight = cloning_steps, cloning_weight
        super().__init__(*args, **kwargs)

    def _setup_model(self) -> None:
        super()._setup_model()
        spread: Any = self.actor.log_std
        torch.nn.init.zeros_(spread.weight)
        torch.nn.init.constant_(spread.bias, math.log(NOISE))
        spread.requires_grad_(False)

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Clones before the first update; then updates critic and actor `gradient_steps` times."""
        self.policy.set_training_mode(True)
        if self._n_updates == 0:
            self._clone()
        self._update_learning_rate([self.actor.optimizer, self.critic.optimizer])
        losses = [self._update(batch_size) for _ in range(gradient_steps)]
        self._n_updates += gradient_steps
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        means = np.mean(losses, axis=0).tolist()
        for name, value in zip(("critic", "actor", "cloning"), means, strict=True):
            self.logger.record(f"train/{name}_loss", value)

    def _clone(self) -> None:
        """Fits the actor to the demonstrations alone."""
        optimizer = torch.optim.AdamW(self.actor.parameters(), weight_decay=WEIGHT_DECAY)
        for step in range(self.cloning_steps):
            left = 1.0 - step / self.cloning_steps
            rate = LEAST_LEARNING_RATE + (LEARNING_RATE - LEAST_LEARNING_RATE) * left
            optimizer.param_groups[0]["lr"] = rate
            loss = self._distance(BATCH)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()

    def _distance(self, batch_size: int) -> torch.Tensor:
        """Mean squared distance of the mean action to demonstrated ones."""
        buffer = self.replay_buffer
        assert isinstance(buffer, DemonstrationBuffer)
        observations, actions = buffer.sample_intended(batch_size, self._vec_normalize_env)
        return mse_loss(self.actor(observations, deterministic=True), actions)

    def _update(self, batch_size: int) -> tuple[float, float, float]:
        """One gradient step of critic and actor; returns the losses."""
        assert self.replay_buffer is not None
        batch = self.replay_buffer.sample(batch_size, env=self._vec_normalize_env)
        with torch.no_grad():
            following = torch.cat(
                self.critic_target(batch.next_observations, self.actor(batch.next_observations)), 1
            )
            value = following.min(dim=1, keepdim=True).values
            target = batch.rewards + (1.0 - batch.dones) * self.gamma * value
        critic_loss = sum(
            mse_loss(one, target) for one in self.critic(batch.observations, batch.actions)
        )
        assert isinstance(critic_loss, torch.Tensor)
        self.critic.optimizer.zero_grad()
        critic_loss.backward()
        self.critic.optimizer.step()

        mean = self.actor(batch.observations, deterministic=True)
        value = torch.cat(self.critic(batch.observations, mean), dim=1).min(dim=1).values
        actor_loss = -value.mean() / value.abs().mean().detach()
        cloning_loss = self._distance(batch_size)
        self.actor.optimizer.zero_grad()
        (actor_loss + self.cloning_weight * cloning_loss).backward()
        self.actor.optimizer.step()
        polyak_update(self.critic.parameters(), self.critic_target.parameters(), self.tau)
        return critic_loss.item(), actor_loss.item(), cloning_loss.item()

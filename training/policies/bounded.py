"""A policy of PPO whose actions stay where they can be learned from."""

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.distributions import Distribution
from stable_baselines3.common.policies import MultiInputActorCriticPolicy

from training.settings.errors import UsageError


class BoundedPolicy(MultiInputActorCriticPolicy):
    """Draws actions about x / (1 + |x|) of what the network gives, with a floor under their spread.

    Stable-Baselines3's own mean has no bounds, and actions are cut to theirs afterwards. Where a
    full action is best, as to open a grip above a cube, the mean drifts far beyond it, and no draw
    comes back to where closing would be felt to pay. And its spread shrinks as the first part of a
    task is mastered, until no draw comes upon the next part.

    Args:
        *args: As of Stable-Baselines3's policy.
        least_std: Standard deviation that is added to the learned one.
        **kwargs: As of Stable-Baselines3's policy.

    Raises:
        UsageError: The action's bounds are not ±1.
    """

    action_net: torch.nn.Linear
    action_dist: Any
    log_std: torch.nn.Parameter

    def __init__(self, *args: Any, least_std: float = 0.0, **kwargs: Any):
        self.least_std = least_std
        super().__init__(*args, **kwargs)
        low, high = getattr(self.action_space, "low", 0.0), getattr(self.action_space, "high", 0.0)
        if not (np.all(low == -1.0) and np.all(high == 1.0)):
            raise UsageError(f"BoundedPolicy takes actions within ±1, not {self.action_space}")

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "least_std": self.least_std}

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        # softer than tanh, whose slope is gone where an action has long been full
        mean = torch.nn.functional.softsign(self.action_net(latent_pi))
        log_std = torch.log(self.least_std + torch.exp(self.log_std))
        distribution: Distribution = self.action_dist.proba_distribution(mean, log_std)
        return distribution

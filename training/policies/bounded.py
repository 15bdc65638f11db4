"""A PPO policy with a bounded mean action and a minimum standard deviation."""

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.distributions import Distribution
from stable_baselines3.common.policies import MultiInputActorCriticPolicy

from training.settings.errors import UsageError


class BoundedPolicy(MultiInputActorCriticPolicy):
    """A Gaussian policy with mean x / (1 + |x|) of the network's output x.

    Stable-Baselines3's mean has no bounds, and actions are clipped afterwards. Where a full action
    is best, as to open the gripper above a cube, that mean drifts far beyond the bound. Then no
    sample is small enough to discover that closing the gripper pays. In addition the standard
    deviation shrinks while the first part of a task is learned, so that the next part is not
    explored; `min_std` limits this.

    Args:
        *args: As for Stable-Baselines3's policy.
        min_std: Standard deviation that is added to the learned one.
        **kwargs: As for Stable-Baselines3's policy.

    Raises:
        UsageError: The bounds of the action are not ±1.
    """

    action_net: torch.nn.Linear
    action_dist: Any
    log_std: torch.nn.Parameter

    def __init__(self, *args: Any, min_std: float = 0.0, **kwargs: Any):
        self.min_std = min_std
        super().__init__(*args, **kwargs)
        low, high = getattr(self.action_space, "low", 0.0), getattr(self.action_space, "high", 0.0)
        if not (np.all(low == -1.0) and np.all(high == 1.0)):
            raise UsageError(f"BoundedPolicy requires actions within ±1, not {self.action_space}")

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "min_std": self.min_std}

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        # the gradient of softsign decays more slowly than that of tanh
        mean = torch.nn.functional.softsign(self.action_net(latent_pi))
        log_std = torch.log(self.min_std + torch.exp(self.log_std))
        distribution: Distribution = self.action_dist.proba_distribution(mean, log_std)
        return distribution

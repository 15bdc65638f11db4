"""A PPO policy with a bounded mean action and a minimum standard deviation."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.distributions import Distribution
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule

from training.settings.errors import UsageError

LOG_STD_RANGE = (-6.0, 0.5)
"""Bounds of the logarithm of a standard deviation that depends on the state, before `min_std` is
added. There is no gradient beyond them."""


class BoundedPolicy(MultiInputActorCriticPolicy):
    """A Gaussian policy with mean x / (1 + |x|) of the network's output x.

    Stable-Baselines3's mean has no bounds, and actions are clipped afterwards. Where a full action
    is best, as to open the gripper above a cube, that mean drifts far beyond the bound. Then no
    sample is small enough to discover that closing the gripper pays. In addition the standard
    deviation shrinks while the first part of a task is learned, so that the next part is not
    explored; `min_std` limits this.

    One standard deviation for all states has to be that of the most delicate one: a tower falls if
    the hand explores while it lets go. With `state_dependent_std` a linear layer adds to its
    logarithm in each state, so that the hand still explores on its way.

    Args:
        *args: As for Stable-Baselines3's policy.
        min_std: Standard deviation that is added to the learned one.
        log_std_init: Logarithm of the learned one at the start, one number or one for each
            component of the action: fingers may have to explore where the hand must not.
        state_dependent_std: Whether the standard deviation depends on the observation; its
            logarithm then stays within `LOG_STD_RANGE`.
        **kwargs: As for Stable-Baselines3's policy.

    Raises:
        UsageError: The bounds of the action are not ±1, or `log_std_init` is outside of the range
            or has another number of components.
    """

    action_net: torch.nn.Linear
    action_dist: Any
    log_std: torch.nn.Parameter

    def __init__(
        self,
        *args: Any,
        min_std: float = 0.0,
        log_std_init: float | Sequence[float] = 0.0,
        state_dependent_std: bool = False,
        **kwargs: Any,
    ):
        self.min_std, self.state_dependent_std = min_std, state_dependent_std
        self.first_log_std = log_std_init
        super().__init__(*args, **kwargs)
        low, high = getattr(self.action_space, "low", 0.0), getattr(self.action_space, "high", 0.0)
        if not (np.all(low == -1.0) and np.all(high == 1.0)):
            raise UsageError(f"BoundedPolicy requires actions within ±1, not {self.action_space}")
        least, most = LOG_STD_RANGE
        within = bool(((self.log_std > least) & (self.log_std < most)).all())
        if state_dependent_std and not within:
            raise UsageError(
                f"log_std_init is {log_std_init}, should be above {least} and below {most} "
                "with state_dependent_std"
            )

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {
            **super()._get_constructor_parameters(),
            "min_std": self.min_std,
            "log_std_init": self.first_log_std,
            "state_dependent_std": self.state_dependent_std,
        }

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        first = torch.as_tensor(self.first_log_std)
        if first.shape not in ((), self.log_std.shape):
            raise UsageError(
                f"log_std_init is {self.first_log_std}, should be one number or a list of "
                f"{len(self.log_std)}, one for each component of the action"
            )
        with torch.no_grad():
            self.log_std.copy_(first)
        if self.state_dependent_std:
            layer = torch.nn.Linear(self.mlp_extractor.latent_dim_pi, self.action_net.out_features)
            torch.nn.init.zeros_(layer.weight)
            torch.nn.init.zeros_(layer.bias)
            self.std_net = layer  # its bias and `log_std` both set what all states have in common
            self.optimizer.add_param_group({"params": list(layer.parameters())})

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        # the gradient of softsign decays more slowly than that of tanh
        mean = torch.nn.functional.softsign(self.action_net(latent_pi))
        log_std: torch.Tensor = self.log_std
        if self.state_dependent_std:
            log_std = (log_std + self.std_net(latent_pi)).clamp(*LOG_STD_RANGE)
        log_std = torch.log(self.min_std + torch.exp(log_std))
        distribution: Distribution = self.action_dist.proba_distribution(mean, log_std)
        return distribution

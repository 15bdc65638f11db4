"""Policies whose features tell millimetres apart near zero and still cover metres."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.sac.policies import MultiInputPolicy

from training.policies.bounded import BoundedPolicy
from training.settings.config import SYMLOG_RULES
from training.settings.errors import UsageError

UNITS = (0.1, 0.002)
"""By default each quantity is divided by each of these: a tenth of a metre, and two millimetres."""


def symlog(x: torch.Tensor) -> torch.Tensor:
    """sign(x) ln(1 + |x|): linear near zero, logarithmic far from it."""
    return torch.sign(x) * torch.log1p(torch.abs(x))


class SymlogOffsets(BaseFeaturesExtractor):
    """Features: symlog(x / unit) of each x and each unit.

    x are components of the observation, those of desired minus achieved goal, and the given
    differences. A cube is released within 4 mm of its place but carried from tenths of a
    metre away; a network of few units cannot resolve both in one linear scale. Symlog is that of
    Hafner et al., Mastering diverse domains through world models (2023).

    The extractor has no parameters, and a policy file stores `matrix` as a layer of its own.

    Args:
        space: Observation space of a goal environment.
        differences: Pairs [a, b] of components of `observation`, whose difference a - b is an x
            too; -1 is the last component.
        components: Components of `observation` that are x, -1 being the last; None for all.
        units: What each x is divided by, in the unit of x.

    Raises:
        UsageError: The space has no goals, or the observation has no such component.
    """

    matrix: torch.Tensor

    def __init__(
        self,
        space: spaces.Dict,
        differences: Sequence[Sequence[int]] = (),
        components: Sequence[int] | None = None,
        units: Sequence[float] = UNITS,
    ):
        sizes = {key: int(np.prod(one.shape or ())) for key, one in space.spaces.items()}
        if set(sizes) != {"observation", "achieved_goal", "desired_goal"}:
            raise UsageError(f"symlog policies require observations with goals, not {space}")
        size, goal = sizes["observation"], sizes["desired_goal"]
        pairs = [index for pair in differences for index in pair]
        for name, indices in (("differences", pairs), ("components", components or ())):
            if any(not -size <= index < size for index in indices):
                value = differences if name == "differences" else components
                raise UsageError(
                    f"{name} is {value}, should have components of the observation, {-size} to "
                    f"{size - 1}"
                )
        chosen = range(size) if components is None else [index % size for index in components]
        observed = len(chosen)
        rows = observed + goal + len(differences)
        super().__init__(space, rows * len(units))
        self.keys = list(sizes)
        ends = np.cumsum(list(sizes.values()))
        first = dict(zip(sizes, ends - list(sizes.values()), strict=True))
        x = torch.zeros(rows, int(ends[-1]))
        for row, component in enumerate(chosen):
            x[row, first["observation"] + component] = 1.0
        for row in range(goal):
            x[observed + row, first["desired_goal"] + row] = 1.0
            x[observed + row, first["achieved_goal"] + row] = -1.0
        for row, (a, b) in enumerate(differences, start=observed + goal):
            x[row, first["observation"] + a % size] = 1.0
            x[row, first["observation"] + b % size] = -1.0
        self.register_buffer("matrix", torch.cat([x / unit for unit in units]))

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features [n, len(units) (components + goal + differences)]."""
        parts = [observations[key].flatten(start_dim=1) for key in self.keys]
        return symlog(torch.cat(parts, dim=1) @ self.matrix.T)


class Symlog:
    """Gives a policy of Stable-Baselines3 `SymlogOffsets` as its features.

    Args:
        *args: As for the policy.
        differences, components, units: As for `SymlogOffsets`.
        **kwargs: As for the policy.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        own = {name: kwargs.pop(name) for name in SYMLOG_RULES if name in kwargs}
        saved = kwargs.get("features_extractor_kwargs") or {}  # of a saved policy
        kwargs["features_extractor_class"] = SymlogOffsets
        kwargs["features_extractor_kwargs"] = {**saved, **own}
        super().__init__(*args, **kwargs)


class SymlogPolicy(Symlog, MultiInputPolicy):
    """Stable-Baselines3's SAC policy with `SymlogOffsets` as its features."""


class SymlogActorCriticPolicy(Symlog, MultiInputActorCriticPolicy):
    """Stable-Baselines3's PPO policy with `SymlogOffsets` as its features."""


class BoundedSymlogPolicy(Symlog, BoundedPolicy):
    """`BoundedPolicy` for PPO, with `SymlogOffsets` as its features."""

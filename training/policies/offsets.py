"""A policy of SAC that sees how far the goal is."""

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.sac.policies import MultiInputPolicy

from training.settings.errors import UsageError

SCALE = 10.0
"""Of goals and ways to them: those of a tabletop are tenths of a metre. What a goal has beside
places, as whether a cube is let go, weighs the more for it."""


class GoalOffsets(BaseFeaturesExtractor):
    """The observation, the way from achieved to desired goal, and the desired goal.

    Stable-Baselines3's own extractor hands both goals on as they are. Then each of the first
    layer's units has to find out for each component that only their difference counts, to a
    precision of centimetres in numbers of tenths. Hindsight puts other desired goals in place, and
    what is made of them here follows.

    It is a linear map without anything to learn, so that a policy file holds it in its first layer.

    Args:
        space: Of a goal environment.

    Raises:
        UsageError: The space has no goals.
    """

    matrix: torch.Tensor

    def __init__(self, space: spaces.Dict):
        sizes = {key: int(np.prod(one.shape or ())) for key, one in space.spaces.items()}
        if set(sizes) != {"observation", "achieved_goal", "desired_goal"}:
            raise UsageError(f"OffsetPolicy takes observations with goals, not {space}")
        seen, goal = sizes["observation"], sizes["desired_goal"]
        super().__init__(space, seen + 2 * goal)
        self.keys = list(sizes)
        ends = np.cumsum(list(sizes.values()))
        first = dict(zip(sizes, ends - list(sizes.values()), strict=True))
        matrix = torch.zeros(seen + 2 * goal, int(ends[-1]))
        for row in range(seen):
            matrix[row, first["observation"] + row] = 1.0
        for row in range(goal):
            matrix[seen + row, first["desired_goal"] + row] = SCALE
            matrix[seen + row, first["achieved_goal"] + row] = -SCALE
            matrix[seen + goal + row, first["desired_goal"] + row] = SCALE
        self.register_buffer("matrix", matrix)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features [n, observation + 2 goal]."""
        parts = [observations[key].flatten(start_dim=1) for key in self.keys]
        return torch.cat(parts, dim=1) @ self.matrix.T


class OffsetPolicy(MultiInputPolicy):
    """Stable-Baselines3's policy of SAC for goal environments, which sees what `GoalOffsets` tells.

    Args:
        *args: As of Stable-Baselines3's policy.
        **kwargs: Likewise.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **{**kwargs, "features_extractor_class": GoalOffsets})

"""A SAC policy that observes the desired goal relative to the achieved one."""

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.sac.policies import MultiInputPolicy

from training.settings.errors import UsageError

SCALE = 10.0
"""Factor of goals and goal offsets. Positions on a tabletop are tenths of a metre; the factor also
gives more weight to other goal components, such as "released" of Stack."""


class GoalOffsets(BaseFeaturesExtractor):
    """Features: the observation, desired minus achieved goal, and the desired goal.

    Stable-Baselines3's extractor passes both goals unchanged. Then each unit of the first layer has
    to learn, for each component, that only the difference matters, with centimetre precision in
    numbers of tenths of a metre. The features stay correct when HER replaces the desired goal.

    The map is linear and has no parameters, so a policy file stores it in the first layer.

    Args:
        space: Observation space of a goal environment.

    Raises:
        UsageError: The space has no goals.
    """

    matrix: torch.Tensor

    def __init__(self, space: spaces.Dict):
        sizes = {key: int(np.prod(one.shape or ())) for key, one in space.spaces.items()}
        if set(sizes) != {"observation", "achieved_goal", "desired_goal"}:
            raise UsageError(f"OffsetPolicy requires observations with goals, not {space}")
        observed, goal = sizes["observation"], sizes["desired_goal"]
        super().__init__(space, observed + 2 * goal)
        self.keys = list(sizes)
        ends = np.cumsum(list(sizes.values()))
        first = dict(zip(sizes, ends - list(sizes.values()), strict=True))
        matrix = torch.zeros(observed + 2 * goal, int(ends[-1]))
        for row in range(observed):
            matrix[row, first["observation"] + row] = 1.0
        for row in range(goal):
            matrix[observed + row, first["desired_goal"] + row] = SCALE
            matrix[observed + row, first["achieved_goal"] + row] = -SCALE
            matrix[observed + goal + row, first["desired_goal"] + row] = SCALE
        self.register_buffer("matrix", matrix)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features [n, observation + 2 goal]."""
        parts = [observations[key].flatten(start_dim=1) for key in self.keys]
        return torch.cat(parts, dim=1) @ self.matrix.T


class OffsetPolicy(MultiInputPolicy):
    """Stable-Baselines3's SAC policy for goal environments, with `GoalOffsets` as its features.

    Args:
        *args: As for Stable-Baselines3's policy.
        **kwargs: As for Stable-Baselines3's policy.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **{**kwargs, "features_extractor_class": GoalOffsets})

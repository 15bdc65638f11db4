"""A PPO policy that acts from pictures, and whose critic observes the state."""

from collections.abc import Sequence
from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor, MlpExtractor
from torch import nn

from training.policies.features.keypoints import cell_centers, map_size
from training.policies.features.symlog_features import SymlogOffsets
from training.settings.errors import UsageError
from training.settings.network_settings import PIXEL_RULES, SYMLOG_RULES

FILTERS = ((16, 5, 3), (16, 3, 1))
"""By default: outputs, kernel width and stride of the convolutions before that of the maps."""
KEYPOINTS = 16
"""Number of keypoints by default."""
SHARPNESS = 10.0
"""Factor of the maps. With 1, a new network's softmax is so even that all keypoints lie in the
middle of every picture, and nothing is learned from them."""
KEYPOINT_SCALE, GOAL_SCALE = 4.0, 10.0
"""Factors of keypoints, which are within ±1, and of goals in m: the usual values are about one."""


class KeypointFeatures(BaseFeaturesExtractor):
    """Features: the keypoints of a picture, and the desired goal.

    See `training.policies.features.keypoints`. The convolutions see no position in the picture, and
    the keypoints nothing else, so that few pictures suffice to learn where things are.

    Args:
        space: Observation space with a picture, channels first, and goals.
        filters: Outputs, kernel width and stride of each convolution before the maps.
        keypoints: Number of maps.

    Raises:
        UsageError: The space has no picture or no goals, or the picture is too small.
    """

    column: torch.Tensor
    row: torch.Tensor
    factors: torch.Tensor

    def __init__(
        self,
        space: spaces.Dict,
        filters: Sequence[Sequence[int]] = FILTERS,
        keypoints: int = KEYPOINTS,
    ):
        picture, goal = space.spaces.get("observation"), space.spaces.get("desired_goal")
        if picture is None or goal is None or len(picture.shape or ()) != 3:
            raise UsageError(
                f'PixelPolicy requires pictures and goals, obs_type="pixels+state", not {space}'
            )
        assert picture.shape is not None
        assert goal.shape is not None
        channels, height, width = picture.shape
        if channels >= min(height, width):  # Stable-Baselines3 takes the least for the channels
            raise UsageError(
                f"the picture has the shape {picture.shape}, should have fewer channels than rows "
                "and columns: a larger pixel_size, or a smaller frame_stack"
            )
        chain = (*filters, (keypoints, 1, 1))
        size = [map_size(side, chain) for side in (height, width)]
        if min(size) < 1:
            raise UsageError(
                f"filters is {filters}, too much for pictures of {height} x {width} pixels"
            )
        super().__init__(space, 2 * keypoints + goal.shape[0])
        layers: list[nn.Module] = []
        for outputs, kernel, stride in chain:
            layers += [nn.Conv2d(channels, outputs, kernel, stride), nn.ReLU()]
            channels = outputs
        self.net = nn.Sequential(*layers[:-1])
        scales = [KEYPOINT_SCALE] * (2 * keypoints) + [GOAL_SCALE] * goal.shape[0]
        self.register_buffer("factors", torch.tensor(scales))
        rows, columns = (torch.as_tensor(cell_centers(count)).float() for count in size)
        self.register_buffer("column", columns.repeat(size[0]))
        self.register_buffer("row", -rows.repeat_interleave(size[1]))

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features [n, 2 keypoints + goal]."""
        # convolutions of few channels are twice as fast with the channels last
        picture = observations["observation"].contiguous(memory_format=torch.channels_last)
        cells = (SHARPNESS * self.net(picture)).flatten(2).softmax(-1)
        places = [cells @ self.column, cells @ self.row]
        return self.factors * torch.cat([*places, observations["desired_goal"]], dim=1)


class StateFeatures(SymlogOffsets):
    """`SymlogOffsets` of an observation whose state is under the key `state`.

    Args:
        space: Observation space with a state and goals.
        **kwargs: As for `SymlogOffsets`.

    Raises:
        UsageError: The space has no state, or the state has no such component.
    """

    def __init__(self, space: spaces.Dict, **kwargs: Any):
        if "state" not in space.spaces:
            raise UsageError(f'PixelPolicy\'s critic requires obs_type="pixels+state", not {space}')
        super().__init__(spaces.Dict(_without_picture(space.spaces)), **kwargs)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features as of `SymlogOffsets`."""
        return super().forward(_without_picture(observations))


def _without_picture(values: Any) -> dict[str, Any]:
    """The entries of an observation, with the state in place of the picture."""
    return {
        "observation": values["state"],
        "achieved_goal": values["achieved_goal"],
        "desired_goal": values["desired_goal"],
    }


class PixelPolicy(MultiInputActorCriticPolicy):
    """The actor observes a picture and the desired goal, the critic the state and both goals.

    The critic is needed in training alone, where a simulator knows the state (asymmetric
    actor-critic, Pinto et al. 2018). The trained policy acts with obs_type="pixels".

    Args:
        *args: As for Stable-Baselines3's policy.
        filters, keypoints: As for `KeypointFeatures`, the actor's features.
        differences, components, units, next_object: As for `SymlogOffsets`, the critic's
            features.
        **kwargs: As for Stable-Baselines3's policy.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        actor = {name: kwargs.pop(name) for name in PIXEL_RULES if name in kwargs}
        critic = {name: kwargs.pop(name) for name in SYMLOG_RULES if name in kwargs}
        both = {"actor": actor, "critic": critic}
        self._features = kwargs.pop("features_extractor_kwargs", None) or both  # of a saved policy
        kwargs["features_extractor_class"] = KeypointFeatures
        kwargs["features_extractor_kwargs"] = self._features["actor"]
        kwargs["share_features_extractor"] = False
        super().__init__(*args, **kwargs)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {
            **super()._get_constructor_parameters(),
            "features_extractor_kwargs": self._features,
        }

    def _build_mlp_extractor(self) -> None:
        """Gives the critic features and a network of its own."""
        assert isinstance(self.observation_space, spaces.Dict)
        features = StateFeatures(self.observation_space, **self._features["critic"])
        self.vf_features_extractor = features
        super()._build_mlp_extractor()
        critic = MlpExtractor(
            features.features_dim,
            net_arch=self.net_arch,
            activation_fn=self.activation_fn,
            device=self.device,
        )
        self.mlp_extractor.value_net = critic.value_net

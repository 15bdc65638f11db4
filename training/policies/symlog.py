"""Policies whose features tell millimetres apart near zero and still cover metres."""

from typing import Any

from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.sac.policies import MultiInputPolicy

from training.policies.bounded import BoundedPolicy
from training.policies.features.symlog_features import SymlogOffsets
from training.policies.mirrored import Mirrored
from training.settings.network_settings import SYMLOG_RULES


class Symlog:
    """Gives a policy of Stable-Baselines3 `SymlogOffsets` as its features.

    Args:
        *args: As for the policy.
        differences, components, units, next_object: As for `SymlogOffsets`.
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


class SymlogActorCriticPolicy(Mirrored, Symlog, MultiInputActorCriticPolicy):
    """Stable-Baselines3's PPO policy with `SymlogOffsets` as its features.

    With `mirrors` it is equivariant, see `Mirrored`.
    """


class BoundedSymlogPolicy(Mirrored, Symlog, BoundedPolicy):
    """`BoundedPolicy` for PPO, with `SymlogOffsets` as its features.

    With `mirrors` it is equivariant, see `Mirrored`.
    """

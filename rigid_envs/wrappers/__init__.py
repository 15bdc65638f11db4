"""Reward wrappers for single environments; those in `vector` wrap vector environments."""

from rigid_envs.wrappers import vector
from rigid_envs.wrappers.potential import goal_potential
from rigid_envs.wrappers.single import (
    ActionPenalty,
    BoundReward,
    PotentialShaping,
    ScaleReward,
    SmoothnessPenalty,
    StagedReward,
    SuccessBonus,
    TimePenalty,
)
from rigid_envs.wrappers.staged import Stage

__all__ = [
    "ActionPenalty",
    "BoundReward",
    "PotentialShaping",
    "ScaleReward",
    "SmoothnessPenalty",
    "Stage",
    "StagedReward",
    "SuccessBonus",
    "TimePenalty",
    "goal_potential",
    "vector",
]

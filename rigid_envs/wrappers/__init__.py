"""Reward wrappers: of single environments here, of vector environments in `vector`, same names."""

from rigid_envs.wrappers import vector
from rigid_envs.wrappers.potential import goal_potential
from rigid_envs.wrappers.single import (
    ActionPenalty,
    ClipReward,
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
    "ClipReward",
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

"""Stable-Baselines3's class for each algorithm."""

from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm

ALGORITHM_CLASSES: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC}

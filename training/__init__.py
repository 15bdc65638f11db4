"""Stable-Baselines3 on the environments: adapter, training, evaluation, film and plots."""

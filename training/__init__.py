"""Training with Stable-Baselines3: adapter, training, evaluation, video, plots, command line."""

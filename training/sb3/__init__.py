"""Training with Stable-Baselines3: adapter, callbacks, checkpoints."""

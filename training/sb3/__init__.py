"""The Stable-Baselines3 adapter: training, callbacks, checkpoints."""

"""Run folders: what a training run writes, and where."""

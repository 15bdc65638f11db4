"""Run folders: the files that a training run writes, and where."""

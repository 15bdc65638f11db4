"""Episodes of a task: starts, steps, rewards, randomisation and saved states."""

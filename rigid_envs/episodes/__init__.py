"""Episodes of a task in many worlds, without Gymnasium."""

"""Settings of training runs, read from YAML and flags, and checked."""

"""Settings of training runs: read from YAML and command-line flags, and validated."""

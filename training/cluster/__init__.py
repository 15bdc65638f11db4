"""Runs and trials as tasks of a Ray cluster. Needs the extra `ray`."""

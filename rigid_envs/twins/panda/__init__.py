"""Twins of the environments of panda-gym (PyBullet)."""

"""Collision detection: which samples are near which surface, and where they touch it."""

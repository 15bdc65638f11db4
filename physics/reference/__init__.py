"""Scenes with known answers and their closed forms; tests and benchmarks share them."""

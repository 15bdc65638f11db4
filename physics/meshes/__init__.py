"""Algorithms on triangle meshes: mass properties, checks, depth peeling, distances, samples."""

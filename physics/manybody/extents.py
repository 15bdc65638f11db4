"""Bounds of solids, for the search of near pairs."""

import numpy as np

from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.mesh import Mesh
from physics.scene.particles import Particles
from physics.scene.shapes import Box, Capsule, Shape
from physics.scene.torus import Torus

Array = np.ndarray


def half_extents(shape: Shape) -> Array:
    """[3] m, half extents of a box along the solid's axes, about its centre, that contains it."""
    if isinstance(shape, Box):
        return np.array(shape.half_extents)
    if isinstance(shape, Capsule):
        return np.array([shape.radius, shape.radius, shape.radius + shape.half_length])
    if isinstance(shape, Cylinder):
        return np.array([shape.radius, shape.radius, shape.half_length])
    if isinstance(shape, Torus):
        across = shape.major_radius + shape.minor_radius
        return np.array([across, across, shape.minor_radius])
    if isinstance(shape, Particles):
        return np.asarray(np.abs(shape.points).max(axis=0) + shape.radius)
    if isinstance(shape, Mesh):
        return np.asarray(np.abs(shape.triangles).max(axis=(0, 1)))
    if isinstance(shape, Compound) and shape.only is not None:
        return half_extents(shape.only)
    return np.full(3, shape.reach)

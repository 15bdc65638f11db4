"""Shapes as primitives: which of the renderer's kinds make up a shape, and where they stand."""

from functools import lru_cache
from typing import Any

import numpy as np

from physics import Box, Capsule, Compound, Cylinder, Mesh, Part, Sphere, Torus
from physics import Particles as ParticleShape
from physics.rotation import rotation_matrix
from rigid_envs.rendering.rays.intersections import BOX, CAPSULE, CYLINDER, SPHERE, TORUS, TRIANGLE
from rigid_envs.rendering.rays.tables import PRIMITIVE

Array = np.ndarray

GLOSS = 0.4  # strength of the highlight on round shapes
EDGE = 0.72  # brightness of a box's edges, as a share of its faces'


def primitives(count: int, kind: int, *, gloss: float = 0.0, edge: float = 1.0) -> Array:
    """[count] primitives of a kind, upright at the origin."""
    table = np.zeros(count, PRIMITIVE)
    table["kind"], table["axes"], table["solid"] = kind, np.eye(3), -1
    table["gloss"], table["edge"], table["opacity"] = gloss, edge, 1.0
    return table


def balls(positions: Array, radius: float | Array) -> Array:
    """Spheres at `positions` [n, 3] m, of a `radius` in m, or one for each [n]."""
    table = primitives(len(positions), SPHERE, gloss=GLOSS)
    table["position"], table["size"][:, 0], table["reach"] = positions, radius, radius
    return table


@lru_cache(maxsize=256)
def shape_primitives(shape: Any) -> Array:
    """The primitives [n] of a shape, in its frame.

    Raises:
        TypeError: the renderer doesn't know such a shape.
    """
    if isinstance(shape, Sphere):
        return balls(np.zeros((1, 3)), shape.radius)
    if isinstance(shape, ParticleShape):
        return balls(np.array(shape.points), shape.radius)
    if isinstance(shape, Mesh):
        return _triangles(shape.triangles)
    if isinstance(shape, Compound):
        return np.concatenate([_part(part) for part in shape.parts if isinstance(part, Part)])
    if isinstance(shape, Box):
        table = primitives(1, BOX, edge=EDGE)
        table["size"] = shape.half_extents
    elif isinstance(shape, Capsule):
        table = primitives(1, CAPSULE, gloss=GLOSS)
        table["size"] = shape.radius, shape.half_length, 0.0
    elif isinstance(shape, Cylinder):
        table = primitives(1, CYLINDER, gloss=GLOSS)
        table["size"] = shape.radius, shape.half_length, 0.0
    elif isinstance(shape, Torus):
        table = primitives(1, TORUS, gloss=GLOSS)
        table["size"] = shape.major_radius, shape.minor_radius, 0.0
    else:
        raise TypeError(
            "shape must be a Sphere, Box, Capsule, Cylinder, Torus, Mesh, Particles or Compound to "
            f"be drawn, got {type(shape).__name__}"
        )
    table["reach"] = shape.reach
    return table


def placed(local: Array, position: Array, turn: Array, size: Array | float = 1.0) -> Array:
    """Primitives [n] of solids' frames at the solids' poses.

    Args:
        local: [n], of PRIMITIVE.
        position: [..., n or 1, 3] m, of the solid of each.
        turn: [..., n or 1, 3, 3], rotation matrices.
        size: [..., n or 1], by which the solid is larger than its shape.

    Returns:
        [..., n].
    """
    table = np.empty((*position.shape[:-2], len(local)), PRIMITIVE)
    table[...] = local
    factor = np.asarray(size)[..., None]
    offset = (turn @ local["position"][:, :, None])[..., 0]
    table["position"] = position + factor * offset
    table["axes"] = local["axes"] @ np.swapaxes(turn, -1, -2)
    table["size"] *= factor
    table["reach"] *= factor[..., 0]
    return table


def _part(part: Part) -> Array:
    place, turn = np.array(part.position), rotation_matrix(np.array(part.orientation))
    return placed(shape_primitives(part.shape), place[None], turn[None])


def _triangles(corners: Array) -> Array:
    """Triangles [m, 3, 3] m, whose frames stand on the middle of their longest side, along x."""
    sides = np.roll(corners, -1, axis=1) - corners
    first = np.argmax((sides**2).sum(-1), axis=1)
    rows = np.arange(len(corners))
    start, end, tip = (corners[rows, (first + k) % 3] for k in range(3))
    length = np.linalg.norm(end - start, axis=1)
    x = (end - start) / length[:, None]
    z = np.cross(end - start, tip - start)
    z /= np.linalg.norm(z, axis=1)[:, None]
    y = np.cross(z, x)
    middle = 0.5 * (start + end)
    table = primitives(len(corners), TRIANGLE)
    table["position"], table["axes"] = middle, np.stack([x, y, z], axis=1)
    b, c = ((tip - middle) * x).sum(1), ((tip - middle) * y).sum(1)
    table["size"] = np.stack([0.5 * length, b, c], axis=1)
    table["reach"] = np.maximum(0.5 * length, np.hypot(b, c))
    return table

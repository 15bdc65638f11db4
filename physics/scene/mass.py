"""Mass, centre of mass and inertia of particles, simple solids and compounds.

Inertia tensors are [3, 3] in kg m^2, about the centre of mass unless a docstring says otherwise.
Source: second lecture, "Mass and Inertia Tensor". Two of its formulas are extended here. In a
compound the offsets of the parts are relative to the common centre of mass, and each part's tensor
is rotated into the common frame. Point particles on a line have a singular tensor, so particles can
have a radius, which adds the inertia of a solid sphere to each particle.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

Array = np.ndarray


class MassProperties(NamedTuple):
    """Mass [kg], centre of mass [3] in m, inertia [3, 3] in kg m^2 about that centre."""

    mass: float
    center: Array
    inertia: Array


def parallel_axis(inertia: Array, mass: float, offset: Array) -> Array:
    """Inertia [3, 3] about a point `offset` [3] away from the centre of mass (Steiner)."""
    r = np.asarray(offset, dtype=float)
    return np.asarray(inertia) + mass * (np.dot(r, r) * np.eye(3) - np.outer(r, r))


def of_particles(positions: Array, masses: Array, radius: float = 0.0) -> MassProperties:
    """Mass properties of particles.

    Args:
        positions: [n, 3] m.
        masses: [n] kg.
        radius: m; each particle is a solid sphere of this radius; 0 for points. The tensor of a
            single point, or of points on a line, is singular.
    """
    positions = np.asarray(positions, dtype=float)
    masses = np.asarray(masses, dtype=float)
    mass = float(masses.sum())
    center = masses @ positions / mass
    r = positions - center
    squares = np.einsum("n,nk,nk->", masses, r, r)
    inertia = squares * np.eye(3) - np.einsum("n,ni,nj->ij", masses, r, r)
    return MassProperties(mass, center, inertia + 0.4 * mass * radius**2 * np.eye(3))


def combine(
    parts: Sequence[MassProperties], rotations: Sequence[Array] | None = None
) -> MassProperties:
    """Mass properties of one body that consists of several parts.

    Args:
        parts: of each part; centres in the common frame, inertia in the part's frame.
        rotations: [3, 3] of each part, from the part's frame to the common frame; identity if None.
    """
    mass = sum(part.mass for part in parts)
    center = sum((part.mass * np.asarray(part.center) for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for i, part in enumerate(parts):
        own = part.inertia if rotations is None else rotations[i] @ part.inertia @ rotations[i].T
        inertia += parallel_axis(own, part.mass, part.center - center)
    return MassProperties(mass, center, inertia)


def sphere_inertia(mass: float | Array, radius: float) -> Array:
    """Principal moments [..., 3] in kg m^2 of a solid sphere of mass [...] in kg: 2/5 m r^2."""
    return np.multiply.outer(0.4 * mass * radius**2, np.ones(3))


def box_inertia(mass: float | Array, half_extents: Array) -> Array:
    """Principal moments [..., 3] in kg m^2 of a solid box of mass [...] in kg.

    About x: m/3 (b^2 + c^2), with the half extents a, b, c in m; likewise about y and z.
    """
    a, b, c = np.square(half_extents)
    return np.multiply.outer(mass / 3.0, np.array([b + c, a + c, a + b]))


def capsule_inertia(mass: float | Array, radius: float, half_length: float) -> Array:
    """Principal moments [..., 3] in kg m^2 of a solid capsule of mass [...] in kg along z.

    The sum of a cylinder of length 2 l and two half spheres. The centre of mass of each half sphere
    lies 3/8 r beyond the end of the cylinder.
    """
    r, half = radius, half_length
    cylinder = 2.0 * half * r**2
    caps = 4.0 / 3.0 * r**3
    cylinder_mass = mass * cylinder / (cylinder + caps)
    cap_mass = mass * caps / (cylinder + caps)
    axial = 0.5 * cylinder_mass * r**2 + 0.4 * cap_mass * r**2
    transverse = cylinder_mass * (r**2 / 4.0 + half**2 / 3.0) + cap_mass * (
        0.4 * r**2 + half**2 + 0.75 * half * r
    )
    return np.stack([transverse, transverse, axial], axis=-1)


def cylinder_inertia(mass: float | Array, radius: float, half_length: float) -> Array:
    """Principal moments [..., 3] in kg m^2 of a solid cylinder of mass [...] in kg along z.

    m r^2 / 2 about its axis, m (r^2 / 4 + l^2 / 3) across it, l the half length.
    """
    transverse = radius**2 / 4.0 + half_length**2 / 3.0
    return np.multiply.outer(mass, np.array([transverse, transverse, 0.5 * radius**2]))


def torus_inertia(mass: float | Array, major_radius: float, minor_radius: float) -> Array:
    """Principal moments [..., 3] in kg m^2 of a solid torus of mass [...] in kg about z.

    m (R^2 + 3/4 a^2) about its axis, m (R^2 / 2 + 5/8 a^2) across it, R and a its radii.
    """
    R, a = major_radius**2, minor_radius**2
    transverse = R / 2.0 + 5.0 / 8.0 * a
    return np.multiply.outer(mass, np.array([transverse, transverse, R + 3.0 / 4.0 * a]))

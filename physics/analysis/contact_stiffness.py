"""How contacts share the mass and the grip of their bodies, as the stability limit needs it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from physics.model.tangential import grip_of

Array = np.ndarray


def mass_parts(ends: Array, normal: Array, weight: Array, inverse_mass: Array) -> Array:
    """Into how many parts `spring.mass_splitting` splits the mass of each contact.

    Args:
        ends: [n, 2] owner and surface of each contact; beyond the bodies they don't move.
        normal: [n, 3].
        weight: [n].
        inverse_mass: [bodies] 1/kg.

    Returns:
        [n] mean of n of its two bodies, with their inverse masses as weights.
    """
    if not len(ends):
        return np.ones(0)
    pairs, pair = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    pair = pair.reshape(-1)
    sign = np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0)
    sums = np.zeros((len(pairs), 3))
    np.add.at(sums, pair, (sign * weight)[:, None] * normal)
    size = np.linalg.norm(sums, axis=1, keepdims=True)
    direction = sums / np.where(size > 0.0, size, 1.0)
    # a last row for all that doesn't move
    bodies = len(inverse_mass)
    inverse_mass, index = np.append(inverse_mass, 0.0), np.minimum(pairs, bodies)
    tensors = np.zeros((bodies + 1, 3, 3))
    outer = direction[:, :, None] * direction[:, None, :]
    for end in index.T:
        np.add.at(tensors, end, outer)
    along = np.einsum("ni,neij,nj->ne", direction, tensors[index], direction)
    inverse = inverse_mass[index]
    split = np.sum(np.maximum(along, 1.0) * inverse, axis=1) / np.sum(inverse, axis=1)
    return split[pair]


def grips(ends: Array, weight: Array, rows: Sequence[Any], bodies: int) -> Array:
    """By how much `spring.mass_splitting` reduces the damping of friction at each contact.

    Args:
        ends: [n, 2] owner and surface of each contact; beyond the bodies they don't move.
        weight: [n].
        rows: [n] of HALF_PAIR.
        bodies: number of bodies.

    Returns:
        [n] factors; of a body that touches others with a part of a face only, too large.
    """
    loads = np.array([[row["owner_shear_load"], row["surface_shear_load"]] for row in rows])
    index, sums = np.minimum(ends, bodies), np.zeros(bodies + 1)
    np.add.at(sums, index, weight[:, None] * loads.reshape(-1, 2))
    sums[bodies] = 0.0
    largest = sums[index].max(axis=1, initial=0.0)
    return np.array(
        [grip_of(load, row["spring_part"]) for load, row in zip(largest, rows, strict=True)]
    )

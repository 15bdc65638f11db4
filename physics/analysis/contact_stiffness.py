"""Stiffness of a world's contacts and its mass matrix, as the stability limit needs them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from physics.analysis.diagnostics import report
from physics.model.features import Features
from physics.model.rocking import point_jacobian
from physics.model.state import State
from physics.model.tables import Model
from physics.model.tangential import grip_of
from physics.rotation import rotation_matrix

Array = np.ndarray


def unit_stiffness(
    model: Model, features: Features, state: State, world: int
) -> dict[int, tuple[Array, Array, Array, float, float]]:
    """Unit stiffness of a world's present contacts, by half-pair.

    Returns:
        For each half-pair in contact three matrices [6 m, 6 m]: along the normals, across them, and
        against relative rotation. Coordinates are the displacement and the rotation vector of each
        dynamic body, in the world frame. And what `mass_parts` and `grips` give.
    """
    touching = report(model, features, state, world)
    model = model.of_world(world)
    dynamic_count = len(model.dynamic)
    found: dict[int, tuple[Array, Array, Array, float, float]] = {}
    rows = model.half_pair[touching.half_pair]
    ends = np.stack([rows["owner"], rows["surface"]], axis=-1)
    parts = mass_parts(ends, touching.normal, touching.weight, model.dynamic["inverse_mass"])
    grip = grips(ends, touching.weight, list(rows), dynamic_count)
    for k, point, normal, weight, part, held in zip(
        touching.half_pair, touching.point, touching.normal, touching.weight, parts, grip,
        strict=True,
    ):  # fmt: skip
        constants = model.half_pair[k]
        jacobian, rotation = np.zeros((2, 3, 6 * dynamic_count))
        for solid, sign in ((constants["owner"], 1.0), (constants["surface"], -1.0)):
            if solid < dynamic_count:
                arm = point - state.dynamic["position"][world, solid]
                columns = slice(6 * solid, 6 * solid + 6)
                jacobian[:, columns] = sign * point_jacobian(arm)
                rotation[:, 6 * solid + 3 : 6 * solid + 6] = sign * np.eye(3)
        along = jacobian.T @ np.outer(normal, normal) @ jacobian
        across = jacobian.T @ jacobian - along
        along_k, across_k, turn_k, *_ = found.get(int(k), (0.0, 0.0, 0.0, 1.0, 1.0))
        turn = turn_k + weight * rotation.T @ rotation
        sums = along_k + weight * along, across_k + weight * across, turn
        found[int(k)] = (*sums, float(part), float(held))
    return found


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


def inverse_masses(model: Model, state: State, world: int) -> Array:
    """Inverse mass matrix [6 m, 6 m] in the coordinates of `unit_stiffness`."""
    dynamic_count = len(model.dynamic)
    M = np.zeros((6 * dynamic_count, 6 * dynamic_count))
    turn = rotation_matrix(state.dynamic["orientation"][world])
    inertia = np.einsum("mij,mj,mkj->mik", turn, model.dynamic["inverse_inertia"], turn)
    for i in range(dynamic_count):
        M[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = model.dynamic["inverse_mass"][i] * np.eye(3)
        M[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = inertia[i]
    return M

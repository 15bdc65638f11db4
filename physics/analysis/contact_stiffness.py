"""Stiffness of a world's contacts and its mass matrix, as the stability limit needs them."""

import numpy as np

from physics.analysis.diagnostics import report
from physics.model.features import Features
from physics.model.rocking import point_jacobian
from physics.model.state import State
from physics.model.tables import Model
from physics.rotation import rotation_matrix

Array = np.ndarray


def unit_stiffness(
    model: Model, features: Features, state: State, world: int
) -> dict[int, tuple[Array, Array, Array]]:
    """Unit stiffness of a world's present contacts, by half-pair.

    Returns:
        For each half-pair in contact three matrices [6 m, 6 m]: along the normals, across them, and
        against relative rotation. Coordinates are the displacement and the rotation vector of each
        dynamic body, in the world frame.
    """
    touching = report(model, features, state, world)
    model = model.of_world(world)
    dynamic_count = len(model.dynamic)
    found: dict[int, tuple[Array, Array, Array]] = {}
    for k, point, normal, weight in zip(
        touching.half_pair, touching.point, touching.normal, touching.weight, strict=True
    ):
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
        along_k, across_k, turn_k = found.get(int(k), (0.0, 0.0, 0.0))
        turn = weight * rotation.T @ rotation
        found[int(k)] = (along_k + weight * along, across_k + weight * across, turn_k + turn)
    return found


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

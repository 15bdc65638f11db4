"""How a body that lies flat on one of its sides shares out the stiffness of a contact."""

import numpy as np

from physics.scene.shapes import Shape

Array = np.ndarray


def point_jacobian(arm: Array) -> Array:
    """[3, 6]: how a point at `arm` [3] m from the centre moves with displacement and rotation."""
    x, y, z = arm
    return np.array(
        [[1.0, 0.0, 0.0, 0.0, z, -y], [0.0, 1.0, 0.0, -z, 0.0, x], [0.0, 0.0, 1.0, y, -x, 0.0]]
    )


def landings(shape: Shape, spacing: float) -> list[tuple[Array, Array]]:
    """Shares [6, 6] of unit stiffness along and across the normal, on each of the six sides."""
    positions, weights, radius = shape.samples(spacing, 0.0)
    radii = np.broadcast_to(radius, len(weights))
    found = []
    for normal in (*np.eye(3), *-np.eye(3)):
        height = positions @ normal - radii
        lowest = height <= height.min() + 1e-9
        along, across = np.zeros((6, 6)), np.zeros((6, 6))
        for k in np.flatnonzero(lowest):
            jacobian, weight = point_jacobian(positions[k] - radii[k] * normal), weights[k]
            pressed = jacobian.T @ np.outer(normal, normal) @ jacobian
            along += weight * pressed
            across += weight * (jacobian.T @ jacobian - pressed)
        found.append((along, across))
    return found


def fastest(shape: Shape, spacing: float) -> tuple[float, float]:
    """Stiffness by mass of the fastest mode along and across the normal, against mere bobbing."""
    inverse = np.diag([1.0] * 3 + list(1.0 / shape.inertia(1.0)))
    along, across = 1.0, 1.0
    for n, t in landings(shape, spacing):
        along = max(along, float(np.linalg.eigvals(inverse @ n).real.max()))
        across = max(across, float(np.linalg.eigvals(inverse @ t).real.max()))
    return along, across

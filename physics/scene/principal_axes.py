"""Principal axes of inertia: the axes of a body's frame must be along them."""

import math
from itertools import permutations, product

import numpy as np

Array = np.ndarray

# largest product of inertia of principal axes, as a fraction of the tensor's trace
_ASKEW = 1e-9


def check_principal_axes(field: str, items: str, tensor: Array) -> None:
    """Raises ValueError unless an inertia tensor [3, 3], in m^2 per kg, is diagonal.

    The message names the `field`, and gives the rotation of its `items` that would be right.
    """
    askew = tensor - np.diag(np.diag(tensor))
    if np.abs(askew).max() > _ASKEW * np.trace(tensor):
        i, j = np.unravel_index(np.abs(askew).argmax(), (3, 3))
        raise ValueError(
            f"{field} must have their principal axes along x, y and z, got a product of "
            f"inertia J_{'xyz'[i]}{'xyz'[j]} of {askew[i, j]:.3g} kg m^2 per kg: rotate all "
            f"{items} by the quaternion {_to_axes(tensor)}"
        )


def _to_axes(tensor: Array) -> tuple[float, ...]:
    """Quaternion of the smallest rotation that aligns the principal axes with x, y and z."""
    axes = np.linalg.eigh(tensor)[1].T
    rotations = [
        axes[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    R = max((matrix for matrix in rotations if np.linalg.det(matrix) > 0.0), key=np.trace)
    w = 0.5 * math.sqrt(max(1.0 + np.trace(R), 0.0))
    x, y, z = (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    return tuple(round(float(c), 15) for c in (x / (4 * w), y / (4 * w), z / (4 * w), w))

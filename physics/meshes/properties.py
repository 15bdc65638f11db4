"""Volume, centre of mass and inertia of a closed mesh, exact for its triangles.

By the divergence theorem the integral of a polynomial over the solid is a sum over its triangles:
each spans a signed tetrahedron with a fixed point. With corners a, b, c relative to that point,
s = a + b + c and D = a . (b x c), a tetrahedron has the volume D / 6, the first moment D s / 24
and the second moment D (s s^T + a a^T + b b^T + c c^T) / 120.
"""

from itertools import permutations
from typing import NamedTuple

import numpy as np

Array = np.ndarray

# difference of two principal moments, over their sum, below which they count as equal
_SAME = 1e-12
# decimals of principal moments over their sum; equal ones become bitwise equal
_DECIMALS = 13
# rotation in rad below which it is round-off
_ROUND_OFF = 1e-9


class Properties(NamedTuple):
    """Of a homogeneous solid.

    Attributes:
        volume: m^3; negative if the faces wind clockwise as seen from outside.
        centre: [3] m, centre of mass.
        tensor: [3, 3] m^2, inertia about that centre per kg.
    """

    volume: float
    centre: Array
    tensor: Array


def properties(vertices: Array, faces: Array) -> Properties:
    """Properties of a closed mesh of vertices [n, 3] m and faces [m, 3]."""
    # relative to the middle: products of large coordinates would cancel
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    a, b, c = np.moveaxis(vertices[faces] - middle, 1, 0)
    s = a + b + c
    D = np.einsum("mi,mi->m", a, np.cross(b, c))
    volume = float(D.sum()) / 6.0
    if volume == 0.0:
        return Properties(0.0, middle, np.zeros((3, 3)))
    centre = D @ s / (24.0 * volume)
    squares = sum(np.einsum("m,mi,mj->ij", D, x, x) for x in (s, a, b, c)) / (120.0 * volume)
    squares = squares - np.outer(centre, centre)
    return Properties(volume, middle + centre, np.trace(squares) * np.eye(3) - squares)


def principal_axes(tensor: Array) -> tuple[Array, Array]:
    """Principal moments [3] and rotation [3, 3] from principal axes to the tensor's frame.

    Of all orders and signs of the axes the rotation is the smallest. Where moments are equal, and
    the axes arbitrary, it is the smallest too, so a mesh along its own axes is not rotated.
    """
    moments, axes = np.linalg.eigh(tensor)
    same = _SAME * moments.sum()
    best, largest = np.eye(3), -np.inf
    order_of_best: tuple[int, ...] = (0, 1, 2)
    for order in permutations(range(3)):  # order[k]: the moment about axis k
        rotation = np.empty((3, 3))
        for k in range(3):
            alike = [j for j in range(3) if abs(moments[order[j]] - moments[order[k]]) <= same]
            span = axes[:, [order[j] for j in alike]]
            # the rotation within the span that is nearest to the coordinate axes
            left, _, right = np.linalg.svd(span[alike])
            rotation[:, k] = (span @ (left @ right).T)[:, alike.index(k)]
        if np.linalg.det(rotation) < 0.0:
            weakest = int(np.argmin(np.diag(rotation)))
            rotation[:, weakest] = -rotation[:, weakest]
        if np.trace(rotation) > largest + _SAME:
            best, order_of_best, largest = rotation, order, np.trace(rotation)
    if np.abs(best - np.eye(3)).max() < _ROUND_OFF:
        best = np.eye(3)
    total = moments.sum()
    return np.round(moments[list(order_of_best)] / total, _DECIMALS) * total, best

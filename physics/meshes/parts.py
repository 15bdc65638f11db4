"""Parts of a mesh: closed surfaces without a common edge, and which of them are turned inside out.

The winding number of a point counts how many parts it is inside of: those whose faces wind
counterclockwise as seen from outside add 1, those turned inwards -1. A cavity is turned inwards and
lies inside another part, so the number is 0 in it. Below 0 there is a part without a solid around
it whose faces are turned inwards.

By the divergence theorem the number is the sum of the solid angles of all triangles over 4 pi. On a
triangle it is the mean of both sides, which differ by 1.

Source: A. Van Oosterom and J. Strackee, "The solid angle of a plane triangle" (1983).
"""

from typing import NamedTuple

import numpy as np

from physics.meshes.properties import properties

Array = np.ndarray

# faces of a part, the largest, at which it is tested
_PROBES = 32
# of a winding number: a face within another face has none
_UNKNOWN = 0.1


class Part(NamedTuple):
    """A closed part that is turned inwards outside of all others.

    Attributes:
        faces: number of them.
        volume: m^3, negative.
        low: [3] m, lower corner of its bounding box.
        high: [3] m.
        label: number of the part, see `labels`.
    """

    faces: int
    volume: float
    low: Array
    high: Array
    label: int


def labels(faces: Array) -> Array:
    """[m] number of the part that each face belongs to: faces joined by edges of two faces."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    key = ends.min(axis=1) * (int(faces.max()) + 1) + ends.max(axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.argsort(key, kind="stable")
    key, owner = key[order], owner[order]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    pairs = first[np.diff(np.r_[first, len(key)]) == 2]
    a, b = owner[pairs], owner[pairs + 1]
    label = np.arange(len(faces))
    while True:  # each face takes the least label of its neighbours, and of the face it names
        least = label.copy()
        np.minimum.at(least, a, label[b])
        np.minimum.at(least, b, label[a])
        np.minimum.at(least, label, least)
        least = least[least]
        if np.array_equal(least, label):
            return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1))
        label = least


def winding_outside(corners: Array, face: int) -> float:
    """Winding number in front of a face of triangles [m, 3, 3] m: an integer but for round-off."""
    a, b, c = np.moveaxis(np.delete(corners, face, axis=0) - corners[face].mean(axis=0), 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    above = np.einsum("mi,mi->m", a, np.cross(b, c))
    below = la * lb * lc
    below += np.einsum("mi,mi->m", a, b) * lc
    below += np.einsum("mi,mi->m", b, c) * la + np.einsum("mi,mi->m", c, a) * lb
    return float(2.0 * np.arctan2(above, below).sum() / (4.0 * np.pi)) - 0.5


def inverted_part(vertices: Array, faces: Array) -> Part | None:
    """The first part of a closed mesh that is turned inwards and no cavity; None without any."""
    label = labels(faces)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # signed volumes of the tetrahedra that the faces span with one vertex of their part
    own = np.unique(label, return_index=True)[1]
    reach = corners[:, 0] - corners[own[label], 0]
    volume = np.bincount(label, np.einsum("mi,mi->m", reach, across) / 6.0)
    if len(volume) == 1:
        return None
    area = np.linalg.norm(across, axis=1)
    for part in np.flatnonzero(volume < 0.0):
        mine = np.flatnonzero(label == part)
        for face in mine[np.argsort(-area[mine], kind="stable")[:_PROBES]]:
            outside = winding_outside(corners, int(face))
            if abs(outside - round(outside)) < _UNKNOWN and round(outside) < 0:
                points = corners[mine].reshape(-1, 3)
                size = properties(vertices, faces[mine]).volume
                return Part(len(mine), size, points.min(axis=0), points.max(axis=0), int(part))
    return None

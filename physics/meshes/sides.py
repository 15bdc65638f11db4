"""Sides on which a solid can lie, and the weights of its samples on them.

A side is a face of the convex hull of the samples: a plane that touches at least three of them and
has all others behind it. It is found by rolling: a plane touches the outermost sample along some
direction, turns about it until it touches a second, and about both until it touches a third.

The samples on a side share its load equally, or such that the weights of each side sum to 1 where
sides share samples, and no side has more. A sample that is alone supports all of the load: then a
solid with round sides sinks as deep as a ball.
"""

import numpy as np

from physics.directions import spread_directions

Array = np.ndarray

# directions that are rolled onto a side
_DIRECTIONS = 400
# blocks in which they are rolled, to save memory
_BLOCKS = 20
# times that weights are multiplied by what their sides lack
_ROUNDS = 100
# of a solid's reach, below which a height over a side is round-off
_SAME = 1e-6


def _first_touched(below: Array, along: Array, same: float) -> Array:
    """[d] index of the point that each of d turning planes touches first.

    Args:
        below: [d, n] m, depth of n points below each plane.
        along: [d, n] m, their distance from its pivot in the direction in which it turns down;
            points at most `same` m that way are never touched.
        same: m.
    """
    slope = np.where(along > same, np.maximum(below, 0.0) / np.maximum(along, same), np.inf)
    return np.asarray(np.argmin(slope, axis=1))


def _rolled(points: Array, normals: Array, same: float) -> Array:
    """Normals [d, 3] of the sides on which planes with normals [d, 3] come to lie."""
    rows = np.arange(len(normals))
    pivots = points[np.argmax(normals @ points.T, axis=1)]
    d = points - pivots[:, None]
    below = -np.einsum("dni,di->dn", d, normals)
    across = d + below[..., None] * normals[:, None]
    # the nearest point, whichever way the plane has to turn: their line is an edge of the hull
    second = _first_touched(below, np.sqrt(np.einsum("dni,dni->dn", across, across)), same)
    way, depth = across[rows, second], below[rows, second]
    length = np.maximum(np.einsum("di,di->d", way, way), same**2)
    turned = normals + (depth / length)[:, None] * way
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    edges = d[rows, second]
    edges /= np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), same)
    best, nearest = turned.copy(), np.full(len(normals), -np.inf)
    for sign in (1.0, -1.0):
        way = sign * np.cross(turned, edges)
        below, along = (np.einsum("dni,di->dn", d, x) for x in (-turned, way))
        third = _first_touched(below, along, same)
        depth, length = below[rows, third], along[rows, third]
        found = turned + (np.maximum(depth, 0.0) / np.maximum(length, same))[:, None] * way
        found /= np.linalg.norm(found, axis=1, keepdims=True)
        closeness = np.einsum("di,di->d", found, normals)
        better = (length > same) & (closeness > nearest)
        best[better], nearest[better] = found[better], closeness[better]
    return best


def sides(points: Array) -> Array:
    """Normals [k, 3] of the larger sides of samples at points [n, 3] m."""
    if len(points) < 3:
        return np.zeros((0, 3))
    same = _SAME * float(np.abs(points).max())
    blocks = np.array_split(spread_directions(_DIRECTIONS), _BLOCKS)
    normals = np.concatenate([_rolled(points, block, same) for block in blocks])
    alike = normals @ normals.T > 1.0 - _SAME
    return np.asarray(normals[np.unique(np.argmax(alike, axis=1))])


def touched_by(points: Array, normals: Array, tolerance: float) -> Array:
    """Mask [k, n] of the points within `tolerance` m of the outermost along each normal."""
    heights = normals @ points.T
    tolerance = max(tolerance, _SAME * float(np.abs(points).max(initial=0.0)))
    highest = heights.max(axis=1, initial=-np.inf, keepdims=True) if len(points) else heights
    return np.asarray(heights >= highest - tolerance)


def flat_sides(points: Array) -> Array:
    """Normals [k, 3] of the sides that more than three of the points touch: any plane has three."""
    normals = sides(points)
    return np.asarray(normals[touched_by(points, normals, 0.0).sum(axis=1) > 3])


def weights(points: Array, normals: Array, tolerance: float, others: Array | None = None) -> Array:
    """Weights [n] of samples, see the docstring of this module.

    Args:
        points: [n, 3] m.
        normals: [n, 3], outward normals where the samples are; used for those on no side, in
            hollows: they share their load with those in the same tangent plane.
        tolerance: m, height over a side of the samples that share its load.
        others: [k, 3] normals of more sides; None: those that are found by rolling suffice.
    """
    planes = sides(points) if others is None else np.concatenate([sides(points), others])
    touched = touched_by(points, planes, tolerance)
    touched = np.unique(touched, axis=0) if len(touched) else touched
    shared = np.where(touched, touched.sum(axis=1, keepdims=True), 0).max(axis=0, initial=0)
    tolerance = max(tolerance, _SAME * float(np.abs(points).max(initial=0.0)))
    for i in np.flatnonzero(shared == 0):
        height = (points - points[i]) @ normals[i]
        alike = normals @ normals[i] > 0.5 * np.linalg.norm(normals[i])
        shared[i] = max(1, np.count_nonzero((np.abs(height) <= tolerance) & alike))
    return _balanced(touched, 1.0 / shared)


def _balanced(touched: Array, found: Array) -> Array:
    """Weights [n] that sum to 1 on each side, or less where sides share too much of them.

    A sample on several sides begins with the least of its equal parts; all are then multiplied by
    what their sides lack, again and again (iterative proportional fitting).

    Args:
        touched: mask [k, n].
        found: [n] where to begin.
    """
    if not len(touched):
        return found
    member = touched.astype(float)
    sides_of = np.maximum(member.sum(axis=0), 1.0)
    for _ in range(_ROUNDS):
        lacks = np.log(member @ found)
        if np.abs(lacks).max() < _SAME:
            break
        found = found * np.exp(-(lacks @ member) / sides_of)
    most = np.where(touched, (member @ found)[:, None], 0.0).max(axis=0, initial=0.0)
    found = found / np.maximum(most, 1.0)
    own = touched & (touched.sum(axis=0) == 1)
    for side, mine in zip(touched, own, strict=True):  # what is on one side alone takes the rest
        if mine.any():
            found[mine] *= 1.0 + (1.0 - found[side].sum()) / found[mine].sum()
    return np.asarray(found)

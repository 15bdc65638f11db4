"""How early a body that stands tips, and how far a pull moves it: what soft contacts cost.

A rigid body tips over an edge of its base where a slope, or a pull at its centre over m g, exceeds
b / H: b is the distance of the edge from the centre, H the height of the centre. Contacts sink by
d = m g / k, with the stiffness k of the base, which costs in two ways. A row of samples at the
distance x_j from the centre has the part w_j of k.

Gradual load. When the body has tilted so far that rows 0 ... m-1 on the side of the edge press and
row m just lifts, at the tilt p, the load is

    m g = k p sum w_j (x_j - x_m),    so    p_m = d / sum w_j (x_j - x_m),

and acts at a_m = sum w_j (x_j - x_m) x_j / sum w_j (x_j - x_m). The tilt moves the centre by H p.
In between both change linearly, so the body tips at the largest (a_m - H p_m) / H.

Sudden load. A body that is set down without overlap falls into its sink. On the way to tipping the
edge alone carries it, with the part w_0 of the stiffness, and has taken up d m g / (2 w_0): as much
as the body falls by there less what the spring stores. At an angle D before that at which it tips,
the centre has to rise by R (1 - cos D), with its distance R from the edge. Without damping it tips
from

    D = sqrt(d / (w_0 R))

on. Damping makes it less, at e = 0 about 0.7 of it. D is proportional to the substep.

A pull f u m g at the centre that grows slowly (u: friction, f < 1) stretches the springs of
friction, of the stiffness k_t, and tilts the body. Together they give way by f S,

    S = u (m g / k_t + d H^2 / sum w_j x_j^2),

and more where a lightly pressed row slips before the others. A pull that comes at once goes beyond:
undamped, by energy, to 2 f S for f < 1/2. Above that the springs slip, which brakes the body with
(1 - f) u m g, and it moves by S / (2 (1 - f)) in all. At f > 1 it gains a speed of
sqrt((2 f - 1) u g S) before they slip, beyond the (f - 1) u g t of a rigid body.
"""

import math
from typing import NamedTuple

import numpy as np

from physics.model.rocking import facing
from physics.scene.shapes import Samples

Array = np.ndarray

# cosine of the angle from vertical within which the normal of a side makes it the base
_COSINE = 0.65
# of a length, below which it is round-off
_SAME = 1e-6


class Base(NamedTuple):
    """The side on which a body stands, in the direction in which it tips first.

    Attributes:
        height: m, of the centre.
        arms: [rows] m, distances of the rows of samples from the centre, the edge first.
        parts: [rows] of the stiffness.
    """

    height: float
    arms: Array
    parts: Array


class Tipping(NamedTuple):
    """Slopes in rad at which a body tips.

    Attributes:
        rigid: of contacts without sink, on the samples of its edge.
        gradual: if the load grows slowly.
        sudden: at least from there on if it is set down without overlap.
    """

    rigid: float
    gradual: float
    sudden: float


class Pull(NamedTuple):
    """What a pull at the centre does to a body that friction holds, or would hold.

    Attributes:
        gradual: m, displacement if it grows slowly and no row of samples slips; inf if it slides.
        sudden: m, the largest displacement if it comes at once.
        speed: m/s, the most that a body which slides has beyond a rigid one.
    """

    gradual: float
    sudden: float
    speed: float


def base(samples: Samples, normals: Array, down: Array) -> Base | None:
    """The base of a body, if it has one: a side with samples that span an area.

    Args:
        samples: of the body.
        normals: [n, 3] outward, of the sides on which it can lie.
        down: [3] direction of gravity in the body's frame.
    """
    k = int(np.argmax(normals @ down))
    normal = normals[k]
    if normal @ down < _COSINE:
        return None
    places, radii = facing(samples, normal), np.broadcast_to(samples.radius, len(samples.weights))
    heights = places @ normal + radii
    low = heights >= heights.max() - _SAME * float(np.abs(places).max())
    flat = places[low] @ np.linalg.svd(normal[None])[2][1:].T
    weights = samples.weights[low] / samples.weights[low].sum()
    found = []
    for outward in _farthest(flat) if samples.axial else _outward(flat):
        x = flat @ outward
        same = _SAME * float(np.ptp(x))
        arms, row = np.unique(np.round(x / same) * same, return_inverse=True)
        parts = np.bincount(row.ravel(), weights)
        found.append(Base(float(heights.max()), arms[::-1], parts[::-1]))
    return min(found, key=lambda one: float(one.arms[0]), default=None)


def _farthest(points: Array) -> list[Array]:
    """Direction [2] of the outermost point: samples that are axial turn to face a tilt."""
    far = points[np.argmax(np.hypot(*points.T))]
    length = math.hypot(*far)
    return [far / length] if length > 0.0 and len(_outward(points)) else []


def _outward(points: Array) -> list[Array]:
    """Outward normals [2] of the edges of the convex hull of points [n, 2]; none on a line."""
    order = points[np.lexsort((points[:, 1], points[:, 0]))]
    least = _SAME * float(np.ptp(points, axis=0).max(initial=0.0)) ** 2
    hull: list[Array] = []
    for half in (order, order[::-1]):
        chain: list[Array] = []
        for point in half:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= least:
                chain.pop()
            chain.append(point)
        hull += chain[:-1]
    if len(hull) < 3:
        return []
    along = np.roll(np.array(hull), -1, axis=0) - np.array(hull)
    return [np.array([y, -x]) / math.hypot(x, y) for x, y in along]


def _turn(a: Array, b: Array, c: Array) -> float:
    """Twice the area of a triangle, positive if it turns to the left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def tipping(stands: Base, sink: float) -> Tipping:
    """Where a body tips that sinks by `sink` m at rest, see above; negative: at no load at all."""
    height, arms, parts = stands
    reached = []
    for m in range(1, len(arms)):
        lever = parts[:m] * (arms[:m] - arms[m])
        reached.append((lever @ arms[:m] - height * sink) / lever.sum())
    rigid = math.atan2(float(arms[0]), height)
    gradual = math.atan2(float(max(reached)), height)
    early = math.sqrt(sink / (float(parts[0]) * math.hypot(float(arms[0]), height)))
    return Tipping(rigid, gradual, rigid - early)


def pull(
    stands: Base, sink: float, shear: float, friction: float, part: float, gravity: float
) -> Pull:
    """What a pull of `part` mu m g does, see above.

    Args:
        stands: the base of the body.
        sink: m, at rest.
        shear: m, m g over the stiffness of the springs of friction.
        friction: mu.
        part: above 0.
        gravity: m/s^2.
    """
    height, arms, parts = stands
    gives = friction * (shear + sink * height**2 / float(parts @ arms**2))
    if part >= 1.0:
        speed = math.sqrt((2.0 * part - 1.0) * friction * gravity * gives)
        return Pull(math.inf, math.inf, speed)
    return Pull(part * gives, gives * (2.0 * part if part < 0.5 else 0.5 / (1.0 - part)), 0.0)

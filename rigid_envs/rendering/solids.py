"""Solids: what a painter must know of them, their corners, silhouettes and order."""

from collections.abc import Sequence

import numpy as np

from physics import Cylinder
from physics.rotation import rotation_matrix
from rigid_envs.rendering.view import TO_LIGHT, Goal, Item

Array = np.ndarray

LIGHT_SIZE = 0.06  # half-width over distance: shadows are sharp at contacts and soft from above
SHADOW_SAMPLES = 10  # points of the light that cast a shadow each

_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_ROUND_TRIP = (0, 1, 3, 2, 6, 7, 5, 4)  # along edges past all corners; in it each face is in order
# axis, side and corners of a box's faces
FACES = [
    (axis, side, [k for k in _ROUND_TRIP if _SIGNS[k, axis] == side])
    for axis in range(3)
    for side in (-1, 1)
]
_TURN = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=-1)
ACROSS_LIGHT = np.linalg.svd(TO_LIGHT[None])[2][1:]  # [2, 3], unit vectors normal to the light
# the light's points lie on a sunflower's spiral, which covers a disc evenly
_SPIRAL = [
    np.sqrt((k + 0.5) / SHADOW_SAMPLES) * np.array([np.cos(2.4 * k), np.sin(2.4 * k)])
    for k in range(SHADOW_SAMPLES)
]
LIGHTS = TO_LIGHT + LIGHT_SIZE * np.array(_SPIRAL) @ ACROSS_LIGHT  # [samples, 3]


def box_corners(centre: Array, axes: Array, half: Array) -> Array:
    """Corners [..., 8, 3] of boxes: centres [..., 3], columns of axes [..., 3, 3], half extents."""
    spokes = np.einsum("...ij,kj,...j->...ki", axes, _SIGNS, half)
    return np.asarray(centre[..., None, :] + spokes)


class Solids:
    """Items, and after them the balls of goals, as rounded boxes.

    Attributes:
        centre: [n, 3] m.
        axes: [n, 3, 3], columns are the body's axes in the world.
        half: [n, 3] m, half extents of the core; zero for a ball, along z for a capsule; of a
            cylinder those of the box around it.
        radius: [n] m, by which the core is rounded; zero for a box or cylinder.
        cylinder: [n], whether the core is round about z.
        corners: [n, 8, 3] m, of the core, in the order of `_SIGNS`.
    """

    def __init__(self, items: Sequence[Item], balls: Sequence[Goal]) -> None:
        count = len(items) + len(balls)
        centres = [item.position for item in items] + [ball.position for ball in balls]
        turns = [item.orientation for item in items] + [np.array([0.0, 0.0, 0.0, 1.0])] * len(balls)
        self.centre = np.array(centres).reshape(count, 3)
        self.axes = rotation_matrix(np.array(turns).reshape(count, 4))
        self.half, self.radius = np.zeros((count, 3)), np.zeros(count)
        self.cylinder = np.zeros(count, dtype=bool)
        for i, item in enumerate(items):
            self.half[i] = getattr(item.shape, "half_extents", 0.0)
            self.half[i, 2] += getattr(item.shape, "half_length", 0.0)
            radius = getattr(item.shape, "radius", 0.0)
            if isinstance(item.shape, Cylinder):
                self.half[i, :2], self.cylinder[i] = radius, True
            else:
                self.radius[i] = radius
        self.radius[len(items) :] = [min(ball.radius, ball.position[2]) for ball in balls]
        self.corners = box_corners(self.centre, self.axes, self.half)

    def outlines(self, across: Array, count: int) -> tuple[Array, list[int]]:
        """Silhouettes of the first solids as seen along the normal of `across` [2, 3].

        Each point is the solid's furthest one in a direction of the plane, and stands once, so that
        a box has as many as its silhouette has corners.

        Args:
            across: two unit vectors.
            count: how many solids.

        Returns:
            Points [m, 3] m of all silhouettes in turn, and where each ends in them.
        """
        axes, half, radius = self.axes[:count], self.half[:count], self.radius[:count]
        ways = CIRCLE @ across
        local = np.einsum("kj,nji->nki", ways, axes)
        signs, round_ = np.sign(local), self.cylinder[:count]
        across_z = np.maximum(np.linalg.norm(local[round_, :, :2], axis=2, keepdims=True), 1e-9)
        signs[round_, :, :2] = local[round_, :, :2] / across_z
        core = np.einsum("nij,nkj,nj->nki", axes, signs, half)
        points = self.centre[:count, None] + core + radius[:, None, None] * ways
        smooth = (radius > 0.0) | round_
        kept = (signs != np.roll(signs, 1, axis=1)).any(axis=2) | smooth[:, None]
        return points[kept], np.cumsum(kept.sum(axis=1)).tolist()

    def in_front(self, pairs: Array, eye: Array) -> Array:
        """Whether the first of each of the `pairs` [k, 2] can hide the second from `eye` [3] m.

        Two convex solids apart have a plane between them, and only the one on the eye's side can
        hide the other; an order by distance fails for a small solid beside a large one. The plane
        is sought across the face normals and the shortest ways from a centre to the other's core.
        Touching solids overlap a little, so the plane of least overlap decides.
        """
        a, b = pairs.T
        between = self.centre[a] - self.centre[b]
        ways = np.empty((len(pairs), 8, 3))
        ways[:, 0:3] = self.axes[a].swapaxes(1, 2)
        ways[:, 3:6] = self.axes[b].swapaxes(1, 2)
        for k, i, sight in ((6, a, -between), (7, b, between)):
            local = np.einsum("kj,kji->ki", sight, self.axes[i])
            beyond = local - np.clip(local, -self.half[i], self.half[i])
            ways[:, k] = np.einsum("kij,kj->ki", self.axes[i], beyond)
        length = np.sqrt(np.einsum("kwi,kwi->kw", ways, ways))
        unit = ways / np.maximum(length, 1e-9)[..., None]
        apart = np.einsum("kwi,ki->kw", unit, between)
        unit *= np.where(apart < 0.0, -1.0, 1.0)[..., None]  # from b to a

        def reach(i: Array) -> Array:
            across = np.abs(np.einsum("kwi,kij->kwj", unit, self.axes[i]))
            return np.einsum("kwj,kj->kw", across, self.half[i]) + self.radius[i, None]

        reach_b = reach(b)
        gap = np.abs(apart) - reach(a) - reach_b
        gap[length < 1e-9] = -np.inf
        best = np.arange(len(pairs)), gap.argmax(axis=1)
        ahead = np.einsum("ki,ki->k", unit[best], eye - self.centre[b])
        return np.asarray(ahead > reach_b[best] + 0.5 * gap[best])

    def paint_order(self, eye: Array) -> list[int]:
        """All indices, each after those of the solids that it can hide from `eye` [3] m."""
        sight = self.centre - eye
        distance = np.linalg.norm(sight, axis=1)
        sight /= distance[:, None]
        size = 1.2 * (np.linalg.norm(self.half, axis=1) + self.radius) / distance  # rad, generous
        meet = np.linalg.norm(sight[:, None] - sight, axis=2) < size[:, None] + size
        pairs = np.argwhere(np.triu(meet, 1))
        behind: list[set[int]] = [set() for _ in distance]
        for (a, b), first in zip(pairs.tolist(), self.in_front(pairs, eye).tolist(), strict=True):
            behind[a if first else b].add(b if first else a)
        order: list[int] = []
        waiting: list[int] = np.argsort(-distance).tolist()
        while waiting:  # a ring of solids, possible but rare, is cut where the fewest lie behind
            free = min(waiting, key=lambda i: len(behind[i]))
            order.append(free)
            waiting.remove(free)
            for others in behind:
                others.discard(free)
        return order

"""Meshes generated in code, for tests, measurements and the documentation.

Each function returns vertices [n, 3] in m and faces [m, 3], counterclockwise as seen from outside.
"""

from collections.abc import Callable

import numpy as np

Array = np.ndarray
Triangles = tuple[Array, Array]


def cuboid(half_extents: tuple[float, float, float]) -> Triangles:
    """A box of half extents in m; two triangles per face."""
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    return signs * np.array(half_extents), np.array(faces)


def tube(rings: Array, closed: bool = False) -> Triangles:
    """The surface through rings [n, k, 3] m, each counterclockwise seen along the way.

    Args:
        rings: n closed curves of k points.
        closed: whether the last ring joins the first; otherwise both ends get a flat lid, which
            must be star-shaped about its mean.
    """
    n, k = rings.shape[:2]
    vertices = list(rings.reshape(-1, 3))
    faces = []
    for i in range(n if closed else n - 1):
        for j in range(k):
            a, b = i * k + j, i * k + (j + 1) % k
            c, d = (i + 1) % n * k + j, (i + 1) % n * k + (j + 1) % k
            faces += [(a, b, d), (a, d, c)]
    if not closed:
        for ring, first in ((rings[0], 0), (rings[-1], (n - 1) * k)):
            middle = len(vertices)
            vertices.append(ring.mean(axis=0))
            for j in range(k):
                a, b = first + j, first + (j + 1) % k
                faces.append((middle, b, a) if first == 0 else (middle, a, b))
    return np.array(vertices), np.array(faces)


def revolved(profile: Array, around: int) -> Triangles:
    """The solid that a polygon [n, 2] of radius and height in m, counterclockwise, sweeps around z.

    Points of radius 0 lie on the axis and become one vertex each.
    """
    angles = 2.0 * np.pi * np.arange(around) / around
    turn = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    vertices: list[Array] = []
    index = []
    for radius, height in profile:
        many = radius > 0.0
        index.append([len(vertices) + (j if many else 0) for j in range(around)])
        ring = [(radius * x, radius * y, height) for x, y in turn]
        vertices += [np.array(p) for p in (ring if many else ring[:1])]
    faces = []
    n = len(profile)
    for i in range(n):
        for j in range(around):
            a, b = index[i][j], index[i][(j + 1) % around]
            c, d = index[(i + 1) % n][j], index[(i + 1) % n][(j + 1) % around]
            faces += [t for t in ((a, b, d), (a, d, c)) if len(set(t)) == 3]
    return np.array(vertices), np.array(faces)


def _arc(radius: float, start: float, end: float, count: int, lift: float = 0.0) -> Array:
    """Points [count, 2] on a circle about (0, lift), at angles in rad from the radius axis."""
    angle = np.linspace(start, end, count)
    arc = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    arc[np.abs(arc[:, 0]) < 1e-12 * radius, 0] = 0.0
    return np.asarray(arc + np.array([0.0, lift]))


def ball(radius: float, around: int = 32) -> Triangles:
    """A sphere of a radius in m."""
    return revolved(_arc(radius, -0.5 * np.pi, 0.5 * np.pi, around // 2 + 1), around)


def hollow_ball(radius: float, inner: float, around: int = 48) -> Triangles:
    """A sphere with a spherical cavity; radii in m."""
    vertices, faces = ball(radius, around)
    cavity, back = ball(inner, around)
    return np.concatenate([vertices, cavity]), np.concatenate(
        [faces, back[:, ::-1] + len(vertices)]
    )


def torus(major: float, minor: float, around: int = 64, across: int = 24) -> Triangles:
    """A torus about z; radii in m of the circle and of the tube."""
    angle = 2.0 * np.pi * np.arange(across) / across
    profile = np.stack([major + minor * np.cos(angle), minor * np.sin(angle)], axis=-1)
    return revolved(profile, around)


def bowl(radius: float, inner: float, around: int = 48) -> Triangles:
    """Half of a hollow sphere, open upwards, with a flat foot; radii in m.

    The foot cuts the outer sphere at 80 % of its radius below the middle.
    """
    foot = np.arcsin(0.8)
    outside = _arc(radius, -foot, 0.0, around // 4 + 1)
    inside = _arc(inner, 0.0, -0.5 * np.pi, around // 4 + 1)
    middle = np.array([[0.0, -radius * np.sin(foot)]])
    return revolved(np.concatenate([outside, inside, middle]), around)


def knight(height: float = 0.06, around: int = 32, along: int = 60) -> Triangles:
    """A chess knight: a round foot, a neck, and a head that looks along x, with ears.

    A tube about a bent spine: closed, and concave below the muzzle.
    """
    # along the spine: x and z of its points, direction in degrees from z towards x, half width
    # across the plane of symmetry and in it
    table = np.array(
        [
            (0.00, 0.00, 0.0, 0.28, 0.28),
            (0.00, 0.04, 0.0, 0.28, 0.28),
            (0.00, 0.08, 0.0, 0.26, 0.26),
            (0.00, 0.12, 0.0, 0.20, 0.20),
            (0.00, 0.18, 0.0, 0.17, 0.17),
            (-0.01, 0.30, -5.0, 0.14, 0.17),
            (-0.03, 0.45, -8.0, 0.11, 0.17),
            (-0.04, 0.60, 0.0, 0.10, 0.16),
            (-0.02, 0.74, 30.0, 0.09, 0.15),
            (0.05, 0.84, 70.0, 0.09, 0.13),
            (0.15, 0.85, 105.0, 0.08, 0.11),
            (0.25, 0.80, 120.0, 0.07, 0.09),
            (0.34, 0.74, 122.0, 0.06, 0.08),
            (0.38, 0.715, 122.0, 0.05, 0.06),
        ]
    )
    t = np.linspace(0.0, len(table) - 1.0, along)
    x, z, lean, wide, deep = (np.interp(t, range(len(table)), c) for c in table.T)
    lean = np.radians(lean)
    angle = 2.0 * np.pi * np.arange(around) / around
    # the ears: two bumps on the back of the head's side
    crown = np.exp(-(((t - 8.5) / 0.35) ** 2))[:, None]
    ears = 1.0 + 0.5 * crown * np.maximum(
        0.0, np.cos(2.0 * (np.abs(np.pi - angle % (2 * np.pi)) - 0.6))
    )
    ears = np.where(np.cos(angle) < 0.0, ears, 1.0)
    u, v = deep[:, None] * np.cos(angle) * ears, wide[:, None] * np.sin(angle) * ears
    rings = np.stack(
        [
            x[:, None] + u * np.cos(lean)[:, None],
            v,
            z[:, None] - u * np.sin(lean)[:, None],
        ],
        axis=-1,
    )
    return tube(height * rings)


SHAPES: dict[str, Callable[[], Triangles]] = {
    "hollow ball": lambda: hollow_ball(0.05, 0.035),
    "torus": lambda: torus(0.04, 0.015),
    "bowl": lambda: bowl(0.05, 0.036),
    "knight": knight,
}

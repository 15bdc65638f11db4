"""Samples of a mesh: points of its surface at which it touches other solids.

They lie at convex corners, along convex edges, and on round areas. Flat areas have none inside, as
boxes have none on their faces: another solid touches there with its own samples. Concave edges have
none either, nor have hollow round areas: no plane reaches them.

An edge is sharp if its two faces differ by more than 30 degrees. Sharp edges form curves, which are
divided evenly. On round areas the point farthest from all samples becomes a sample, again and
again, until none is farther than spacing / sqrt(3): the corners of a triangle with sides `spacing`
are that far from its middle.

Each sample is a ball of the rounding radius r inside the surface, which it touches: its centre is
p - r m, where n . m = 1 for the normals n of all faces that meet at p.
"""

from collections import Counter, defaultdict
from itertools import product

import numpy as np

Array = np.ndarray

# cosine of the angle between two faces below which their edge is sharp: 30 degrees
_SHARP = np.cos(np.pi / 6.0)
# cosine above which two faces are in one plane
_FLAT = 1.0 - 1e-8
# longest m, see above: the apex of a cone could be anywhere
_LONGEST = 3.0
# points along a triangle's side per spacing, from which round areas choose their samples
_FINER = 2.0
# of a length, below which a difference is round-off
_SAME = 1e-6
# a cell of a grid and those around it
_AROUND = tuple(product((-1, 0, 1), repeat=3))


class _Edges:
    """Edges of a closed mesh, each with its two faces.

    Attributes:
        ends: [e, 2] vertices.
        faces: [e, 2].
        sharp: mask [e] of convex edges with more than 30 degrees between their faces.
        hollow: mask [e] of such concave edges.
        round: mask [e] of convex edges with less, but not within a plane.
    """

    def __init__(self, vertices: Array, faces: Array, normals: Array) -> None:
        directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        owner = np.tile(np.arange(len(faces)), 3)
        opposite = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
        forward = directed[:, 0] < directed[:, 1]
        # of an edge that several pairs of faces share, any pairing will do
        one = np.flatnonzero(forward)
        two = np.flatnonzero(~forward)
        one = one[np.lexsort(directed[one].T)]
        two = two[np.lexsort(directed[two][:, ::-1].T)]
        self.ends = directed[one]
        self.faces = np.stack([owner[one], owner[two]], axis=1)
        cosine = np.einsum("ei,ei->e", normals[owner[one]], normals[owner[two]])
        beyond = vertices[opposite[two]] - vertices[self.ends[:, 0]]
        convex = np.einsum("ei,ei->e", normals[owner[one]], beyond) < 0.0
        self.sharp = (cosine < _SHARP) & convex
        self.hollow = (cosine < _SHARP) & ~convex
        self.round = (cosine >= _SHARP) & (cosine <= _FLAT) & convex


def surface_points(
    vertices: Array, faces: Array, spacing: float, directions: Array
) -> tuple[Array, list[Array], list[bool]]:
    """Points [n, 3] m of the surface, of each the unit normals [k, 3] of its faces, and its kind.

    The kind is whether it is only the outermost vertex along one of the directions, see `support`:
    it is a sample if no other is nearly as far out.

    Args:
        vertices: [v, 3] m.
        faces: [f, 3], of a closed mesh.
        spacing: m.
        directions: [d, 3].
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    # a face without an area has no normal, and no part in what follows
    solid = area > 0.0
    normals = normals / np.where(solid, area, 1.0)[:, None]
    edges = _Edges(vertices, faces, normals)
    around: dict[int, list[int]] = defaultdict(list)
    for f in np.flatnonzero(solid):
        for v in faces[f]:
            around[int(v)].append(int(f))
    points: list[Array] = []
    touching: list[Array] = []
    # what is nearer than a cell is long is in the same cell or in one around it
    cells: dict[tuple[int, ...], list[Array]] = defaultdict(list)

    def add(point: Array, of_faces: Array, apart: float) -> None:
        i, j, k = (int(x) for x in np.floor(point / apart))
        near = [q for n in _AROUND for q in cells.get((i + n[0], j + n[1], k + n[2]), ())]
        if not near or np.min(np.sum((np.array(near) - point) ** 2, axis=1)) >= apart**2:
            cells[i, j, k].append(point)
            points.append(point)
            touching.append(normals[of_faces])

    curves, corner_vertices = _curves(vertices, edges)
    for v in corner_vertices:
        add(vertices[v], np.array(around[v]), 0.5 * spacing)
    for curve in curves:
        for point, vertex, edge in _along(vertices, curve, edges.ends, spacing):
            of_faces = np.array(around[vertex]) if vertex >= 0 else edges.faces[edge]
            add(point, of_faces, 0.5 * spacing)
    candidates, owners = _round_points(vertices, faces, edges, around, spacing)
    if len(candidates):
        apart = np.full(len(candidates), np.inf)
        for point in points:
            apart = np.minimum(apart, np.sum((candidates - point) ** 2, axis=1))
        while apart.max() > spacing**2 / 3.0:
            k = int(np.argmax(apart))
            points.append(candidates[k])
            touching.append(normals[owners[k]])
            apart = np.minimum(apart, np.sum((candidates - candidates[k]) ** 2, axis=1))
    chosen = len(points)
    for v in np.unique(np.argmax(vertices @ directions.T, axis=0)).tolist():
        points.append(vertices[v])
        touching.append(normals[np.array(around[v])])
    extra = [k >= chosen for k in range(len(points))]
    return np.array(points).reshape(-1, 3), touching, extra


def has_sharp_edges(vertices: Array, faces: Array) -> bool:
    """Whether a convex edge of a closed mesh is sharp."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(area > 0.0, area, 1.0)
    return bool(_Edges(vertices, faces, normals).sharp.any())


def inset(points: Array, touching: list[Array], radius: float) -> tuple[Array, Array]:
    """Centres [n, 3] m of balls inside the surface that touch it at points, and unit normals."""
    offsets = np.empty((len(points), 3))
    for k, normals in enumerate(touching):
        m = np.linalg.pinv(normals, rcond=1e-3) @ np.ones(len(normals))
        offsets[k] = m * min(1.0, _LONGEST / max(float(np.linalg.norm(m)), 1e-300))
    length = np.maximum(np.linalg.norm(offsets, axis=1, keepdims=True), 1e-300)
    return points - radius * offsets, offsets / length


def _curves(vertices: Array, edges: _Edges) -> tuple[list[list[tuple[int, int]]], list[int]]:
    """Curves of sharp edges as lists of (vertex, edge that follows), and the corners between them.

    A corner is a vertex with one or more than two sharp edges, or at which their curve bends by
    more than 30 degrees. The last entry of a curve has the edge -1.
    """
    at: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for e in np.flatnonzero(edges.sharp).tolist():
        a, b = (int(v) for v in edges.ends[e])
        at[a].append((b, e))
        at[b].append((a, e))

    def is_corner(v: int) -> bool:
        if len(at[v]) != 2:
            return True
        u, w = (vertices[b] - vertices[v] for b, _ in at[v])
        return bool(u @ w > -_SHARP * np.linalg.norm(u) * np.linalg.norm(w))

    corner = {v for v in list(at) if is_corner(v)}
    used: Counter[int] = Counter()
    curves = []
    # curves between corners first; what is left are loops without a corner
    for start in [*sorted(corner), *sorted(at)]:
        for _, first in at[start]:
            if used[first]:
                continue
            curve: list[tuple[int, int]] = []
            v, e = start, first
            while e >= 0:
                used[e] += 1
                curve.append((v, e))
                a, b = (int(x) for x in edges.ends[e])
                v = b if v == a else a
                onward = [] if v in corner else [k for _, k in at[v] if not used[k]]
                e = onward[0] if onward else -1
            curve.append((v, -1))
            curves.append(curve)
    return curves, sorted(corner)


def _along(
    vertices: Array, curve: list[tuple[int, int]], ends: Array, spacing: float
) -> list[tuple[Array, int, int]]:
    """Points that divide a curve evenly, without its ends: position, vertex or -1, edge."""
    places = vertices[[v for v, _ in curve]]
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    reached = np.concatenate([[0.0], np.cumsum(lengths)])
    loop = curve[0][0] == curve[-1][0]
    count = max(3 if loop else 1, int(np.ceil(reached[-1] / spacing - 1e-9)))
    found = []
    for k in range(0 if loop else 1, count):
        place = reached[-1] * k / count
        n = min(int(np.searchsorted(reached, place, side="right")) - 1, len(lengths) - 1)
        t = (place - reached[n]) / lengths[n]
        vertex = curve[n][0] if t < _SAME else (curve[n + 1][0] if t > 1.0 - _SAME else -1)
        found.append((places[n] + t * (places[n + 1] - places[n]), vertex, curve[n][1]))
    return found


def _round_points(
    vertices: Array, faces: Array, edges: _Edges, around: dict[int, list[int]], spacing: float
) -> tuple[Array, list[Array]]:
    """Points [n, 3] m on faces that bend outwards, and the faces of each."""
    bends = np.zeros(len(faces), dtype=bool)
    bends[edges.faces[edges.round].ravel()] = True
    in_hollow = set(edges.ends[edges.hollow].ravel().tolist())
    points: list[Array] = []
    owners: list[Array] = []
    for v in sorted({int(v) for v in edges.ends[edges.round].ravel()} - in_hollow):
        points.append(vertices[v])
        owners.append(np.array(around[v]))
    for f in np.flatnonzero(bends):
        a, b, c = vertices[faces[f]]
        longest = max(np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c))
        n = int(np.ceil(_FINER * longest / spacing))
        for i in range(1, n):
            for j in range(1, n - i):
                points.append(a + (b - a) * (i / n) + (c - a) * (j / n))
                owners.append(np.array([f]))
    # points within an edge have two faces
    for e in np.flatnonzero(edges.round):
        a, b = vertices[edges.ends[e]]
        n = int(np.ceil(_FINER * np.linalg.norm(b - a) / spacing))
        for i in range(1, n):
            points.append(a + (b - a) * (i / n))
            owners.append(edges.faces[e])
    return np.array(points).reshape(-1, 3), owners

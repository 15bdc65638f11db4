"""What a mesh is as a solid, computed once: its body frame, mass properties and sizes."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from physics.directions import spread_directions
from physics.meshes.distance_grid import DistanceGrid, distance_grid
from physics.meshes.properties import principal_axes, properties
from physics.meshes.read import merged
from physics.meshes.samples import has_sharp_edges, inset, surface_points
from physics.meshes.sides import flat_sides, weights
from physics.meshes.support import Support

Array = np.ndarray
Rows = tuple[tuple[float, ...], ...]
Triples = tuple[tuple[int, ...], ...]

# rays by which the thickness of walls is measured
_RAYS = 400
# fraction of the surface that may be thinner: sharp edges and tips are thin in every mesh
_THIN = 0.1
# directions along which the width is measured, beside those of the faces
_DIRECTIONS = 500
# of a weight of 1, that a side on which the mesh rests may lack
_LACKS = 0.01
# how many meshes are remembered
_REMEMBERED = 64


class Geometry(NamedTuple):
    """Of a mesh at scale 1, in its body frame.

    Attributes:
        vertices: [n, 3] m.
        faces: [m, 3].
        volume: m^3.
        centre: [3] m, the centre of mass in the file's frame.
        rotation: [3, 3], from the body frame to the file's.
        moments: [3] m^2, principal moments per kg.
        width: m, smallest distance of two parallel planes with the mesh between them.
        thickness: m, of the walls: nine tenths of the surface are thicker.
    """

    vertices: Array
    faces: Array
    volume: float
    centre: Array
    rotation: Array
    moments: Array
    width: float
    thickness: float


@lru_cache(maxsize=_REMEMBERED)
def geometry(vertices: Rows, faces: Triples) -> Geometry:
    """The geometry of a mesh that `checks` has accepted."""
    points, triangles = merged(np.array(vertices), np.array(faces))
    found = properties(points, triangles)
    moments, rotation = principal_axes(found.tensor)
    body = (points - found.centre) @ rotation
    return Geometry(
        vertices=body,
        faces=triangles,
        volume=found.volume,
        centre=found.centre,
        rotation=rotation,
        moments=moments,
        width=_width(body, triangles),
        thickness=_thickness(body, triangles),
    )


def _normals(vertices: Array, faces: Array) -> tuple[Array, Array]:
    """Unit normals [m, 3] and areas [m] m^2 of the faces that have an area."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    doubled = np.linalg.norm(normals, axis=1)
    solid = doubled > 0.0
    return normals[solid] / doubled[solid, None], 0.5 * doubled[solid]


def _width(vertices: Array, faces: Array) -> float:
    normals, area = _normals(vertices, faces)
    largest = normals[np.argsort(-area)[:_DIRECTIONS]]
    heights = vertices @ np.concatenate([largest, spread_directions(_DIRECTIONS)]).T
    return float((heights.max(axis=0) - heights.min(axis=0)).min())


def _thickness(vertices: Array, faces: Array) -> float:
    """By rays from points of the surface inwards, spread evenly over its area."""
    normals, area = _normals(vertices, faces)
    corners = vertices[faces]
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    solid = np.linalg.norm(np.cross(u, v), axis=1) > 0.0
    a, u, v = a[solid], u[solid], v[solid]
    share = np.cumsum(area) / area.sum()
    chosen = np.searchsorted(share, (np.arange(_RAYS) + 0.5) / _RAYS)
    found = []
    for f in chosen:
        # a little off the middle, where no edge of a symmetric mesh lies opposite
        start, way = a[f] + 0.31 * u[f] + 0.36 * v[f], -normals[f]
        p = np.cross(way, v)
        det = np.einsum("mi,mi->m", u, p)
        hit = np.abs(det) > 0.0
        inverse = 1.0 / np.where(hit, det, 1.0)
        s = start - a
        q = np.cross(s, u)
        first, second = np.einsum("mi,mi->m", s, p) * inverse, q @ way * inverse
        far = np.einsum("mi,mi->m", v, q) * inverse
        hit &= (first >= 0.0) & (second >= 0.0) & (first + second <= 1.0) & (far > 0.0)
        hit[f] = False
        found.append(float(far[hit].min(initial=np.inf)))
    return float(np.quantile(found, _THIN))


@lru_cache(maxsize=_REMEMBERED)
def support(vertices: Rows, faces: Triples) -> Support:
    """How far a mesh reaches."""
    solid = geometry(vertices, faces)
    return Support(solid.vertices, solid.faces)


@lru_cache(maxsize=_REMEMBERED)
def samples(
    vertices: Rows,
    faces: Triples,
    spacing: float,
    rounding: float,
    sink: float = 0.0,
) -> tuple[Array, Array, float]:
    """Positions [n, 3] m, weights [n] and radius in m of a mesh's samples.

    Args:
        vertices: as in `geometry`.
        faces: likewise.
        spacing: m, largest distance between neighbours.
        rounding: m, radius, which is larger where all of the mesh is rounder.
        sink: m, by which a body at rest may be too low; 0: only the spacing counts.
    """
    solid = geometry(vertices, faces)
    if sink == 0.0:
        points, touching, _ = surface_points(solid.vertices, solid.faces, spacing, np.eye(3)[:0])
        centres, normals = inset(points, touching, rounding)
        return centres, weights(centres, normals, 0.0), rounding
    reach = support(vertices, faces)
    points, touching, extra = surface_points(solid.vertices, solid.faces, spacing, reach.directions)
    chosen = ~np.array(extra)
    if not has_sharp_edges(solid.vertices, solid.faces):
        largest = min(reach.largest_radius(sink), 0.5 * solid.width)
        convex = bool(reach.outer.all())
        if not convex:
            largest = min(largest, 0.25 * solid.thickness)
        if largest > rounding:
            rounding, chosen = largest, ~chosen & False
    centres, normals = inset(points, touching, rounding)
    if rounding > 0.0:  # where many faces meet no ball at the vertex touches all of them
        more, facing = reach.at_corners(solid.vertices, solid.faces, rounding, sink)
        centres, normals = np.concatenate([centres, more]), np.concatenate([normals, facing])
        chosen = np.concatenate([chosen, np.zeros(len(more), dtype=bool)])
    if not chosen.any():
        middle, ball = reach.one_ball(sink)
        if ball > 0.0:
            return middle[None], np.ones(1), ball
    chosen[reach.missing(centres, chosen, sink)] = True
    centres, normals = centres[chosen], normals[chosen]
    shares = weights(centres, normals, sink, reach.normals)
    own = [
        (point - rounding * normal, normal)
        for normal, mask, point in reach.resting_faces(centres, sink)
        if shares[mask].sum() < 1.0 - _LACKS
    ]
    if own:
        centres = np.concatenate([centres, [place for place, _ in own]])
        normals = np.concatenate([normals, [normal for _, normal in own]])
        shares = weights(centres, normals, sink, reach.normals)
    return centres, shares, rounding


@lru_cache(maxsize=_REMEMBERED)
def resting_sides(vertices: Rows, faces: Triples, spacing: float) -> Array:
    """Normals [k, 3] of the flat sides of the samples, on which a mesh can lie."""
    return flat_sides(samples(vertices, faces, spacing, 0.0)[0])


@lru_cache(maxsize=_REMEMBERED)
def grid(vertices: Rows, faces: Triples, cells: int) -> DistanceGrid:
    """The signed distance grid of a mesh."""
    solid = geometry(vertices, faces)
    return distance_grid(solid.vertices, solid.faces, cells)

"""What is drawn without being solid, as the renderer's tables: goals, ghosts, marks and forces."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from physics.rotation import rotation_matrix
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.primitives import balls, primitives
from rigid_envs.rendering.rays.intersections import BOX, CAPSULE
from rigid_envs.rendering.rays.tables import DECAL, POLYGON, PRIMITIVE
from rigid_envs.rendering.view import Arrow, Ghost, Goal, Mark, Marker

Array = np.ndarray

BALL_OPACITY, GHOST_OPACITY, DISC_OPACITY, RIM_OPACITY = 0.40, 0.27, 0.42, 0.90
STEM, EDGE, SHAFT = 0.002, 1.3, 2.0  # as a share of the distance; pixels; pixels
HEAD_LENGTH, HEAD_WIDTH = 8.0, 4.0  # pixels, of an arrow
_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
# the edges of a box: pairs of corners that differ along one axis
EDGES = [(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit]


class Overlay(NamedTuple):
    """Tables of what is drawn beside solids.

    Attributes:
        glass: [g], of PRIMITIVE.
        decals: [d], of DECAL.
        polygons: [p], of POLYGON.
    """

    glass: Array
    decals: Array
    polygons: Array


def overlay(
    markers: Sequence[Marker],
    forces: Sequence[Arrow],
    camera: Camera,
    width: int,
    height: int,
    floor: float,
) -> Overlay:
    """Tables for pictures of `width` x `height` pixels, of a ground at a height `floor` m."""
    glass, decals, polygons = [np.zeros(0, PRIMITIVE)], [np.zeros(0, DECAL)], [_NONE]
    for marker in markers:
        if isinstance(marker, Goal):
            glass += _ball(marker, camera, floor)
            decals.append(_disc(marker))
        elif isinstance(marker, Mark):
            decals.append(_cross(marker))
    ghosts = [marker for marker in markers if isinstance(marker, Ghost)]
    if ghosts:
        glass.append(_places(ghosts))
        corners = [box_corners(ghost) for ghost in ghosts]
        lines = np.array(corners)[:, EDGES].reshape(-1, 2, 3)
        colors = np.repeat([ghost.color for ghost in ghosts], len(EDGES), axis=0)
        polygons.append(_strips(lines, colors, camera, width, height))
    for arrow in forces:
        polygons.append(_arrow(arrow, camera, width, height))
    return Overlay(np.concatenate(glass), np.concatenate(decals), np.concatenate(polygons))


def stacked(overlays: Sequence[Overlay], worlds: int) -> Overlay:
    """Tables [worlds, ...] of all overlays; empty places are filled by what can't be seen.

    Raises:
        ValueError: overlays that are neither none nor one for each world.
    """
    if len(overlays) not in (0, worlds):
        raise ValueError(f"overlays must be none or {worlds}, one a world, got {len(overlays)}")
    tables = []
    for k, dtype in enumerate((PRIMITIVE, DECAL, POLYGON)):
        most = max((len(each[k]) for each in overlays), default=0)
        table = np.zeros((worlds, most), dtype)
        for row, each in zip(table, overlays, strict=False):
            row[most - len(each[k]) :] = each[k]
        tables.append(table)
    return Overlay(*tables)


_NONE = np.zeros(0, POLYGON)


def box_corners(ghost: Ghost) -> Array:
    """Corners [8, 3] m of a place."""
    turn = rotation_matrix(ghost.orientation)
    return np.asarray(ghost.position + (_SIGNS * ghost.half_extents) @ turn.T)


def _ball(goal: Goal, camera: Camera, floor: float) -> list[Array]:
    """A ball, and a stem that shows over which spot it hangs; none below the ground."""
    height = float(goal.position[2]) - floor
    if height <= 0.0:
        return []
    ball = balls(goal.position[None], min(goal.radius, height))
    ball["color"], ball["opacity"] = goal.color, BALL_OPACITY
    if height <= goal.radius:
        return [ball]
    stem = primitives(1, CAPSULE)
    stem["position"], stem["color"] = goal.position - (0.0, 0.0, 0.5 * height), goal.color
    thin = 0.5 * STEM * camera.distance
    stem["size"], stem["reach"] = (thin, 0.5 * height, 0.0), 0.5 * height + thin
    return [ball, stem]


def _disc(goal: Goal) -> Array:
    table = np.zeros(1, DECAL)
    table["position"], table["radius"] = goal.position[:2], goal.radius
    table["color"], table["opacity"], table["rim"] = goal.color, DISC_OPACITY, RIM_OPACITY
    return table


def _cross(mark: Mark) -> Array:
    table = np.zeros(1, DECAL)
    table["position"], table["radius"] = mark.position[:2], mark.radius
    table["width"], table["color"], table["opacity"] = 0.25 * mark.radius, mark.color, 1.0
    return table


def _places(ghosts: list[Ghost]) -> Array:
    table = primitives(len(ghosts), BOX)
    table["position"] = [ghost.position for ghost in ghosts]
    table["size"] = [ghost.half_extents for ghost in ghosts]
    table["axes"] = [rotation_matrix(ghost.orientation).T for ghost in ghosts]
    table["reach"] = np.linalg.norm(table["size"], axis=1)
    table["color"], table["opacity"] = [ghost.color for ghost in ghosts], GHOST_OPACITY
    return table


def _strips(lines: Array, colors: Array, camera: Camera, width: int, height: int) -> Array:
    """Lines [n, 2, 3] m as thin polygons; those that reach behind the camera are left out."""
    pixels, depth = camera.project(lines, width, height)
    seen = depth.min(axis=1) > camera.near
    pixels, colors = pixels[seen], colors[seen]
    along = pixels[:, 1] - pixels[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    aside = 0.5 * EDGE * along[:, ::-1] * (-1.0, 1.0) / length
    table = np.zeros(len(pixels), POLYGON)
    start, end = pixels[:, 0], pixels[:, 1]
    table["corners"] = np.stack([start - aside, end - aside, end + aside, start + aside], axis=1)
    table["color"], table["opacity"] = colors, 1.0
    return table


def _arrow(arrow: Arrow, camera: Camera, width: int, height: int) -> Array:
    """A shaft and a head; nothing if it is shorter than a pixel or reaches behind the camera."""
    ends = np.stack([arrow.origin, arrow.origin + arrow.vector])
    (tail, tip), depth = camera.project(ends, width, height)
    length = float(np.hypot(*(tip - tail)))
    if length < 1.0 or depth.min() < camera.near:
        return _NONE
    along = (tip - tail) / length
    aside = np.array([-along[1], along[0]])
    neck = tip - min(HEAD_LENGTH, 0.6 * length) * along
    thin, wide = 0.5 * SHAFT * aside, HEAD_WIDTH * aside
    table = np.zeros(2, POLYGON)
    table["corners"][0] = tail - thin, neck - thin, neck + thin, tail + thin
    table["corners"][1] = neck - wide, tip, neck + wide, neck + wide
    table["color"], table["opacity"] = arrow.color, 1.0
    return table

"""Cameras by name, and cameras from what a user gives."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from physics.scene.validation import vector
from rigid_envs.rendering.camera import Camera

Array = np.ndarray
Point = tuple[float, float, float]

# azimuth and elevation in degrees of the eye, about what the task's own camera looks at
NAMED = {"front": (-90.0, 20.0), "side": (0.0, 20.0), "back": (90.0, 20.0), "top": (-90.0, 90.0)}
FIELDS = ("position", "target", "field_of_view")
FOLLOW = "follow"  # the own camera, which moves along with a place
NEAR = 0.6  # of its own distance
AHEAD = 1.0 / 3.0  # where it looks: of the way from the place to the goal
USED = 0.85  # of the picture, in which both are, or all of a workspace
FITS = 8  # moves of a camera to the middle of what it sees, each of which nearly gets there
LEVEL = 5.0  # degrees, least elevation, so that the eye stays above the ground


class Seen(Protocol):
    """What cameras know of a task: its own camera, and a box of its starts and goals or None."""

    camera: Camera
    workspace: tuple[Point, Point] | None


def choose_camera(given: Any, task: Seen, shape: float = 1.0) -> Camera:
    """A camera from a name, from settings, or the task's own.

    Args:
        given: None, "task" or "follow": the task's camera, which `following` moves; one of `NAMED`:
            the same target, distance and field of view from another side, or, of a task with a
            workspace, as near as all of that is seen; a Camera; or a dict with some of `FIELDS`,
            the others being those of the task's camera.
        task: whose camera and workspace.
        shape: width over height of the picture.

    Raises:
        TypeError: none of these, or a value of another type.
        ValueError: an unknown name or field, a value out of its range, or an invalid workspace.
    """
    own = task.camera
    if given is None or isinstance(given, Camera):
        return given or own
    if isinstance(given, str):
        if given in ("task", FOLLOW):
            return own
        if given not in NAMED:
            names = ", ".join(map(repr, ("task", FOLLOW, *NAMED)))
            raise ValueError(f"camera must be one of {names}, got {given!r}")
        azimuth, elevation = NAMED[given]
        if task.workspace is not None:
            low, high = (vector("corner of Task.workspace", corner) for corner in task.workspace)
            if not all(a < b for a, b in zip(low, high, strict=True)):
                raise ValueError(f"Task.workspace must be (low, high), got {task.workspace}")
            return looking_at(low, high, azimuth, elevation, USED, shape)
        return Camera.around(own.target, own.distance, azimuth, elevation, own.field_of_view)
    if not isinstance(given, Mapping):
        raise TypeError(
            "camera must be a name, a Camera or a dict of position, target and field_of_view, got "
            f"{given!r}"
        )
    if unknown := [name for name in given if name not in FIELDS]:
        raise ValueError(f"camera has no field {unknown[0]!r}: its fields are {', '.join(FIELDS)}")
    return Camera(**{name: getattr(own, name) for name in FIELDS} | dict(given))


def following(
    own: Camera,
    place: Array,
    goal: Array,
    floor: float = 0.0,
    shape: float = 1.0,
    *,
    body: Array | None = None,
) -> Camera:
    """The task's camera, nearer, and moved along with a place; it sees the place and the goal.

    Args:
        own: the task's camera.
        place: (3,) m, what is to reach the goal.
        goal: (3,) m.
        floor: m, height of the ground.
        shape: width over height of the picture.
        body: (3,) m, what it sees as well, such as a ball that rolls on after it has landed.
    """
    target = place + AHEAD * (goal - place)
    target[2] = max(target[2], floor)
    around, elevation = tuple(target.tolist()), max(own.elevation, LEVEL)
    view = Camera.around(around, 1.0, own.azimuth, elevation, own.field_of_view)
    seen = np.array([place, goal] if body is None else [place, goal, body])
    distance = max(NEAR * own.distance, _fitting(view, seen, USED, shape))
    return Camera.around(around, distance, own.azimuth, elevation, own.field_of_view)


def fitted(own: Camera, points: Array, shape: float = 1.0, used: float = USED) -> Camera:
    """A camera from the side of another one, so near that it just sees some points.

    Args:
        own: from whose side, and with whose field of view.
        points: [n, 3] m.
        shape: width over height of the picture.
        used: fraction of the picture within which they are to be.
    """
    target = points.mean(axis=0)
    camera = own
    for _ in range(FITS):
        around = tuple(target.tolist())
        view = Camera.around(around, 1.0, own.azimuth, own.elevation, own.field_of_view)
        distance = _fitting(view, points, used, shape)
        camera = Camera.around(around, distance, own.azimuth, own.elevation, own.field_of_view)
        pixels, _ = camera.project(points, 1, 1)
        middle = 0.5 * (pixels.min(axis=0) + pixels.max(axis=0)) - 0.5
        scale = distance / camera.focal_length(1)  # m of a pixel at the target
        target = target + scale * (middle * (1.0, -1.0)) @ camera.axes[:2]
    return camera


def looking_at(
    low: Any,
    high: Any,
    azimuth: float = -65.0,
    elevation: float = 30.0,
    used: float = 1.0,
    shape: float = 1.0,
) -> Camera:
    """A camera that sees a box, from as near as it can.

    Args:
        low: (3,) m, least coordinates.
        high: (3,) m, greatest coordinates.
        azimuth: degrees, see `Camera.around`.
        elevation: degrees, likewise.
        used: fraction of the picture within which the box is to be.
        shape: width over height of the picture.
    """
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    corners = low + (high - low) * np.array(
        [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    )
    target = tuple((0.5 * (low + high)).tolist())
    view = Camera.around(target, 1.0, azimuth, elevation)
    return Camera.around(target, _fitting(view, corners, used, shape), azimuth, elevation)


def _fitting(view: Camera, points: Array, used: float = 1.0, shape: float = 1.0) -> float:
    """m, the least distance from its target at which a camera sees points.

    Args:
        view: how it looks at its target.
        points: [n, 3] m.
        used: fraction of the picture within which they are to be.
        shape: width over height of the picture.
    """
    local = (points - view.target) @ view.axes.T  # across the picture, and into it
    slope = used * np.tan(0.5 * np.radians(view.field_of_view))
    across = np.maximum(np.abs(local[:, 0]) / shape, np.abs(local[:, 1]))
    return float((across / slope - local[:, 2]).max())

"""Cameras by name, and cameras from what a user gives."""

from collections.abc import Mapping
from typing import Any


from rigid_envs.rendering.camera import Camera

# azimuth and elevation in degrees of the eye, about what the task's own camera looks at
NAMED = {"front": (-90.0, 20.0), "side": (0.0, 20.0), "back": (90.0, 20.0), "top": (-90.0, 90.0)}
FIELDS = ("position", "target", "field_of_view")


def choose_camera(given: Any, own: Camera) -> Camera:
    """A camera from a name, from settings, or the task's own.

    Args:
        given: None or "task": `own`; one of `NAMED`: the same target, distance and field of view
            from another side; a Camera; or a dict with some of `FIELDS`, the others being those of
            `own`.
        own: the task's camera.

    Raises:
        TypeError: none of these, or a value of another type.
        ValueError: an unknown name or field, or a value out of its range.
    """
    if given is None or isinstance(given, Camera):
        return given or own
    if isinstance(given, str):
        if given == "task":
            return own
        if given not in NAMED:
            raise ValueError(
                f"camera must be one of {', '.join(map(repr, ('task', *NAMED)))}, got {given!r}"
            )
        azimuth, elevation = NAMED[given]
        return Camera.around(own.target, own.distance, azimuth, elevation, own.field_of_view)
    if not isinstance(given, Mapping):
        raise TypeError(
            "camera must be a name, a Camera or a dict of position, target and field_of_view, got "
            f"{given!r}"
        )
    if unknown := [name for name in given if name not in FIELDS]:
        raise ValueError(f"camera has no field {unknown[0]!r}: its fields are {', '.join(FIELDS)}")
    return Camera(**{name: getattr(own, name) for name in FIELDS} | dict(given))

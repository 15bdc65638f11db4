"""How far one motion is from another."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from physics.tuning.motion import Motion

Array = np.ndarray


class Metric(NamedTuple):
    """An error that a user can ask for.

    Attributes:
        unit: of the error; "" if it has none.
        meaning: in words.
        distance: [frames + 1] between a motion and a reference; the largest one is the error.
        needs_reference: whether the reference matters.
    """

    unit: str
    meaning: str
    distance: Callable[[Motion, Motion], Array]
    needs_reference: bool = True


def _position(a: Motion, b: Motion) -> Array:
    return _largest(np.linalg.norm(a.position - b.position, axis=-1))


def _velocity(a: Motion, b: Motion) -> Array:
    return _largest(np.linalg.norm(a.velocity - b.velocity, axis=-1))


def _orientation(a: Motion, b: Motion) -> Array:
    # a rotation by an angle changes a quaternion by 2 sin(angle / 4); q and -q are the same
    apart = np.minimum(
        np.linalg.norm(a.orientation - b.orientation, axis=-1),
        np.linalg.norm(a.orientation + b.orientation, axis=-1),
    )
    return _largest(4.0 * np.arcsin(np.minimum(0.5 * apart, 1.0)))


def _energy(a: Motion, b: Motion) -> Array:
    scale = np.max(np.abs(b.kinetic), axis=0)
    changed = np.max(np.abs(b.energy - b.energy[0]), axis=0)
    scale = np.maximum(np.maximum(scale, changed), np.finfo(float).tiny)
    relative = (a.energy - a.energy[0]) - (b.energy - b.energy[0])
    return _largest(np.abs(relative) / scale)


def _penetration(a: Motion, _: Motion) -> Array:
    return _largest(a.penetration)


def _largest(values: Array) -> Array:
    """The largest value of each frame."""
    return np.asarray(values.reshape(len(values), -1).max(axis=1))


METRICS: dict[str, Metric] = {
    "position": Metric("m", "distance of a centre of mass from the reference", _position),
    "orientation": Metric("rad", "angle of a body from the reference", _orientation),
    "velocity": Metric("m/s", "difference of a linear velocity from the reference", _velocity),
    "energy": Metric(
        "",
        "difference of the energy's change, relative to the largest kinetic energy or change",
        _energy,
    ),
    "penetration": Metric("m", "deepest penetration", _penetration, needs_reference=False),
}

"""Servos: how far a hand gets in one step, and where its set point must be to get it there.

A servo is a spring and damper between a hand and its set point, so position and velocity after a
step are linear in those before and in the set point's. `Servo.moving` solves for the set point. A
hand that meets something is held back by it, as the original's is.
"""

import cmath
import math
from functools import cache
from typing import Any

import numpy as np

from physics import World

Array = np.ndarray


class Servo:
    """A spring and damper between a hand and its set point.

    Args:
        frequency: rad/s, natural frequency.
        damping: ratio to critical damping.
    """

    def __init__(self, frequency: float, damping: float) -> None:
        self.frequency, self.damping = frequency, damping

    @cache  # noqa: B019  (servos are few and live as long as their module)
    def transition(self, time: float, substep: float = 0.0) -> Array:
        """[2, 2]: offset from the set point and its rate after `time` s, from those before.

        Args:
            time: s.
            substep: s, of the engine, whose drives follow the law of their substeps; 0: exact.
        """
        w, z = self.frequency, self.damping
        if substep > 0.0:
            columns = [_substeps(w, z, time, substep, *start) for start in ((1.0, 0.0), (0.0, 1.0))]
            return np.array(columns).T
        # x'' = -w^2 x - 2 z w x' has the roots -z w ± s
        s = w * cmath.sqrt(z * z - 1.0)
        decay = cmath.exp(-z * w * time)
        both = (decay * cmath.cosh(s * time)).real
        slope = (decay * (cmath.sinh(s * time) / s if s else time)).real
        return np.array([[both + z * w * slope, slope], [-w * w * slope, both - z * w * slope]])

    def answer(self, time: float, ahead: Any, velocity: Any) -> tuple[Any, Any]:
        """Displacement in m in `time` s and velocity in m/s at its end.

        Args:
            time: s.
            ahead: m, how far a resting set point is ahead of the hand.
            velocity: m/s, of the hand at the start.
        """
        M = self.transition(time)
        return (1.0 - M[0, 0]) * ahead + M[0, 1] * velocity, M[1, 1] * velocity - M[1, 0] * ahead

    def ahead(self, time: float, substep: float, displacement: Any, velocity: Any) -> Any:
        """How far ahead in m a resting set point must be for a displacement in m in `time` s."""
        M = self.transition(time, substep)
        return (displacement - M[0, 1] * velocity) / (1.0 - M[0, 0])

    def moving(
        self, time: float, substep: float, velocity: Array, displacement: Array, end: Array
    ) -> tuple[Array, Array]:
        """The moving set point that gives a displacement and an end velocity in `time` s.

        Args:
            time: s.
            substep: s, of the engine.
            velocity: m/s, at the start.
            displacement: m.
            end: m/s, at the end.

        Returns:
            How far ahead of the hand it starts, m, and its velocity, m/s.
        """
        M = self.transition(time, substep)
        matrix = np.array([[1.0 - M[0, 0], time - M[0, 1]], [-M[1, 0], 1.0 - M[1, 1]]])
        (a, b), (c, d) = np.linalg.inv(matrix)
        x, v = displacement - M[0, 1] * velocity, end - M[1, 1] * velocity
        return a * x + b * v, c * x + d * v


def _substeps(
    w: float, z: float, time: float, substep: float, offset: float, rate: float
) -> tuple[float, float]:
    """Offset and rate after `time` s as the engine computes them.

    Kick, drift, kick: the force of a substep's end is that of its position and of the velocity in
    its middle.
    """
    count = math.ceil(time / substep - 1e-9)
    h = time / count
    force = -w * w * offset - 2.0 * z * w * rate
    for _ in range(count):
        rate += 0.5 * h * force
        offset += h * rate
        force = -w * w * offset - 2.0 * z * w * rate
        rate += 0.5 * h * force
    return offset, rate


def move_set_points(world: World, start: Array, speed: Array, time: float) -> None:
    """Moves the set points of all drives from `start` at `speed`, [n, drives, 3] m and m/s."""
    world.move_drives(start, 0.0)
    world.move_drives(start + time * speed, time, renew_forces=True)

"""A ball that tasks use as their finger: scene, actions and observation.

A servo moves the finger along x, y and z with a limited force, so that it can't press a body
through the ground. Actions are relative to the finger's position.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from physics import Drive, Readout, Sphere, World

Array = np.ndarray
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Finger:
    """A driven ball and its workspace; the last solid of its scene.

    Args:
        home: initial position in m.
        low: lower corner of the workspace in m.
        high: upper corner of the workspace in m.
        stride: displacement per step along each axis at full action, in m.
    """

    home: Vector
    low: Vector
    high: Vector
    stride: float

    RADIUS: ClassVar[float] = 0.015  # m
    MASS: ClassVar[float] = 0.05  # kg
    FORCE: ClassVar[float] = 2.5  # N, limit along each axis

    actions: ClassVar = ("finger x", "finger y", "finger z")
    bounds: ClassVar = (
        *((f"finger {a}", "m", -0.5, 0.5) for a in "xyz"),
        *((f"finger velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
    )

    def drive(self) -> Drive:
        """The drive of a scene."""
        return Drive(
            Sphere(self.RADIUS),
            mass=self.MASS,
            force_limit=self.FORCE,
            position=self.home,
            name="finger",
        )

    def act(self, world: World, now: Readout, actions: Array, frame: float) -> None:
        """Moves the finger by actions [count, 3], within its workspace, in a step of `frame` s."""
        finger = now.position[:, -1]
        target = np.minimum(np.maximum(finger + self.stride * actions, self.low), self.high)
        world.command_drives(((target - finger) / frame)[:, None])

    def position(self, now: Readout) -> Array:
        """Position [count, 3] m."""
        return now.position[:, -1]

    def observe(self, now: Readout, out: Array) -> None:
        """Writes the components [count, 6] that `bounds` names."""
        out[:, 0:3], out[:, 3:6] = now.position[:, -1], now.linear_velocity[:, -1]

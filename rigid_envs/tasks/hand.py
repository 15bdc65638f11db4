"""Hand: a parallel gripper as a task's tool: its scene, its actions and what it tells of itself.

The hand moves along x, y and z; its fingers close along y. Two cubes of 3 cm, its pads, are all of
it that touches. Where its weight or a load pulls it from its reference, it stays: an action counts
from the reference, of which the hand may be short by three quarters of a stride, no more.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from physics import Box, Gripper, Material, Readout, Scene, World

Array = np.ndarray
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Hand:
    """A gripper with its workspace.

    Args:
        home: m, where it is at the start.
        low: m, lower corner of its workspace.
        high: m, upper corner.
        stride: m a step along each axis at full action.
        widest: m between the pads when open.
    """

    home: Vector
    low: Vector
    high: Vector
    stride: float
    widest: float = 0.08

    PAD: ClassVar[float] = 0.015  # m, half the width of a pad
    FINGER_MASS: ClassVar[float] = 0.3  # kg
    FORCE: ClassVar[float] = 14.0  # N of the carriage along each axis
    FREQUENCY: ClassVar[float] = (
        40.0  # rad/s, of its servos: it starts no faster than pads can hold
    )
    GRIP: ClassVar[float] = 4.0  # N with which each finger presses

    DAMPING: ClassVar[float] = 1.0  # of its servos, a share of critical

    actions: ClassVar = ("hand x", "hand y", "hand z", "grip")
    bounds: ClassVar = (
        *((f"hand {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"hand velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        ("opening", "m", -0.05, 0.2),
        ("opening velocity", "m/s", -20.0, 20.0),
        *((f"hand reference {a}", "m", -1.0, 1.0) for a in "xyz"),
    )

    def gripper(self, opening: float, material: Material) -> Gripper:
        """The tool, with so many m between its pads."""
        return Gripper(
            Box((self.PAD,) * 3),
            mass=self.FINGER_MASS,
            force_limit=self.FORCE,
            grip_limit=self.GRIP,
            position=self.home,
            distance=opening + 2.0 * self.PAD,
            frequency=self.FREQUENCY,
            damping_ratio=self.DAMPING,
            material=material,
        )

    def act(self, world: World, now: Readout, actions: Array, frame: float) -> None:
        """Moves the hand by up to a stride along each axis; grip -1 closes it and 1 opens it."""
        target = self.stride * actions[:, :3] + self.reference(now)
        hand, slack = self.place(now), 0.75 * self.stride
        target = np.minimum(np.maximum(target, hand - slack), hand + slack)
        target = np.minimum(np.maximum(target, self.low), self.high)
        opening = 0.5 * self.widest * (actions[:, 3] + 1.0)
        world.move_drives(self.fingers(target, opening), frame)

    def fingers(self, place: Array, opening: Any = None) -> Array:
        """Both pads [count, 2, 3] m of a hand at a place [count, 3] m, wide open if not told."""
        half = 0.5 * (self.widest if opening is None else opening) + self.PAD
        fingers = np.stack([place, place], axis=1)
        fingers[:, 0, 1] -= half
        fingers[:, 1, 1] += half
        return fingers

    def hold(self, scene: Scene, like: World, frame: float) -> tuple[Array, Array]:
        """Where pads [1, 2, 3] m and bodies [1, bodies, 3] m are once the grip has closed at home.

        How deep the pads press in depends on the fidelity, but not on a body's size.

        Args:
            scene: a body between the pads.
            like: a world of the fidelity.
            frame: s of a step.
        """
        # its numbers are those of worlds that are alike; varied only to share compiled kernels
        world = World(scene, like.fidelity, varied=like.features.varied)
        closed = np.array(self.home) + np.zeros((2, 3))
        world.move_drives(closed, frame)
        for _ in range(10):
            world.advance(frame)
            world.move_drives(closed, frame)
        return world.drive_position.copy(), world.position.copy()

    def place(self, now: Readout) -> Array:
        """The middle between the pads, [count, 3] m."""
        return 0.5 * (now.position[:, -2] + now.position[:, -1])

    def reference(self, now: Readout) -> Array:
        """Where the carriage's servo pulls to, [count, 3] m."""
        return 0.5 * (now.reference[:, -2] + now.reference[:, -1])

    def opening(self, now: Readout) -> Array:
        """Between the pads, [count] m."""
        place = now.position
        return np.asarray(place[:, -1, 1] - place[:, -2, 1] - 2.0 * self.PAD)

    def asked(self, now: Readout) -> Array:
        """What the fingers are asked to open to, [count] m."""
        asked = now.reference[:, -1, 1] - now.reference[:, -2, 1] - 2.0 * self.PAD
        return np.clip(asked, 0.0, self.widest)

    def slackness(self, now: Readout) -> Array:
        """What the fingers are asked to open to, as a share [count] of what they are; at most 1."""
        return np.minimum(self.asked(now) / np.maximum(self.opening(now), 1e-3), 1.0)

    def observe(self, now: Readout, out: Array) -> None:
        """Writes what `bounds` names, [count, 11]."""
        velocity = now.linear_velocity
        out[:, 0:3] = self.place(now)
        out[:, 3:6] = 0.5 * (velocity[:, -2] + velocity[:, -1])
        out[:, 6] = self.opening(now)
        out[:, 7] = velocity[:, -1, 1] - velocity[:, -2, 1]
        out[:, 8:11] = self.reference(now)

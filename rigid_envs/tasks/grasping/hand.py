"""A parallel gripper that tasks use as their hand: scene, actions and observation.

The hand moves along x, y and z. Its two fingers close along y. Only its two pads collide: cubes of
3 cm.

A servo pulls the hand towards a reference position, and actions move the reference. Actions are
relative to the reference, not to the hand: a loaded hand hangs below its reference, so actions
relative to the hand would lower it a little more in each step. The reference stays within three
quarters of a stride of the hand.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from physics import Box, Gripper, Material, Readout, Scene, World

Array = np.ndarray
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Hand:
    """A gripper and its workspace.

    Args:
        home: initial position in m.
        low: lower corner of the workspace in m.
        high: upper corner of the workspace in m.
        stride: displacement of the reference per step along each axis at full action, in m.
        max_opening: distance between the open pads in m.
    """

    home: Vector
    low: Vector
    high: Vector
    stride: float
    max_opening: float = 0.08

    PAD: ClassVar[float] = 0.015  # m, half the width of a pad
    FINGER_MASS: ClassVar[float] = 0.3  # kg
    CARRIAGE_FORCE: ClassVar[float] = 14.0  # N, limit along each axis
    GRIP_FORCE: ClassVar[float] = 4.0  # N, limit of each finger
    # rad/s; a faster servo would accelerate more than the friction of the pads can hold
    SERVO_FREQUENCY: ClassVar[float] = 40.0
    SERVO_DAMPING: ClassVar[float] = 1.0  # as a fraction of critical damping

    actions: ClassVar = ("hand x", "hand y", "hand z", "grip")
    bounds: ClassVar = (
        *((f"hand {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"hand velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        ("opening", "m", -0.05, 0.2),
        ("opening velocity", "m/s", -20.0, 20.0),
        *((f"hand reference {a}", "m", -1.0, 1.0) for a in "xyz"),
    )

    def gripper(self, opening: float, material: Material) -> Gripper:
        """The gripper of a scene, with `opening` m between its pads."""
        return Gripper(
            Box((self.PAD,) * 3),
            mass=self.FINGER_MASS,
            force_limit=self.CARRIAGE_FORCE,
            grip_limit=self.GRIP_FORCE,
            position=self.home,
            distance=opening + 2.0 * self.PAD,
            frequency=self.SERVO_FREQUENCY,
            damping_ratio=self.SERVO_DAMPING,
            material=material,
            name="hand",
        )

    def act(self, world: World, now: Readout, actions: Array, frame: float) -> None:
        """Commands the drives by actions [count, 4]; a grip of -1 closes and of 1 opens the hand.

        Args:
            world: the worlds.
            now: current poses and velocities.
            actions: [count, 4] within [-1, 1].
            frame: duration of a step in s.
        """
        target = self.stride * actions[:, :3] + self.reference(now)
        hand, slack = self.position(now), 0.75 * self.stride
        target = np.minimum(np.maximum(target, hand - slack), hand + slack)
        target = np.minimum(np.maximum(target, self.low), self.high)
        opening = 0.5 * self.max_opening * (actions[:, 3] + 1.0)
        world.move_drives(self.pad_positions(target, opening), frame)

    def pad_positions(self, hand: Array, opening: Any = None) -> Array:
        """Positions [count, 2, 3] m of both pads.

        Args:
            hand: [count, 3] m, position of the hand.
            opening: [count] m between the pads; `max_opening` if None.
        """
        half = 0.5 * (self.max_opening if opening is None else opening) + self.PAD
        pads = np.stack([hand, hand], axis=1)
        pads[:, 0, 1] -= half
        pads[:, 1, 1] += half
        return pads

    def settled_grasp(self, scene: Scene, like: World, frame: float) -> tuple[Array, Array]:
        """Positions of pads [1, 2, 3] m and bodies [1, bodies, 3] m after closing the grip at home.

        How deep the pads press in depends on the fidelity, but not on the size of the body.

        Args:
            scene: a body between the pads.
            like: a world with the fidelity to use.
            frame: duration of a step in s.
        """
        # the sizes are those of the scene. With the same kind of kernel and features a general
        # kernel is that of `like`, and a special one isn't joined by a general one
        per_world = like.features.per_world_parameters
        world = World(scene, like.fidelity, per_world_parameters=per_world, kernel=like.kernel)
        closed = np.array(self.home) + np.zeros((2, 3))
        world.move_drives(closed, frame)
        for _ in range(10):
            world.advance(frame)
            world.move_drives(closed, frame)
        return world.drive_position.copy(), world.position.copy()

    def position(self, now: Readout) -> Array:
        """Midpoint [count, 3] m between the pads."""
        return 0.5 * (now.position[:, -2] + now.position[:, -1])

    def reference(self, now: Readout) -> Array:
        """Position [count, 3] m to which the servo pulls the hand."""
        return 0.5 * (now.reference[:, -2] + now.reference[:, -1])

    def opening(self, now: Readout) -> Array:
        """Distance [count] m between the pads."""
        pads = now.position
        return np.asarray(pads[:, -1, 1] - pads[:, -2, 1] - 2.0 * self.PAD)

    def commanded_opening(self, now: Readout) -> Array:
        """Distance [count] m between the pads that the last action commanded."""
        opening = now.reference[:, -1, 1] - now.reference[:, -2, 1] - 2.0 * self.PAD
        return np.clip(opening, 0.0, self.max_opening)

    def observe(self, now: Readout, out: Array) -> None:
        """Writes the components [count, 11] that `bounds` names."""
        velocity = now.linear_velocity
        out[:, 0:3] = self.position(now)
        out[:, 3:6] = 0.5 * (velocity[:, -2] + velocity[:, -1])
        out[:, 6] = self.opening(now)
        out[:, 7] = velocity[:, -1, 1] - velocity[:, -2, 1]
        out[:, 8:11] = self.reference(now)

"""The hand of the Panda robot.

In the originals inverse kinematics turns a displacement of the hand into joint angles, and motors
of limited torque drive the joints there: along y the hand moves 4 cm in a step, forward 2 cm, less
where the arm is stretched, and it sinks meanwhile. Frames: x forward, y left, z up from the table's
top.
"""

from pathlib import Path
from typing import ClassVar

import numpy as np

from physics import Box, Drive, Gripper, Material, Readout, World
from rigid_envs.twins.arm import Arm
from rigid_envs.twins.servo import Servo, move_set_points

Array = np.ndarray

ARM = Arm(Path(__file__).with_name("arm.npz"), centre=(0.0, 0.0, 0.15), extent=0.15, stride=0.05)
START = np.array([0.038440, 0.0, 0.197400])  # m, of the end effector
# chosen: slow enough that the hand doesn't jerk within a step, which threw cubes out of the grip
SERVO = Servo(50.0, 1.0)
MASS = 10.0  # kg
FORCE = 1e4  # N
# groups: objects, the hand, and the table that only the hand touches
OBJECT, HAND, UNDER_HAND = 1, 2, 4

# of the fingers' mesh, its lower part. It narrows towards the tip, from 26 to 14 mm along y; these
# are the dimensions 27 mm above the tip, where a hand at an object's height meets its upper edge
LENGTH, TIP = 0.05, 0.0038  # m; the tip is that much below the end effector, where it presses
HALF_DEPTH, THICKNESS = 0.0102, 0.022  # m, of a finger along x and y
_OFFSET = np.array([0.0, 0.0, 0.5 * LENGTH - TIP])


class ClosedHand:
    """The closed fingers, one box."""

    actions: ClassVar = ("hand x", "hand y", "hand z")
    names: ClassVar = ()

    def drive(self) -> Drive:
        """The drive of a scene."""
        return Drive(
            Box((HALF_DEPTH, THICKNESS, 0.5 * LENGTH)), mass=MASS, force_limit=FORCE,
            position=tuple(START + _OFFSET), frequency=SERVO.frequency,
            damping_ratio=SERVO.damping, material=Material(1.0, restitution=0.0), name="hand",
            group=HAND, mask=OBJECT | UNDER_HAND,
        )  # fmt: skip

    def act(self, world: World, now: Readout, actions: Array, frame: float) -> None:
        """Moves the hand by actions [count, 3]."""
        position, velocity = self.position(now), self.velocity(now)
        free = ARM.answer(position, velocity, asked_displacement(position, actions), frame)
        ahead, speed = SERVO.moving(frame, world.fidelity.substep, velocity, *free)
        move_set_points(world, (now.position[:, -1] + ahead)[:, None], speed, frame)

    def position(self, now: Readout) -> Array:
        """Position [count, 3] m of the end effector."""
        return now.position[:, -1] - _OFFSET

    def velocity(self, now: Readout) -> Array:
        """Velocity [count, 3] m/s."""
        return now.linear_velocity[:, -1].astype(float)

    def observe(self, now: Readout, out: Array) -> None:
        """Writes position and velocity [count, 6]."""
        out[:, 0:3], out[:, 3:6] = self.position(now), self.velocity(now)


class OpenHand:
    """Two fingers that open and close; both always do the same."""

    actions: ClassVar = (*ClosedHand.actions, "grip")
    names: ClassVar = ("width",)

    WIDEST: ClassVar[float] = 0.04  # m, how far a finger opens
    OPENED: ClassVar[float] = 0.088  # m, how far a free finger moves in a step at full action
    HALF: ClassVar[float] = 0.01  # m, half the thickness of a finger
    # N of each finger, chosen. The original's motors press with up to 170 N, which would squash the
    # object here
    GRIP: ClassVar[float] = 80.0
    # so that the grip holds as well as 170 N with the original's coefficient of 0.5
    FRICTION: ClassVar[float] = 4.5

    def drive(self) -> Gripper:
        """The gripper of a scene."""
        return Gripper(
            Box((HALF_DEPTH, self.HALF, 0.5 * LENGTH)), mass=0.5 * MASS, force_limit=FORCE,
            grip_limit=self.GRIP, position=tuple(START + _OFFSET), distance=2.0 * self.HALF,
            frequency=SERVO.frequency, damping_ratio=SERVO.damping,
            material=Material(self.FRICTION, restitution=0.0), name="hand",
            group=HAND, mask=OBJECT | UNDER_HAND,
        )  # fmt: skip

    def act(self, world: World, now: Readout, actions: Array, frame: float) -> None:
        """Moves the hand and its fingers by actions [count, 4]; a grip of -1 closes."""
        position, velocity = self.position(now), self.velocity(now)
        free = ARM.answer(position, velocity, asked_displacement(position, actions), frame)
        ahead, speed = SERVO.moving(frame, world.fidelity.substep, velocity, *free)
        opening, fingers = self.opening(now), now.linear_velocity[:, -2:, 1]
        moved = np.clip(opening + self.OPENED * actions[:, 3], 0.0, self.WIDEST) - opening
        closing = 0.5 * (fingers[:, 0] - fingers[:, 1])
        opening = opening + SERVO.ahead(frame, world.fidelity.substep, moved, -closing)
        move_set_points(world, self.pads(position + ahead, opening), speed, frame)

    def pads(self, position: Array, opening: Array) -> Array:
        """Positions [n, 2, 3] m of the fingers of hands at [n, 3] m, each [n] m open."""
        pads = np.stack([position + _OFFSET] * 2, axis=1)
        pads[:, 0, 1] -= self.HALF + opening
        pads[:, 1, 1] += self.HALF + opening
        return pads

    def position(self, now: Readout) -> Array:
        """Position [count, 3] m of the end effector."""
        return 0.5 * (now.position[:, -2] + now.position[:, -1]) - _OFFSET

    def velocity(self, now: Readout) -> Array:
        """Velocity [count, 3] m/s."""
        both = now.linear_velocity[:, -2:]
        return 0.5 * (both[:, 0] + both[:, 1]).astype(float)

    def width(self, now: Readout) -> Array:
        """Distance [count] m of the fingers."""
        return np.asarray(now.position[:, -1, 1] - now.position[:, -2, 1] - 2.0 * self.HALF)

    def opening(self, now: Readout) -> Array:
        """How far each finger is open, [count] m."""
        return 0.5 * self.width(now)

    def observe(self, now: Readout, out: Array) -> None:
        """Writes position, velocity and width [count, 7]."""
        out[:, 0:3], out[:, 3:6] = self.position(now), self.velocity(now)
        out[:, 6] = self.width(now)


def asked_displacement(position: Array, actions: Array) -> Array:
    """Displacement [n, 3] m that actions [n, 3 or 4] ask of hands at [n, 3] m.

    The originals move the target up to the table's top if it is below.
    """
    asked = ARM.stride * actions[:, :3]
    asked[:, 2] = np.maximum(asked[:, 2], -position[:, 2])
    return np.asarray(asked)

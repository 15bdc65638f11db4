"""The hand of the Panda robot.

Its arm says how it moves, see `arm`: along y 4 cm in a step, forward 2 cm, less where the arm is
stretched, and it sinks meanwhile. Frames: x forward, y left, z up from the table's top.
"""

import math
from typing import ClassVar

import numpy as np

from physics import Box, Compound, Drive, Gripper, Material, Part, Readout, World
from rigid_envs.twins.panda.arm import ARM
from rigid_envs.twins.servo import Servo, move_set_points

Array = np.ndarray
Solids = tuple[tuple[float, float], ...]
"""Half the width and half the height of each body, m."""

STRIDE = 0.05  # m, displacement along each axis that an action asks for
# groups: objects, and the hand; the table stops the hand by its arm
OBJECT, HAND = 1, 2
MASS = 10.0  # kg, chosen: a few times what the arm's inertia is worth at the hand
# half the size along x and y of the tips of closed fingers, which may come to stand on an object
TIP_DEPTH, TIP_WIDTH = 0.0088, 0.0144  # m


def _closed_fingers() -> tuple[Compound, float]:
    """The closed fingers, and how far their middle is above the end effector, m.

    Their mesh narrows towards the tip: along y from 25 mm at 27 mm above the end effector to 14 mm
    at 7 mm below it. Two slanted boxes have these faces, and 6 mm more of them; there the mesh is
    upright, which only the edge of a cube under the lowest hand could meet.
    """
    (wide, high), (narrow, low) = (0.027, 0.033), (TIP_WIDTH, -0.007)
    thick, depth = 0.006, 0.0097  # half of each, of a box
    slant = math.atan2(wide - narrow, high - low)
    length = math.hypot(wide - narrow, high - low)
    y = 0.5 * (wide + narrow) - thick * math.cos(slant)
    side = Box((depth, thick, 0.5 * length))
    parts = [
        Part(side, (0.0, s * y, 0.0), (-s * math.sin(0.5 * slant), 0.0, 0.0, math.cos(0.5 * slant)))
        for s in (1.0, -1.0)
    ]
    return Compound(parts), 0.5 * (high + low) + thick * math.sin(slant)


FINGERS, _MIDDLE = _closed_fingers()


class ClosedHand:
    """The closed fingers, one solid.

    Args:
        shape: their shape, whose middle is that of `FINGERS`.
    """

    actions: ClassVar = ("hand x", "hand y", "hand z")
    names: ClassVar = ()
    arm: ClassVar = ARM

    OFFSET: ClassVar = np.array([0.0, 0.0, _MIDDLE])  # m, of the solid from the end effector
    # chosen: nearly as fast as the motors, as far as short substeps follow
    SERVO: ClassVar = Servo(100.0, 1.3)
    FORCE: ClassVar[float] = 1e4  # N, chosen: the servo is never limited

    def __init__(self, shape: Box | Compound = FINGERS) -> None:
        self.shape = shape

    def drive(self) -> Drive:
        """The drive of a scene."""
        return Drive(
            self.shape, mass=MASS, force_limit=self.FORCE,
            position=tuple(ARM.start_pose[0] + self.OFFSET), frequency=self.SERVO.frequency,
            damping_ratio=self.SERVO.damping, material=Material(1.0, restitution=0.0), name="hand",
            group=HAND, mask=OBJECT,
        )  # fmt: skip

    def act(self, world: World, now: Readout, actions: Array, frame: float, solids: Solids) -> None:
        """Plans the hand's path for actions [count, 3], over bodies with these solids."""
        position = self.position(now)
        below = support(now, position[:, None], TIP_WIDTH, solids)
        plan(world, position, self.velocity(now), actions, frame, below)
        self.proceed(world, now, 0, frame)

    def proceed(self, world: World, now: Readout, part: int, frame: float) -> None:
        """Moves the hand along its path for a part of a step."""
        time, substep, velocity = frame / ARM.parts, world.fidelity.substep, self.velocity(now)
        moved, end, pressed = path(world, part)
        ahead, speed = self.SERVO.moving(time, substep, velocity, moved, end)
        ahead[:, 2] -= pressed / (MASS * self.SERVO.frequency**2)
        move_set_points(world, (now.position[:, -1] + ahead)[:, None], speed[:, None], time)

    def position(self, now: Readout) -> Array:
        """Position [count, 3] m of the end effector."""
        return now.position[:, -1] - self.OFFSET

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
    arm: ClassVar = ARM

    WIDEST: ClassVar[float] = 0.04  # m, how far a finger opens
    OPENED: ClassVar[float] = 0.088  # m, how far a free finger moves in a step at full action
    # m, half the size of a finger along x, y and z, and its middle above the end effector
    HALF_DEPTH, HALF, HALF_LENGTH, MIDDLE = 0.0105, 0.01, 0.025, 0.0167
    OFFSET: ClassVar = np.array([0.0, 0.0, MIDDLE])
    # chosen: slow enough that the hand doesn't jerk in a step, which threw cubes out of the grip
    SERVO: ClassVar = Servo(50.0, 1.0)
    FORCE: ClassVar[float] = 1e4  # N, chosen: it holds what the grip holds
    # N of each finger, chosen. The original's motors press with up to 170 N, which would squash the
    # object here
    GRIP: ClassVar[float] = 80.0
    # so that the grip holds as well as 170 N with the original's coefficient of 0.5
    FRICTION: ClassVar[float] = 4.5

    def drive(self) -> Gripper:
        """The gripper of a scene."""
        return Gripper(
            Box((self.HALF_DEPTH, self.HALF, self.HALF_LENGTH)), mass=0.5 * MASS,
            force_limit=self.FORCE, grip_limit=self.GRIP,
            position=tuple(ARM.start_pose[0] + self.OFFSET), distance=2.0 * self.HALF,
            frequency=self.SERVO.frequency, damping_ratio=self.SERVO.damping,
            material=Material(self.FRICTION, restitution=0.0), name="hand",
            group=HAND, mask=OBJECT,
        )  # fmt: skip

    def act(self, world: World, now: Readout, actions: Array, frame: float, solids: Solids) -> None:
        """Plans the path of hand and fingers for actions [count, 4]; a grip of -1 closes."""
        position, opening = self.position(now), self.opening(now)
        tips = np.stack([position, position], axis=1)
        tips[:, :, 1] += (opening + 0.5 * TIP_WIDTH)[:, None] * (-1.0, 1.0)
        below = support(now, tips, 0.5 * TIP_WIDTH, solids)
        plan(world, position, self.velocity(now), actions, frame, below)
        moved = np.clip(opening + self.OPENED * actions[:, 3], 0.0, self.WIDEST) - opening
        world.memory("fingers", 1)[:, 0] = moved / ARM.parts
        self.proceed(world, now, 0, frame)

    def proceed(self, world: World, now: Readout, part: int, frame: float) -> None:
        """Moves the hand along its path, and its fingers, for a part of a step."""
        time, substep, velocity = frame / ARM.parts, world.fidelity.substep, self.velocity(now)
        moved, end, _ = path(world, part)
        ahead, speed = self.SERVO.moving(time, substep, velocity, moved, end)
        fingers, more = now.linear_velocity[:, -2:, 1], world.memory("fingers", 1)[:, 0]
        opening = np.clip(self.opening(now) + more, 0.0, self.WIDEST) - self.opening(now)
        closing = 0.5 * (fingers[:, 0] - fingers[:, 1])
        opening = self.opening(now) + self.SERVO.ahead(time, substep, opening, -closing)
        pads = self.pads(self.position(now) + ahead, opening)
        move_set_points(world, pads, speed[:, None], time)

    def place(self, world: World, worlds: Array, position: Array) -> None:
        """Tells the arm that hands were moved, see `Arm.place`."""
        ARM.place(world, worlds, position)

    def pads(self, position: Array, opening: Array) -> Array:
        """Positions [n, 2, 3] m of the fingers of hands at [n, 3] m, each [n] m open."""
        pads = np.stack([position + self.OFFSET] * 2, axis=1)
        pads[:, 0, 1] -= self.HALF + opening
        pads[:, 1, 1] += self.HALF + opening
        return pads

    def position(self, now: Readout) -> Array:
        """Position [count, 3] m of the end effector."""
        return 0.5 * (now.position[:, -2] + now.position[:, -1]) - self.OFFSET

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
    asked = STRIDE * actions[:, :3]
    asked[:, 2] = np.maximum(asked[:, 2], -position[:, 2])
    return np.asarray(asked)


def plan(
    world: World, position: Array, velocity: Array, actions: Array, frame: float, below: Array
) -> None:
    """Keeps the path of hands [count] in the world's memory, for `path`."""
    asked = asked_displacement(position, actions)
    free = ARM.respond(world, position, velocity, asked, frame, below)
    kept = world.memory("path", 6 * ARM.parts + 1)
    moved = np.diff(free.moved, axis=1, prepend=0.0)
    kept[:, :-1] = np.concatenate([moved, free.end], axis=2).reshape(world.count, -1)
    kept[:, -1] = np.where(below > 0.0, free.load, 0.0)  # the engine has objects, but no table


def path(world: World, part: int) -> tuple[Array, Array, Array]:
    """Displacement [count, 3] m in a part of the step, velocity then, and force on objects, N."""
    kept = world.memory("path", 6 * ARM.parts + 1)
    one = kept[:, 6 * part : 6 * (part + 1)]
    return one[:, :3], one[:, 3:], kept[:, -1]


def support(now: Readout, tips: Array, width: float, solids: Solids) -> Array:
    """Height [count] m of the highest body on which a finger would come to stand; 0: the table.

    Args:
        now: state of the bodies, taken as not turned.
        tips: [count, k, 3] m, of the fingers.
        width: m, half that of a tip along y.
        solids: of the bodies.
    """
    found = np.zeros(len(tips))
    for body, (half, height) in enumerate(solids):
        offset = tips - now.position[:, body, None]
        over = (
            (np.abs(offset[:, :, 0]) < half + TIP_DEPTH)
            & (np.abs(offset[:, :, 1]) < half + width)
            & (offset[:, :, 2] > height)
        ).any(axis=1)
        top = now.position[:, body, 2] + height
        found = np.maximum(found, np.where(over, top, 0.0))
    return found

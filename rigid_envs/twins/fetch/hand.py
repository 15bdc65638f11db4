"""The hand of the Fetch robot.

Its arm says how it moves, see `weld`; under load it hangs back, as a servo would whose frequency
and damping `python -m benchmarks.twins identify` finds from recorded motions. The table stops a
hand that presses on it, softly, and brakes it: a fast one as Coulomb friction would; a slow one
creeps, braked in proportion to its speed. Frames: x forward, y left, z up.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from physics import Box, Drive, Gripper, Material, Readout, World
from rigid_envs.twins.arms.arm import Arm
from rigid_envs.twins.fetch.pyramid import friction
from rigid_envs.twins.servo import Servo, move_set_points

Array = np.ndarray
Vector = tuple[float, float, float]

STRIDE = 0.05  # m, displacement along each axis that an action asks for

# identified
SERVO = Servo(55.8, 1.09)
# of a hand that presses on the table: loss of displacement along the table per lack of displacement
# downwards where it slides, and the part that is lost where it creeps
SLIDING, CREEPING = 0.96, 0.54
# a hand on the table sinks by so many m per m of displacement that it lacks downwards beyond FIRM m
SINKING, FIRM = 0.16, 5.7e-3
# friction holds fingers of a hand that presses: up to so many m from their set point per m of
# displacement that it lacks downwards. Held ones creep by this part of the distance in a step
HOLDING, FINGER_CREEPING = 3.7, 0.012

# from the originals' model. Boxes of fingers are 1 mm larger: their contacts begin at that distance
MARGIN = 1e-3  # m
TABLE = 0.4  # m, height of its top
ABOVE_GRIP = 0.02  # m, of the fingers' middle over the grip site, whose position is observed
HALF_LENGTH, HALF_DEPTH, HALF_WIDTH = 0.0385, 0.0135, 0.007  # m, of a finger along z, x and y
RESTING = TABLE + HALF_LENGTH + MARGIN - ABOVE_GRIP  # m, height of a hand that rests on the table
CLEAR = 2e-3  # m, chosen: a hand that is so far above it doesn't press
CLOSED = 0.0079  # m along y, of a closed finger's middle from the hand's
WIDEST = 0.05  # m, how far a finger opens
FRICTION = 1.0
# a finger is a mass of 104 kg, with its motor's inertia, on a spring of 30 kN/m with a damper
FINGER = Servo((30e3 / 104.0) ** 0.5, 1e3 / (2.0 * (30e3 * 104.0) ** 0.5))
FARTHEST = 0.2  # m, of a finger's set point
# chosen for the first steps of FetchSlide: how soon rising hands leave the table, see `lifted`
LEAVING = 0.5

# groups: the object and the table, and the hand; the arm knows the table under a hand
OBJECT, HAND = 1, 2
# contacts of the hand begin 1 mm below its fingers, not above them: half of it belongs to a length
_OFFSET = np.array([0.0, 0.0, ABOVE_GRIP - 0.5 * MARGIN])
_HALF_Z = HALF_LENGTH + 0.5 * MARGIN

ACTIONS = ("hand x", "hand y", "hand z", "grip")


@dataclass(frozen=True)
class ClosedHand:
    """The closed fingers, one box.

    Args:
        arm: what carries it.
    """

    arm: Arm

    # kg, chosen, not measured. By the model's inverse weight and impedance the original's hand
    # weighs some 400 kg to what it meets; a lighter one squashes an object less that is in the way
    MASS: ClassVar[float] = 40.0

    @property
    def start(self) -> Array:
        """Position [3] m of the grip site at the start of an episode."""
        return self.arm.start_pose[0]

    def drive(self) -> Drive:
        """The drive of a scene."""
        return Drive(
            Box((HALF_DEPTH + MARGIN, CLOSED + HALF_WIDTH + MARGIN, _HALF_Z)),
            mass=self.MASS, force_limit=1e6, position=tuple(self.start + _OFFSET),
            frequency=SERVO.frequency, damping_ratio=SERVO.damping,
            material=Material(FRICTION, restitution=0.0), name="hand",
            group=HAND, mask=OBJECT,
        )  # fmt: skip

    def act(self, world: World, now: Readout, actions: Array, frame: float) -> None:
        """Moves the hand by actions [count, 4]; the last component has no effect."""
        ahead, speed, _ = _follow(self, world, now, actions, frame)
        move_set_points(world, (now.position[:, -1] + ahead)[:, None], speed[:, None], frame)

    def position(self, now: Readout) -> Array:
        """Position [count, 3] m of the grip site."""
        return now.position[:, -1] - _OFFSET

    def velocity(self, now: Readout) -> Array:
        """Velocity [count, 3] m/s."""
        return now.linear_velocity[:, -1]

    def fingers(self, now: Readout) -> tuple[float, float]:
        """How far each finger is open, m, and its velocity, m/s: they are held closed."""
        return 0.0, 0.0


@dataclass(frozen=True)
class OpenHand:
    """Two fingers that open and close; both always do the same.

    Args:
        arm: what carries it.
    """

    arm: Arm

    # kg, chosen: light enough that the limited grip still closes the fingers in a few steps
    MASS: ClassVar[float] = 10.0
    # N of each finger, chosen. The original's spring presses with up to 720 N, which would squash
    # the object here
    GRIP: ClassVar[float] = 150.0

    @property
    def start(self) -> Array:
        """Position [3] m of the grip site at the start of an episode."""
        return self.arm.start_pose[0]

    def drive(self) -> Gripper:
        """The gripper of a scene."""
        return Gripper(
            Box((HALF_DEPTH + MARGIN, HALF_WIDTH + MARGIN, _HALF_Z)),
            mass=0.5 * self.MASS, force_limit=1e6, grip_limit=self.GRIP,
            position=tuple(self.start + _OFFSET), distance=2.0 * CLOSED,
            frequency=SERVO.frequency, damping_ratio=SERVO.damping,
            material=Material(FRICTION, restitution=0.0), name="hand",
            group=HAND, mask=OBJECT,
        )  # fmt: skip

    def act(self, world: World, now: Readout, actions: Array, frame: float) -> None:
        """Moves the hand and its fingers by actions [count, 4]; a grip of -1 closes."""
        ahead, speed, below = _follow(self, world, now, actions, frame)
        opening, velocity = self.fingers(now)
        target = np.clip(opening + actions[:, 3], 0.0, FARTHEST)
        moved, end = fingers_move(target - opening, velocity, below, frame)
        reached = np.clip(opening + moved, 0.0, WIDEST)
        end = np.where(reached == opening + moved, end, 0.0)
        wider, opens = SERVO.moving(frame, world.fidelity.substep, velocity, reached - opening, end)
        speeds = np.stack([speed, speed], axis=1)
        speeds[:, :, 1] += opens[:, None] * (-1.0, 1.0)
        start = self.pads(self.position(now) + ahead, opening + wider)
        move_set_points(world, start, speeds, frame)

    def place(self, world: World, worlds: Array, position: Array) -> None:
        """Tells the arm that hands were moved, see `Arm.place`."""
        self.arm.place(world, worlds, position)

    def pads(self, position: Array, opening: Array) -> Array:
        """Positions [n, 2, 3] m of the fingers of hands at [n, 3] m, each [n] m open."""
        pads = np.stack([position + _OFFSET] * 2, axis=1)
        pads[:, 0, 1] -= CLOSED + opening
        pads[:, 1, 1] += CLOSED + opening
        return pads

    def position(self, now: Readout) -> Array:
        """Position [count, 3] m of the grip site."""
        return 0.5 * (now.position[:, -2] + now.position[:, -1]) - _OFFSET

    def velocity(self, now: Readout) -> Array:
        """Velocity [count, 3] m/s."""
        return 0.5 * (now.linear_velocity[:, -2] + now.linear_velocity[:, -1])

    def opening(self, now: Readout) -> Array:
        """How far each finger is open, [count] m."""
        return self.fingers(now)[0]

    def fingers(self, now: Readout) -> tuple[Array, Array]:
        """How far each finger is open [count], m, and its velocity [count], m/s."""
        position, velocity = now.position[:, -2:, 1], now.linear_velocity[:, -2:, 1]
        return (
            0.5 * (position[:, 1] - position[:, 0]) - CLOSED,
            0.5 * (velocity[:, 1] - velocity[:, 0]),
        )


def _follow(
    hand: ClosedHand | OpenHand, world: World, now: Readout, actions: Array, frame: float
) -> tuple[Array, Array, Array]:
    """How the set point must move for actions [n, 4] to have the arm's answer.

    Returns:
        How far ahead of the hand it starts, [n, 3] m, its velocity, [n, 3] m/s, and which
        displacement downwards the hand lacks because it meets the table, [n] m.
    """
    position, velocity = hand.position(now), hand.velocity(now).astype(float)
    free = hand.arm.respond(world, position, velocity, STRIDE * actions[:, :3], frame)
    moved, end = free.moved[:, 0], free.end[:, 0]
    kept = braked(position[:, 2], moved)
    moved[:, :2] *= kept
    end[:, :2] *= kept
    out, below = lifted(position[:, 2], moved[:, 2])
    moved[:, 2] += out + below - sunk(below)
    end[:, 2] = np.where(below > 0.0, 0.0, end[:, 2])
    return *SERVO.moving(frame, world.fidelity.substep, velocity, moved, end), below


def lifted(height: Array, rising: Array) -> tuple[Array, Array]:
    """How far the table pushes out hands that begin in it, and what it denies to those that sink.

    One that rises as far as it is deep in the table is pushed out by exp(-LEAVING) of that depth.

    Args:
        height: [n] m, of the hands.
        rising: [n] m, displacement upwards in a step of hands that meet no table.

    Returns:
        [n] m and [n] m.
    """
    deep = np.maximum(RESTING - height, 0.0)
    out = deep * np.exp(-LEAVING * np.maximum(rising, 0.0) / np.maximum(deep, 1e-9))
    return out, np.maximum(RESTING - np.maximum(height, RESTING) - rising, 0.0)


def sunk(below: Array, sinking: float = SINKING, firm: float = FIRM) -> Array:
    """How deep [n] m hands sink into the table.

    Args:
        below: [n] m, which displacement downwards they lack because of it.
        sinking: see `SINKING`.
        firm: m, see `FIRM`.
    """
    return sinking * np.maximum(below - firm, 0.0)


def fingers_move(
    ahead: Array,
    velocity: Array,
    below: Array,
    frame: float,
    holding: float = HOLDING,
    creeping: float = FINGER_CREEPING,
) -> tuple[Array, Array]:
    """Displacement [n] m of fingers in a step that meet no object, and velocity [n] m/s at its end.

    Args:
        ahead: [n] m, of their set points from them.
        velocity: [n] m/s.
        below: [n] m, which displacement downwards the hand lacks because it meets the table.
        frame: s, duration of a step.
        holding: see `HOLDING`.
        creeping: see `FINGER_CREEPING`.
    """
    excess = np.maximum(np.abs(ahead) - holding * below, 0.0)
    held = np.copysign(np.abs(ahead) - excess, ahead)
    moved, end = FINGER.answer(frame, ahead - held, np.where(excess > 0.0, velocity, 0.0))
    return moved + creeping * held, end


def braked(
    height: Array, moved: Array, sliding: float = SLIDING, creeping: float = CREEPING
) -> Array:
    """Which part [n, 2] of a displacement along x and y is left to hands that press on the table.

    Args:
        height: [n] m, of the hands.
        moved: [n, 3] m, displacement in a step of hands that meet no table.
        sliding: see `SLIDING`.
        creeping: see `CREEPING`.
    """
    along = moved[:, :2] + 1e-9
    out, below = lifted(height, moved[:, 2])
    pressed = sliding * (out + below + 1e-9)
    loss = friction(along, pressed[:, None], creeping)
    size = np.abs(loss).sum(axis=1, keepdims=True)
    most = 1.0 / np.sqrt((creeping * np.abs(along).sum(axis=1)) ** -2 + pressed**-2)
    return 1.0 + loss / size * most[:, None] / along

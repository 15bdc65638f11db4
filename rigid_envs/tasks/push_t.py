"""PushT: a finger pushes a T over the ground to a pose, as in gym-pusht."""

from collections.abc import Sequence

import numpy as np

from physics import Body, Box, Compound, Ground, Material, Readout, Scene, World
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Ghost, Marker
from rigid_envs.tasks.coverage import BAR, STEM, uncovered
from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.goals import distance
from rigid_envs.tasks.rewards import Reward
from rigid_envs.tasks.task import Task

Array = np.ndarray

HALF_HEIGHT = 0.015  # m, of the T
MASS = 0.2  # kg, of the T
FRICTION = 0.5  # Coulomb's coefficient of all pairs
GRAVITY = 9.81  # m/s^2
LEVEL = 0.016  # m, height of the finger's centre: it does not touch the ground
UNCOVERED = 0.1  # largest part of the goal that is not covered when the task is solved
GOAL_YAW = 0.25 * np.pi  # rad; the goal's centre is the origin
RANGE = 0.1  # m, largest offset of the T's start from the origin along x and y
FINGER_START = 0.14  # m, from the T's centre
STARTS = 2  # poses drawn per episode; the first one that covers little of the goal is used
UNCOVERED_START = 0.3  # least part of the goal that is not covered at the start
SHAPE = Compound(
    [
        (Box((half_width, half_height, HALF_HEIGHT)), (0.0, middle, 0.0))
        for middle, half_width, half_height in (BAR, STEM)
    ]
)
GYRATION = float(np.sqrt(SHAPE.inertia(1.0)[2]))  # m, radius of gyration about the vertical axis


class PushT(Task):
    """The T lies within 10 cm of the goal along x and y; solved when it covers 90 % of the goal."""

    finger = Finger((-0.2, 0.0, LEVEL), (-0.25, -0.25, LEVEL), (0.25, 0.25, LEVEL), 0.04)
    camera = Camera.around((0.0, -0.05, 0.0), 1.03, azimuth=-90.0, elevation=65.0)

    max_episode_steps = 100
    actions = finger.actions[:2]
    bounds = (
        *((f"finger {a}", "m", -0.5, 0.5) for a in "xy"),
        *((f"finger velocity {a}", "m/s", -20.0, 20.0) for a in "xy"),
        *((f"T {a}", "m", -1.0, 1.0) for a in "xy"),
        *((f"T yaw {name}", "", -1.0, 1.0) for name in ("cosine", "sine")),
        *((f"T velocity {a}", "m/s", -20.0, 20.0) for a in "xy"),
        ("T angular velocity z", "rad/s", -1000.0, 1000.0),
        *((f"finger {a} in the T's frame", "m", -1.5, 1.5) for a in "xy"),
    )
    goal_bounds = (
        *((f"T {a}", "m", -1.0, 1.0) for a in "xy"),
        *((f"T yaw {name}", "", -1.0, 1.0) for name in ("cosine", "sine")),
    )
    draw_count = 3 * STARTS + 1  # x, y and yaw of each pose; direction of the finger
    reward = Reward(
        UNCOVERED, {"success": 1.0, "distance": 1.0, "pose": 10.0, "reach": 1.0}, measure=uncovered
    )

    def scene(self) -> Scene:
        """A T on the ground, and a finger beside it."""
        material = Material(friction=FRICTION, restitution=0.1)
        body = Body(SHAPE, mass=MASS, position=(0, 0, HALF_HEIGHT), material=material, name="T")
        ground = Ground(material=material, name="ground")
        return Scene(bodies=[body], statics=[ground], drives=[self.finger.drive()])

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """T at a random pose, finger 14 cm from its centre in a random direction."""
        n, worlds = len(draws), np.arange(len(draws))
        goal = np.array([0.0, 0.0, np.cos(GOAL_YAW), np.sin(GOAL_YAW)])
        drawn = draws[:, : 3 * STARTS].reshape(n, STARTS, 3)
        yaw = 2.0 * np.pi * drawn[:, :, 2]
        place = RANGE * (2.0 * drawn[:, :, :2] - 1.0)
        poses = np.concatenate([place, np.stack([np.cos(yaw), np.sin(yaw)], axis=2)], axis=2)
        # the last resort is a corner
        poses = np.concatenate([poses, np.tile([RANGE, RANGE, 1.0, 0.0], (n, 1, 1))], axis=1)
        valid = distance(poses, goal, uncovered) > UNCOVERED_START
        pose = poses[worlds, np.argmax(valid, axis=1)]
        half_yaw = 0.5 * np.arctan2(pose[:, 3], pose[:, 2])
        position, orientation = np.zeros((n, 1, 3)), np.zeros((n, 1, 4))
        position[:, 0, :2], position[:, 0, 2] = pose[:, :2], HALF_HEIGHT
        orientation[:, 0, 2], orientation[:, 0, 3] = np.sin(half_yaw), np.cos(half_yaw)
        direction = 2.0 * np.pi * draws[:, -1]
        finger = np.full((n, 1, 3), LEVEL)
        finger[:, 0, 0] = pose[:, 0] + FINGER_START * np.cos(direction)
        finger[:, 0, 1] = pose[:, 1] + FINGER_START * np.sin(direction)
        world.reset(mask)
        world.set_state(
            position=position, orientation=orientation, drive_position=finger, worlds=mask
        )
        return np.tile(goal, (n, 1))

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the finger in the plane by up to 4 cm along x and y, within its workspace."""
        self.finger.act(world, now, np.pad(actions, ((0, 0), (0, 1))), self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Finger; pose and velocity of the T; the finger in the T's frame."""
        finger = self.finger.position(now)
        out[:, 0:2], out[:, 2:4] = finger[:, :2], now.linear_velocity[:, -1, :2]
        out[:, 4:8] = pose = self.achieved(world, now)
        out[:, 8:10], out[:, 10] = now.linear_velocity[:, 0, :2], now.angular_velocity[:, 0, 2]
        offset = finger[:, :2] - pose[:, :2]
        out[:, 11] = pose[:, 2] * offset[:, 0] + pose[:, 3] * offset[:, 1]
        out[:, 12] = pose[:, 2] * offset[:, 1] - pose[:, 3] * offset[:, 0]

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the T, and cosine and sine of its yaw."""
        x, y, z, w = now.orientation[:, 0].T
        axis = np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w)], axis=1)
        return np.concatenate([now.position[:, 0, :2], axis], axis=1)

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`pose`: minus the distance in m of the T's points from where they are at the goal.

        `reach`: minus the distance in m from the finger to the T's centre.
        """
        a, b = achieved.astype(float), desired.astype(float)
        pose = pose_distance(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1], turn_between(a, b))
        offset = self.finger.position(now)[:, :2] - a[:, :2]
        return {"pose": -pose, "reach": -np.sqrt(np.sum(offset**2, axis=1))}

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """The T at its goal."""
        half_yaw = 0.5 * np.arctan2(goal[3], goal[2])
        turn = np.array([0.0, 0.0, np.sin(half_yaw), np.cos(half_yaw)])
        return [
            Ghost(
                np.array([half_width, half_height, HALF_HEIGHT]),
                np.array([goal[0] - middle * goal[3], goal[1] + middle * goal[2], HALF_HEIGHT]),
                orientation=turn,
            )
            for middle, half_width, half_height in (BAR, STEM)
        ]


def turn_between(a: Array, b: Array) -> Array:
    """Angle [n] rad, within +-pi, from the yaw of poses b [n, 4] to that of poses a."""
    return np.asarray(
        np.arctan2(a[:, 3] * b[:, 2] - a[:, 2] * b[:, 3], a[:, 2] * b[:, 2] + a[:, 3] * b[:, 3])
    )


def pose_distance(x: Array, y: Array, turn: Array) -> Array:
    """How far [...] m the points of a T move, as the root of their mean square.

    A point at the distance r from the centre of mass moves by 2 r sin(turn / 2) with the turn,
    which leaves the centre where it is. The mean of r^2 is the square of the radius of gyration.

    Args:
        x: [...] m, by which the centre of mass moves along x.
        y: [...] m, by which it moves along y.
        turn: [...] rad.
    """
    return np.asarray(np.sqrt(x * x + y * y + (2.0 * GYRATION * np.sin(0.5 * turn)) ** 2))

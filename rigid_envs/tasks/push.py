"""Push: a finger on a carriage pushes a cube over the ground to a goal."""

import numpy as np

from physics import Body, Box, Drive, Ground, Material, Readout, Scene, Sphere, World
from rigid_envs.camera import Camera
from rigid_envs.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

HALF = 0.02  # m, half the cube's width
MASS = 0.1  # kg
FINGER = 0.015  # m, radius
HOME = (0.0, 0.0, 0.12)  # m, of the finger
LOW, HIGH = np.array([-0.25, -0.25, FINGER]), np.array([0.25, 0.25, 0.25])  # m, of the carriage
STRIDE = 0.05  # m a step at full action
RANGE = 0.15  # m, of starts and goals from the origin, each axis
THRESHOLD = 0.05  # m
# goals drawn for an episode; the first that isn't solved at the start is taken
TRIES = 6


class Push(Task):
    """Cube and goal lie anywhere within 15 cm of the origin; solved within 5 cm of the goal."""

    actions = ("finger x", "finger y", "finger z")
    bounds = (
        *((f"finger {a}", "m", -0.5, 0.5) for a in "xyz"),
        *((f"finger velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"cube {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"cube quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"cube velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"cube angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"finger to cube {a}", "m", -1.5, 1.5) for a in "xyz"),
    )
    goal_bounds = tuple((f"cube {a}", "m", -1.0, 1.0) for a in "xyz")
    draws = 3 + 2 * TRIES
    camera = Camera(target=(-0.03, -0.04, 0.15), distance=1.28)
    reward = Reward(THRESHOLD, {"success": 1.0, "distance": 10.0, "reach": 3.0})
    sizes = True

    def scene(self) -> Scene:
        """A cube on the ground, and a finger above it."""
        material = Material(friction=0.5, restitution=0.1)
        return Scene(
            bodies=[Body(Box((HALF,) * 3), mass=MASS, position=(0, 0, HALF), material=material)],
            statics=[Ground(material=material)],
            drives=[Drive(Sphere(FINGER), mass=0.05, force_limit=2.5, position=HOME)],
        )

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Cube at a random place and yaw, finger at home, goal away from the cube."""
        n = len(draws)
        height = np.full(n, HALF)
        if world.features.varied:
            height *= world.parameters.size[mask, 0]
        position = np.zeros((n, 1, 3))
        position[:, 0, 2] = height
        position[:, 0, :2] = RANGE * (2.0 * draws[:, :2] - 1.0)
        half_yaw = np.pi / 4.0 * draws[:, 2]  # a cube looks the same after a quarter turn
        orientation = np.zeros((n, 1, 4))
        orientation[:, 0, 2], orientation[:, 0, 3] = np.sin(half_yaw), np.cos(half_yaw)
        world.reset(mask)
        world.set_state(position=position, orientation=orientation, worlds=mask)

        goals = np.zeros((n, TRIES + 1, 3))
        goals[:, :, 2] = height[:, None]
        goals[:, :TRIES, :2] = RANGE * (2.0 * draws[:, 3:].reshape(n, TRIES, 2) - 1.0)
        # should all of them be too near, the point opposite the origin from the far corner is not
        goals[:, TRIES, :2] = np.where(position[:, 0, :2] > 0.0, -RANGE, RANGE)
        away = distance(goals, position) > THRESHOLD + 0.01
        return goals[np.arange(n), np.argmax(away, axis=1)]

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the finger by up to 5 cm along each axis, within its workspace."""
        finger = now.position[:, 1]
        target = np.minimum(np.maximum(finger + STRIDE * actions, LOW), HIGH)
        world.command_drives(((target - finger) / self.frame)[:, None])

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Poses and velocities of finger and cube, and the way from one to the other."""
        rows = now.rows
        out[:, 0:3], out[:, 3:6] = rows[:, 1, 0:3], rows[:, 1, 7:10]
        out[:, 6:19] = rows[:, 0]
        np.subtract(rows[:, 0, :3], rows[:, 1, :3], out=out[:, 19:22], casting="same_kind")

    def achieved(self, world: World, now: Readout) -> Array:
        """Where the cube is."""
        return now.position[:, 0]

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, apart: Array
    ) -> dict[str, Array]:
        """`reach`: m, minus the finger's way to the cube's side that faces away from the goal."""
        away = achieved - desired
        ratio = (1.6 * HALF + FINGER) / np.maximum(apart, 1e-6)
        behind = achieved + away * ratio[:, None]
        return {"reach": -distance(now.position[:, 1], behind)}

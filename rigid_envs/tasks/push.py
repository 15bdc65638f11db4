"""Push: a finger on a carriage pushes a block over the ground to a goal."""

from collections.abc import Sequence

import numpy as np

from physics import (
    Body,
    Capsule,
    Compound,
    Drive,
    Ground,
    Material,
    Readout,
    Scene,
    Sphere,
    Static,
    World,
)
from physics.scene.validation import instance, integer
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Sign
from rigid_envs.tasks.block import HALF, Block
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

MASS = 0.1  # kg
FINGER = 0.015  # m, radius
HOME = (0.0, 0.0, 0.12)  # m, of the finger
LOW, HIGH = np.array([-0.25, -0.25, FINGER]), np.array([0.25, 0.25, 0.25])  # m, of the carriage
STRIDE = 0.05  # m a step at full action
RANGE = 0.15  # m, of starts and goals from the origin, each axis
THRESHOLD = 0.05  # m
# goals drawn for an episode; the first that isn't solved at the start is taken
TRIES = 6
# m, length of a heading; at the threshold's length, 15 degrees of yaw are just within it
ARM = THRESHOLD
# m, where posts stand, in the order in which they are set up
POSTS = 0.075 * np.array([[1.0, 1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0]])
POST_RADIUS, POST_HEIGHT = 0.015, 0.05  # m
# m, least distance of starts and goals from a post: at any yaw, a cube there doesn't touch it
CLEAR = 0.05


class Push(Task):
    """Block and goal lie anywhere within 15 cm of the origin; solved within 5 cm of the goal.

    Args:
        block: what is pushed: "cube", "t", or a Compound as it is to lie on the ground.
        target_yaw: whether the goal asks for a yaw too, which counts as solved within 15 degrees.
        obstacles: number of posts that stand in the way, 0 to 4.
    """

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
    # a larger cube would reach up to the finger at home, and leave no place clear of all posts
    sizes = (0.0, 2.5)

    def __init__(
        self, target_yaw: bool = False, obstacles: int = 0, block: str | Compound = "cube"
    ) -> None:
        """Adds what the options ask for to the goal and to the draws of a start."""
        self.block = Block.of(block)
        self.target_yaw = bool(instance("target_yaw", target_yaw, bool))
        self.obstacles = integer("obstacles", obstacles, low=0)
        if self.obstacles > len(POSTS):
            raise ValueError(f"obstacles must be at most {len(POSTS)}, got {obstacles!r}")
        if not self.block.cube:
            if self.target_yaw:
                raise ValueError(
                    f"target_yaw=True asks for the yaw of a cube: leave it out with block={block!r}"
                )
            room = min(2.0 * HALF / self.block.top, np.sqrt(2.0) * HALF / self.block.radius)
            self.sizes = (0.0, Push.sizes[1] * float(room))  # no larger than the largest cube
            self.bounds = _of_block(Push.bounds)
            self.goal_bounds = _of_block(Push.goal_bounds)
        if self.target_yaw:
            heading = tuple((f"cube heading {a}", "m", -2.0 * ARM, 2.0 * ARM) for a in "xy")
            self.goal_bounds = Push.goal_bounds + heading
            self.draws += 1
        if self.obstacles:
            self.draws += 2 * TRIES

    def scene(self) -> Scene:
        """A block on the ground, a finger above it, and posts."""
        material = Material(friction=0.5, restitution=0.1)
        post = Capsule(POST_RADIUS, 0.5 * POST_HEIGHT - POST_RADIUS)
        posts = [
            Static(post, (x, y, 0.5 * POST_HEIGHT), material=material)
            for x, y in POSTS[: self.obstacles]
        ]
        return Scene(
            bodies=[
                Body(
                    self.block.shape,
                    mass=MASS,
                    position=(0, 0, self.block.height),
                    material=material,
                )
            ],
            statics=[Ground(material=material), *posts],
            drives=[Drive(Sphere(FINGER), mass=0.05, force_limit=2.5, position=HOME)],
        )

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Block at a random place and yaw, finger at home, goal away from the block.

        Neither lies near a post.
        """
        n = len(draws)
        drawn, more = draws[:, : Push.draws], draws[:, Push.draws :]
        height = np.full(n, self.block.height)
        if world.features.varied:
            height *= world.parameters.size[mask, 0]
        position = np.zeros((n, 1, 3))
        position[:, 0, 2] = height
        position[:, 0, :2] = RANGE * (2.0 * drawn[:, :2] - 1.0)
        if self.obstacles:
            places = np.zeros((n, TRIES + 2, 2))  # the last, the origin, is clear of all posts
            places[:, 0] = position[:, 0, :2]
            places[:, 1:-1] = RANGE * (2.0 * more[:, : 2 * TRIES].reshape(n, TRIES, 2) - 1.0)
            clear = self._clear(places, height)
            position[:, 0, :2] = places[np.arange(n), np.argmax(clear, axis=1)]
        half_yaw = np.pi / self.block.turns * drawn[:, 2]  # more would look the same again
        orientation = np.zeros((n, 1, 4))
        orientation[:, 0, 2], orientation[:, 0, 3] = np.sin(half_yaw), np.cos(half_yaw)
        world.reset(mask)
        world.set_state(position=position, orientation=orientation, worlds=mask)

        goals = np.zeros((n, TRIES + 1, 3))
        goals[:, :, 2] = height[:, None]
        goals[:, :TRIES, :2] = RANGE * (2.0 * drawn[:, 3:].reshape(n, TRIES, 2) - 1.0)
        # should all of them be too near, the point opposite the origin from the far corner is not
        goals[:, TRIES, :2] = np.where(position[:, 0, :2] > 0.0, -RANGE, RANGE)
        away = distance(goals, position) > THRESHOLD + 0.01
        away &= self._clear(goals, height)
        goal = goals[np.arange(n), np.argmax(away, axis=1)]
        if not self.target_yaw:
            return goal
        fourfold = 2.0 * np.pi * more[:, -1]  # of a yaw of up to a quarter turn
        heading = ARM * np.stack([np.cos(fourfold), np.sin(fourfold)], axis=1)
        return np.concatenate([goal, heading], axis=1)

    def _clear(self, places: Array, height: Array) -> Array:
        """Which places [n, tries, 2 or 3] of blocks of so high a centre [n] aren't near a post."""
        clear = np.ones(places.shape[:2], dtype=bool)
        room = CLEAR - POST_RADIUS + (self.block.radius - np.sqrt(2.0) * HALF)
        least = POST_RADIUS + room / self.block.height * height[:, None]
        for post in POSTS[: self.obstacles]:
            clear &= np.sum((places[:, :, :2] - post) ** 2, axis=2) > least**2
        return clear

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the finger by up to 5 cm along each axis, within its workspace."""
        finger = now.position[:, 1]
        target = np.minimum(np.maximum(finger + STRIDE * actions, LOW), HIGH)
        world.command_drives(((target - finger) / self.frame)[:, None])

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Poses and velocities of finger and cube, and the way from one to the other."""
        finger, cube = now.position[:, 1], now.position[:, 0]
        out[:, 0:3], out[:, 3:6] = finger, now.linear_velocity[:, 1]
        out[:, 6:19] = now.kinematics[:, 0]
        out[:, 19:22] = cube - finger

    def achieved(self, world: World, now: Readout) -> Array:
        """Where the block is, and its heading if the goal asks for a yaw."""
        if not self.target_yaw:
            return now.position[:, 0]
        return np.concatenate([now.position[:, 0], heading(now.orientation[:, 0])], axis=1)

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, apart: Array
    ) -> dict[str, Array]:
        """`reach`: m, minus the finger's way to the block's side that faces away from the goal."""
        cube = achieved[:, :3]
        away = cube - desired[:, :3]
        if self.target_yaw:  # the goals' distance may be one of headings
            apart = np.sqrt(np.sum(away**2, axis=1))
        beside = 1.6 * HALF if self.block.cube else self.block.radius
        ratio = (beside + FINGER) / np.maximum(apart, 1e-6)
        behind = cube + away * ratio[:, None]
        return {"reach": -distance(now.position[:, 1], behind)}

    def signs(self, world: World, index: int, goal: Array) -> Sequence[Sign]:
        """The goal's place, and dots under the corners of a cube at the yaw that it asks for."""
        shown: list[Sign] = [Goal(goal[:3], THRESHOLD)]
        if self.target_yaw:
            corners = 0.25 * np.arctan2(goal[4], goal[3]) + np.pi / 4.0 * np.array([1, 3, 5, 7])
            dots = np.stack([np.cos(corners), np.sin(corners), np.zeros(4)], axis=1)
            foot = goal[:3] * (1.0, 1.0, 0.0)
            shown += [Goal(foot + np.sqrt(2.0) * HALF * dot, 0.15 * HALF) for dot in dots]
        return shown


def _of_block(
    bounds: tuple[tuple[str, str, float, float], ...],
) -> tuple[tuple[str, str, float, float], ...]:
    """The bounds of a cube as those of another block."""
    return tuple((name.replace("cube", "block"), *rest) for name, *rest in bounds)  # type: ignore[misc]


def heading(orientation: Array) -> Array:
    """Heading [n, 2] m of cubes by their quaternions [n, 4]; the same for all turns onto itself.

    With a cube's axes a, b and c, each seen from above as a complex number x + iy, it is
    ARM (a^4 + b^4 + c^4) / 2. A cube that lies flat on any face has one upright axis, which gives
    0, and two at its yaw, each of which gives exp(4i yaw): ARM (cos 4 yaw, sin 4 yaw). The heading
    of a tilted cube is shorter, down to 0 on a corner, where no yaw is to be seen.
    """
    x, y, z, w = np.asarray(orientation, dtype=float).T
    axes = np.array(
        [
            1.0 - 2.0 * (y * y + z * z) + 2.0j * (x * y + z * w),
            2.0 * (x * y - z * w) + 1.0j * (1.0 - 2.0 * (x * x + z * z)),
            2.0 * (x * z + y * w) + 2.0j * (y * z - x * w),
        ]
    )
    total = 0.5 * ARM * np.sum(axes**4, axis=0)
    return np.stack([total.real, total.imag], axis=1)

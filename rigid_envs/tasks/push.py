"""Push: a finger pushes a block over the ground to a goal."""

from collections.abc import Sequence

import numpy as np

from physics import (
    Body,
    Capsule,
    Compound,
    Ground,
    Material,
    Readout,
    Scene,
    Static,
    World,
)
from physics.scene.validation import instance, integer
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Marker
from rigid_envs.tasks.block import HALF, Block
from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Bounds, Task

Array = np.ndarray

MASS = 0.1  # kg, of the block
THRESHOLD = 0.05  # m
RANGE = 0.15  # m, largest offset of starts and goals from the origin along x and y
# goals drawn per episode; the first one that is not solved at the start is used
GOAL_DRAWS = 6

# m, length of a heading. With a length equal to the threshold, headings up to 15 degrees of yaw
# apart are within the threshold
HEADING_LENGTH = THRESHOLD

POSTS = 0.075 * np.array([[1.0, 1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0]])  # m, x and y
POST_RADIUS, POST_HEIGHT = 0.015, 0.05  # m
# m, least distance of starts and goals from the middle of a post: a cube fits there at any yaw
POST_CLEARANCE = 0.05


class Push(Task):
    """Block and goal lie within 15 cm of the origin along x and y; solved within 5 cm of the goal.

    Args:
        target_yaw: whether the goal includes a yaw of the cube. The task is then solved within 5 cm
            and 15 degrees.
        obstacles: number of fixed posts, 0 to 4.
        block: what is pushed: "cube", "t", or a Compound in the orientation in which it lies on the
            ground.
    """

    finger = Finger((0.0, 0.0, 0.12), (-0.25, -0.25, Finger.RADIUS), (0.25, 0.25, 0.25), 0.05)
    actions = finger.actions
    bounds = (
        *finger.bounds,
        *((f"cube {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"cube quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"cube velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"cube angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"finger to cube {a}", "m", -1.5, 1.5) for a in "xyz"),
    )
    goal_bounds = tuple((f"cube {a}", "m", -1.0, 1.0) for a in "xyz")
    draw_count = 3 + 2 * GOAL_DRAWS  # x, y and yaw of the block; x and y of each goal drawn
    camera = Camera.around((-0.03, -0.02, 0.04), 1.16, azimuth=-75.0, elevation=42.0)
    reward = Reward(THRESHOLD, {"success": 1.0, "distance": 10.0, "reach": 3.0})
    # a larger cube would touch the finger at home, and no place would be clear of all posts
    size_range = (0.0, 2.5)

    def __init__(
        self, target_yaw: bool = False, obstacles: int = 0, block: str | Compound = "cube"
    ) -> None:
        """Adapts bounds and draws to the arguments."""
        self.block = Block.of(block)
        self.target_yaw = bool(instance("target_yaw", target_yaw, bool))
        self.obstacles = integer("obstacles", obstacles, low=0)
        if self.obstacles > len(POSTS):
            raise ValueError(f"obstacles must be at most {len(POSTS)}, got {obstacles!r}")
        if not self.block.cube:
            if self.target_yaw:
                raise ValueError(
                    f"target_yaw=True supports only the cube: remove it, or block={block!r}"
                )
            room = min(2.0 * HALF / self.block.top, np.sqrt(2.0) * HALF / self.block.radius)
            # no larger than the largest cube
            self.size_range = (0.0, Push.size_range[1] * float(room))
            self.bounds = _block_bounds(Push.bounds)
            self.goal_bounds = _block_bounds(Push.goal_bounds)
        if self.target_yaw:
            high = 2.0 * HEADING_LENGTH
            heading_bounds = tuple((f"cube heading {a}", "m", -high, high) for a in "xy")
            self.goal_bounds = Push.goal_bounds + heading_bounds
            self.draw_count += 1
        if self.obstacles:
            self.draw_count += 2 * GOAL_DRAWS

    def scene(self) -> Scene:
        """A block on the ground, a finger above it, and posts."""
        material = Material(friction=0.5, restitution=0.1)
        post = Capsule(POST_RADIUS, 0.5 * POST_HEIGHT - POST_RADIUS)
        posts = [
            Static(post, (x, y, 0.5 * POST_HEIGHT), material=material, name=f"post {i}")
            for i, (x, y) in enumerate(POSTS[: self.obstacles])
        ]
        block = Body(
            self.block.shape,
            mass=MASS,
            position=(0, 0, self.block.height),
            material=material,
            name="block",
        )
        return Scene(
            bodies=[block],
            statics=[Ground(material=material, name="ground"), *posts],
            drives=[self.finger.drive()],
        )

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Block at a random position and yaw, finger at home, goal away from the block.

        Block and goal are clear of the posts.
        """
        n = len(draws)
        drawn, more = draws[:, : Push.draw_count], draws[:, Push.draw_count :]
        height = np.full(n, self.block.height)
        if world.features.per_world_parameters:
            height *= world.parameters.size[mask, 0]
        position = np.zeros((n, 1, 3))
        position[:, 0, 2] = height
        position[:, 0, :2] = RANGE * (2.0 * drawn[:, :2] - 1.0)
        if self.obstacles:
            places = np.zeros((n, GOAL_DRAWS + 2, 2))  # the last, the origin, is clear of all posts
            places[:, 0] = position[:, 0, :2]
            drawn_places = more[:, : 2 * GOAL_DRAWS].reshape(n, GOAL_DRAWS, 2)
            places[:, 1:-1] = RANGE * (2.0 * drawn_places - 1.0)
            clear = self._clear_of_posts(places, height)
            position[:, 0, :2] = places[np.arange(n), np.argmax(clear, axis=1)]
        half_yaw = np.pi / self.block.yaw_symmetry * drawn[:, 2]
        orientation = np.zeros((n, 1, 4))
        orientation[:, 0, 2], orientation[:, 0, 3] = np.sin(half_yaw), np.cos(half_yaw)
        world.reset(mask)
        world.set_state(position=position, orientation=orientation, worlds=mask)

        goals = np.zeros((n, GOAL_DRAWS + 1, 3))
        goals[:, :, 2] = height[:, None]
        drawn_goals = drawn[:, 3:].reshape(n, GOAL_DRAWS, 2)
        goals[:, :GOAL_DRAWS, :2] = RANGE * (2.0 * drawn_goals - 1.0)
        # the last resort is the corner of the square that is farthest from the block
        goals[:, GOAL_DRAWS, :2] = np.where(position[:, 0, :2] > 0.0, -RANGE, RANGE)
        valid = distance(goals, position) > THRESHOLD + 0.01
        valid &= self._clear_of_posts(goals, height)
        goal = goals[np.arange(n), np.argmax(valid, axis=1)]
        if not self.target_yaw:
            return goal
        four_yaw = 2.0 * np.pi * more[:, -1]  # of a yaw within a quarter turn
        goal_heading = HEADING_LENGTH * np.stack([np.cos(four_yaw), np.sin(four_yaw)], axis=1)
        return np.concatenate([goal, goal_heading], axis=1)

    def _clear_of_posts(self, places: Array, height: Array) -> Array:
        """Which places [n, tries, 2 or 3] m are clear of all posts.

        `height` [n] m is that of the block's centre in each world: the clearance scales with it.
        """
        clear = np.ones(places.shape[:2], dtype=bool)
        room = POST_CLEARANCE - POST_RADIUS + (self.block.radius - np.sqrt(2.0) * HALF)
        least = POST_RADIUS + room / self.block.height * height[:, None]
        for post in POSTS[: self.obstacles]:
            clear &= np.sum((places[:, :, :2] - post) ** 2, axis=2) > least**2
        return clear

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the finger by up to 5 cm along each axis, within its workspace."""
        self.finger.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Position and velocity of the finger; pose and velocity of the block; the offset to it."""
        self.finger.observe(now, out[:, 0:6])
        out[:, 6:19] = now.kinematics[:, 0]
        out[:, 19:22] = now.position[:, 0] - self.finger.position(now)

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the block, and its heading if the goal includes a yaw."""
        if not self.target_yaw:
            return now.position[:, 0]
        return np.concatenate([now.position[:, 0], heading(now.orientation[:, 0])], axis=1)

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`reach`: minus the distance in m from the finger to the point behind the block.

        Behind means on the far side as seen from the goal: there the finger pushes to the goal.
        """
        block = achieved[:, :3]
        from_goal = block - desired[:, :3]
        if self.target_yaw:  # the goal distance may be that of the headings
            goal_distance = np.sqrt(np.sum(from_goal**2, axis=1))
        radius = 1.6 * HALF if self.block.cube else self.block.radius
        ratio = (radius + Finger.RADIUS) / np.maximum(goal_distance, 1e-6)
        behind = block + from_goal * ratio[:, None]
        return {"reach": -distance(self.finger.position(now), behind)}

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """The goal; with `target_yaw`, also dots at the corners of a cube at the goal's yaw."""
        shown: list[Marker] = [Goal(goal[:3], THRESHOLD)]
        if self.target_yaw:
            corners = 0.25 * np.arctan2(goal[4], goal[3]) + np.pi / 4.0 * np.array([1, 3, 5, 7])
            dots = np.stack([np.cos(corners), np.sin(corners), np.zeros(4)], axis=1)
            foot = goal[:3] * (1.0, 1.0, 0.0)
            shown += [Goal(foot + np.sqrt(2.0) * HALF * dot, 0.15 * HALF) for dot in dots]
        return shown


def _block_bounds(bounds: Bounds) -> Bounds:
    """The bounds of a cube with the names of another block."""
    return tuple((name.replace("cube", "block"), *rest) for name, *rest in bounds)  # type: ignore[misc]


def heading(orientation: Array) -> Array:
    """Heading [n, 2] m of cubes, given their quaternions [n, 4].

    The heading is HEADING_LENGTH (cos 4 yaw, sin 4 yaw) for a cube that lies flat, on whichever
    face. It does not change if the cube is rotated onto itself.

    With the cube's axes a, b and c, each seen from above as a complex number x + iy, the heading is
    HEADING_LENGTH (a^4 + b^4 + c^4) / 2. Of a cube that lies flat, the vertical axis gives 0 and
    the two others give exp(4i yaw) each. The heading of a tilted cube is shorter. It is 0 for a
    cube on a corner, which has no yaw.
    """
    x, y, z, w = np.asarray(orientation, dtype=float).T
    axes = np.array(
        [
            1.0 - 2.0 * (y * y + z * z) + 2.0j * (x * y + z * w),
            2.0 * (x * y - z * w) + 1.0j * (1.0 - 2.0 * (x * x + z * z)),
            2.0 * (x * z + y * w) + 2.0j * (y * z - x * w),
        ]
    )
    total = 0.5 * HEADING_LENGTH * np.sum(axes**4, axis=0)
    return np.stack([total.real, total.imag], axis=1)

"""PickAndPlace: a gripper carries a cube to a goal on the ground or in the air."""

from collections.abc import Sequence

import numpy as np

from physics import Body, Box, Ground, Material, Readout, Scene, World
from physics.scene.validation import number
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Marker
from rigid_envs.tasks.grasping.grasps import NEAR_GRASP_DRAWS, grasp_terms, start_near_grasps
from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

HALF = 0.02  # m, half the width of the cube
MASS = 0.1  # kg
THRESHOLD = 0.02  # m
RANGE = 0.15  # m, largest offset of starts and goals from the origin along x and y
HIGHEST = 0.2  # m, of a goal above the ground
IN_AIR = 0.5  # probability of a goal in the air
MIN_DISTANCE = 0.06  # m, of a goal from the cube's start
GOAL_DRAWS = 4  # goals drawn per episode; the first one that is far enough is used


class PickAndPlace(Task):
    """Half of the goals lie up to 20 cm above the ground; solved within 2 cm of the goal.

    Args:
        near_grasp_start_prob: fraction of episodes that start with the open hand around the cube or
            just above it. These starts make training easier.
    """

    hand = Hand(home=(0.0, 0.0, 0.2), low=(-0.2, -0.2, 0.016), high=(0.2, 0.2, 0.3), stride=0.05)
    camera = Camera.around((0.0, 0.0, 0.1), distance=1.15, azimuth=-25.0, elevation=26.0)
    max_episode_steps = 50
    # a larger cube would leave the open fingers no clearance
    size_range = (0.5, 1.5)

    actions = hand.actions
    bounds = (
        *hand.bounds,
        *((f"cube {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"cube quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"cube velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"cube angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"hand to cube {a}", "m", -2.0, 2.0) for a in "xyz"),
    )
    goal_bounds = tuple((f"cube {a}", "m", -1.0, 1.0) for a in "xyz")
    # x and y of the cube; x, y, height and whether it is in the air of each goal
    draw_count = 2 + 4 * GOAL_DRAWS + NEAR_GRASP_DRAWS
    reward = Reward(
        THRESHOLD, {"success": 1.0, "distance": 10.0, "reach": 5.0, "grasp": 1.0}, time_penalty=1.5
    )

    def __init__(self, near_grasp_start_prob: float = 0.0) -> None:
        """Checks the fraction."""
        self.near_grasp_start_prob = number(
            "near_grasp_start_prob", near_grasp_start_prob, low=0.0, high=1.0
        )

    def scene(self) -> Scene:
        """A cube on the ground, and an open gripper above it."""
        material = Material(friction=0.5, restitution=0.1)
        cube = Body(
            Box((HALF,) * 3), mass=MASS, position=(0.0, 0.0, HALF), material=material, name="cube"
        )
        pads = Material(friction=2.0, restitution=0.0)
        return Scene(
            bodies=[cube],
            statics=[Ground(material, name="ground")],
            drives=[self.hand.gripper(self.hand.max_opening, pads)],
        )

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The cube at a random place, aligned with the fingers; hand at home; goal away from it."""
        n = len(draws)
        places, goal_draws, near = np.split(draws, [2, 2 + 4 * GOAL_DRAWS], axis=1)
        half = np.full(n, HALF)
        if world.features.per_world_parameters:
            half *= world.parameters.size[mask, 0]
        position = np.zeros((n, 1, 3))
        position[:, 0, :2], position[:, 0, 2] = RANGE * (2.0 * places - 1.0), half
        world.reset(mask)
        world.set_state(position=position, worlds=mask)
        start_near_grasps(
            world, mask, near, self.near_grasp_start_prob, self.pads, half, lowest=self.hand.low[2]
        )

        drawn = goal_draws.reshape(n, GOAL_DRAWS, 4)
        goals = np.zeros((n, GOAL_DRAWS + 1, 3))
        goals[:, :-1, :2] = RANGE * (2.0 * drawn[:, :, :2] - 1.0)
        goals[:, :-1, 2] = np.where(drawn[:, :, 3] < IN_AIR, HIGHEST * drawn[:, :, 2], 0.0)
        goals[:, :, 2] = np.maximum(goals[:, :, 2], half[:, None])
        # the last resort is the corner of the square that is farthest from the cube
        goals[:, -1, :2] = np.where(position[:, 0, :2] > 0.0, -RANGE, RANGE)
        away = distance(goals, np.broadcast_to(position, goals.shape)) > MIN_DISTANCE
        return goals[np.arange(n), np.argmax(away, axis=1)]

    def pads(self, hand: Array, opening: Array) -> Array:
        """Positions [n, 2, 3] m of pads of hands at [n, 3] m, each `opening` [n] m from there."""
        return self.hand.pad_positions(hand, 2.0 * opening)

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 5 cm along each axis, and its fingers."""
        self.hand.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """The hand; pose and velocity of the cube; the offset from the hand to it."""
        first = len(self.hand.bounds)
        self.hand.observe(now, out[:, :first])
        out[:, first : first + 13] = now.kinematics[:, 0]
        out[:, first + 13 :] = now.position[:, 0] - out[:, 0:3]

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the cube."""
        return now.position[:, 0]

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`reach`: minus the distance in m from the hand to the cube.

        `grasp`: 1 where the fingers are closed on it.
        """
        opening = 0.5 * self.hand.opening(now)
        half = HALF * (
            world.parameters.size[:, 0] if world.features.per_world_parameters else np.float64(1.0)
        )
        return grasp_terms(self.hand.position(now), opening, achieved, half)

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """A ball at the goal and a disc below it."""
        return [Goal(goal, THRESHOLD)]

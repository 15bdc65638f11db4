"""PandaStack: two cubes come to lie on one another at a goal."""

import math
from typing import ClassVar

import numpy as np

from physics import Body, Readout, World
from physics.compiler.jit import stage
from physics.scene.validation import number
from rigid_envs.tasks.goals import Measure
from rigid_envs.tasks.grasping.grasps import NEAR_GRASP_DRAWS
from rigid_envs.tasks.rewards import distance
from rigid_envs.twins.grasping_twin import GraspingTwin
from rigid_envs.twins.panda.hand import OpenHand
from rigid_envs.twins.panda.task import HALF, LIMIT, RANGE, PandaTask, cube, observed
from rigid_envs.twins.twin import along_axes, components

Array = np.ndarray

CUBES = ("first cube", "second cube")
PLACED = 0.04  # m, of the first cube from its goal, for the second one's turn
JITTER = 0.03  # m, largest offset along x and y of a first cube that starts at its goal
# m, between the middles of cubes along x or y, so that fingers around one don't meet the other:
# more than the hand's offset, half a finger and half a cube; gap, offset, a finger and a cube
ROOM = (0.05, 0.09)
HEIGHTS = (HALF, 3.0 * HALF)  # m, of the cubes at their starts and goals


@stage
def joint(a, b, i):  # type: ignore[no-untyped-def]
    """Distance in m between the goals a[:, i] and b[:, i], as points of six dimensions."""
    square = 0.0
    for c in range(a.shape[0]):
        d = np.float64(a[c, i]) - np.float64(b[c, i])
        square += d * d
    return math.sqrt(square)


class PandaStack(PandaTask, GraspingTwin):
    """Solved where both distances of the cubes from their goals, as sides, span at most 10 cm.

    So two cubes side by side at the goal also count, as in the original. The second cube starts
    4 cm above the table, on the first one where they overlap.

    Args:
        shaped: see `Twin`.
        near_grasp_start_prob: probability that an episode begins with the open hand around or just
            above the next cube; for training.
        partial_tower_start_prob: probability that the first cube starts at its goal, and the second
            one on the table; for training.
    """

    original = "PandaStack-v3"
    max_episode_steps = 100
    threshold = 0.1
    hand: ClassVar[OpenHand] = OpenHand()
    half = HALF
    solids = ((HALF, HALF), (HALF, HALF))
    actions = OpenHand.actions
    bounds = observed(hand, *CUBES)
    goal_bounds = components(LIMIT, *along_axes(*CUBES))
    draw_count = 6 + 3 + NEAR_GRASP_DRAWS
    shaping = {"placed": 4.0, "goals": 10.0, "reach": 5.0, "grasp": 1.0, "time": -6.0}

    def __init__(
        self,
        shaped: bool = False,
        near_grasp_start_prob: float = 0.0,
        partial_tower_start_prob: float = 0.0,
    ) -> None:
        """Checks the probabilities."""
        super().__init__(shaped, near_grasp_start_prob)
        self.partial_tower_start_prob = number(
            "partial_tower_start_prob", partial_tower_start_prob, low=0.0, high=1.0
        )

    def measure(self) -> Measure:
        """The distance of both goals as one point."""
        return joint

    def bodies(self) -> list[Body]:
        """Cubes of 2 and 1 kg."""
        return [cube(CUBES[0], 2.0, HEIGHTS[0]), cube(CUBES[1], 1.0, HEIGHTS[1])]

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Each cube within 15 cm of the middle, the closed hand above them."""
        places = RANGE * (2.0 * draws[:, :6].reshape(-1, 3, 2) - 1.0)
        position, goals = np.zeros((2, len(draws), 2, 3))
        position[:, :, :2], position[:, :, 2] = places[:, :2], HEIGHTS
        goals[:, :, :2], goals[:, :, 2] = places[:, 2:], HEIGHTS
        partial = draws[:, 6] < self.partial_tower_start_prob
        position[partial, 0, :2] = goals[partial, 0, :2] + JITTER * (2.0 * draws[partial, 7:9] - 1)
        between = np.abs(position[:, 1, :2] - position[:, 0, :2])
        beside, room = between.max(axis=1) > 2.0 * HALF, np.any(between > ROOM, axis=1)
        position[partial & beside, 1, 2] = HALF
        world.reset(mask)
        world.set_state(position=position, worlds=mask)
        self.start_near_grasps(world, mask, draws[:, 9:], partial.astype(int), room)
        return goals.reshape(-1, 6)

    def achieved(self, world: World, now: Readout) -> Array:
        """Positions of both cubes."""
        return now.position[:, :2].reshape(-1, 6)

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """Terms of the next cube: the second one where the first is within 4 cm of its goal.

        `placed`: 1 where it is the second. `goals`: minus the sum of both distances from the goals,
        m: unlike that of the next cube alone, it doesn't jump where the turn changes. And those of
        grasping the next cube.
        """
        cubes, goals = achieved.reshape(-1, 2, 3), desired.reshape(-1, 2, 3)
        lacking = distance(cubes, goals)
        placed = lacking[:, 0] < PLACED
        next_one = np.arange(len(cubes)), placed.astype(int)
        return {
            "placed": placed.astype(float),
            "goals": -lacking.sum(axis=1),
            **self.grasp_terms(now, cubes[next_one]),
        }

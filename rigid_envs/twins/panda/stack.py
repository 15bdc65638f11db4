"""PandaStack: two cubes come to lie on one another at a goal."""

import math
from typing import ClassVar

import numpy as np

from physics import Body, Readout, World
from physics.compiler.jit import stage
from rigid_envs.tasks.goals import Measure
from rigid_envs.tasks.rewards import distance
from rigid_envs.twins.near_grasps import NEAR_GRASP_DRAWS, start_near_grasps
from rigid_envs.twins.panda.hand import OpenHand
from rigid_envs.twins.panda.task import HALF, LIMIT, RANGE, PandaTask, behind, cube, observed
from rigid_envs.twins.twin import GraspingTwin, along_axes, components

Array = np.ndarray

CUBES = ("first cube", "second cube")
PLACED = 0.05  # m, of the first cube from its goal, for the second one's turn
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
    """

    original = "PandaStack-v3"
    max_episode_steps = 100
    threshold = 0.1
    hand: ClassVar[OpenHand] = OpenHand()
    actions = OpenHand.actions
    bounds = observed(hand, *CUBES)
    goal_bounds = components(LIMIT, *along_axes(*CUBES))
    draw_count = 6 + NEAR_GRASP_DRAWS
    shaping = {"placed": 4.0, "next": 10.0, "reach": 3.0, "time": -4.0}

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
        world.reset(mask)
        world.set_state(position=position, worlds=mask)
        start_near_grasps(
            world, mask, draws[:, 6:], self.near_grasp_start_prob, self.hand.pads, HALF
        )
        goals[:, :, :2], goals[:, :, 2] = places[:, 2:], HEIGHTS
        return goals.reshape(-1, 6)

    def achieved(self, world: World, now: Readout) -> Array:
        """Positions of both cubes."""
        return now.position[:, :2].reshape(-1, 6)

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """Terms of the next cube: the second one where the first is within 5 cm of its goal.

        `placed`: 1 where it is the second. `next`: minus its distance from its goal, m.

        `reach`: minus the distance in m from the hand to the point behind it.
        """
        cubes, goals = achieved.reshape(-1, 2, 3), desired.reshape(-1, 2, 3)
        lacking = distance(cubes, goals)
        placed = lacking[:, 0] < PLACED
        next_one = np.arange(len(cubes)), placed.astype(int)
        cube, goal = cubes[next_one], goals[next_one]
        goal[:, 2] = cube[:, 2]  # cubes are pushed
        reach = distance(self.hand.position(now), behind(cube, goal))
        return {"placed": placed.astype(float), "next": -lacking[next_one], "reach": -reach}

"""PandaPickAndPlace: the hand carries a cube to a goal on the table or above it."""

from typing import ClassVar

import numpy as np

from physics import Body, Readout, World
from rigid_envs.tasks.grasping.grasps import NEAR_GRASP_DRAWS
from rigid_envs.twins.grasping_twin import GraspingTwin
from rigid_envs.twins.panda.hand import OpenHand
from rigid_envs.twins.panda.task import HALF, PandaObject, cube, observed

Array = np.ndarray

HIGHEST = 0.2  # m, of a goal above the table
ON_TABLE = 0.3  # probability of a goal on the table


class PandaPickAndPlace(PandaObject, GraspingTwin):
    """Most goals lie up to 20 cm above the table; solved within 5 cm of the goal."""

    original = "PandaPickAndPlace-v3"
    hand: ClassVar[OpenHand] = OpenHand()
    half = HALF
    actions = OpenHand.actions
    bounds = observed(hand, "object")
    draw_count = PandaObject.draw_count + 2 + NEAR_GRASP_DRAWS
    shaping = {"distance": 10.0, "reach": 5.0, "grasp": 1.0, "time": -1.0}

    def bodies(self) -> list[Body]:
        """A cube of 1 kg."""
        return [cube("cube", 1.0, HALF)]

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The cube within 15 cm of the middle, the closed hand above it."""
        goals = super().start(world, mask, draws)
        on_table, height, near = np.split(draws[:, PandaObject.draw_count :], [1, 2], axis=1)
        goals[:, 2:] += np.where(on_table < ON_TABLE, 0.0, HIGHEST * height)
        self.start_near_grasps(world, mask, near)
        return goals

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """Those of a grasp."""
        return self.grasp_terms(now, achieved)

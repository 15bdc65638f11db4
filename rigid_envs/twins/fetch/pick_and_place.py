"""FetchPickAndPlace: the hand carries a cube to a goal on the table or above it."""

from typing import ClassVar

import numpy as np

from physics import Body, Readout, World
from rigid_envs.tasks.grasping.grasps import NEAR_GRASP_DRAWS
from rigid_envs.twins.fetch.arm import PICK_ARM
from rigid_envs.twins.fetch.hand import CLEAR, RESTING, OpenHand
from rigid_envs.twins.fetch.push import HALF, cube
from rigid_envs.twins.fetch.task import FetchObject
from rigid_envs.twins.grasping_twin import GraspingTwin

Array = np.ndarray

HIGHEST = 0.45  # m, of a goal above the table
ABOVE = 0.01  # m, chosen, of the grip over the cube's middle, where the shaped reward leads it


class FetchPickAndPlace(FetchObject, GraspingTwin):
    """Half of the goals lie up to 45 cm above the table; solved within 5 cm of the goal."""

    original = "FetchPickAndPlace-v4"
    hand: ClassVar[OpenHand] = OpenHand(PICK_ARM)
    half = HALF
    closed = 0.5
    draw_count = FetchObject.draw_count + NEAR_GRASP_DRAWS
    shaping = {"success": 1.0, "distance": 10.0, "reach": 5.0, "grasp": 1.0, "table": 0.5}

    def object(self) -> Body:
        """The cube."""
        return cube()

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The object at least 10 cm beside the hand."""
        draws, near = np.split(draws, [FetchObject.draw_count], axis=1)
        goals = super().start(world, mask, draws)
        goals[:, 2] += np.where(draws[:, -2] < 0.5, HIGHEST * draws[:, -1], 0.0)
        self.start_near_grasps(world, mask, near)
        return goals

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """Those of a grasp, above the cube's middle. `table`: -1 where the hand is on the table.

        There friction would hold its fingers.
        """
        low = self.hand.position(now)[:, 2] < RESTING + CLEAR
        terms = self.grasp_terms(now, achieved + np.array([0.0, 0.0, ABOVE]))
        return {**terms, "table": -low.astype(float)}

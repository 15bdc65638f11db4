"""PandaPush: the closed fingers push a cube over the table."""

import numpy as np

from physics import Body, Readout, World
from rigid_envs.twins.panda.task import HALF, PandaObject, cube, observed

Array = np.ndarray

SLOW = 0.4  # m/s; a cube stops 3 cm after a push at this speed


class PandaPush(PandaObject):
    """Cube and goal lie within 15 cm of the middle; solved within 5 cm of the goal."""

    original = "PandaPush-v3"
    bounds = observed(PandaObject.hand, "object")
    shaping = {**PandaObject.shaping, "haste": 1.0}

    def bodies(self) -> list[Body]:
        """A cube of 1 kg."""
        return [cube("cube", 1.0, HALF)]

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`haste`: minus the speed in m/s by which the cube is faster than `SLOW`."""
        speed = np.sqrt(np.sum(now.linear_velocity[:, 0, :2].astype(float) ** 2, axis=1))
        haste = {"haste": -np.maximum(speed - SLOW, 0.0)}
        return {**super().guidance(world, now, achieved, desired, goal_distance), **haste}

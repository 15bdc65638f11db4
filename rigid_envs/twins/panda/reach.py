"""PandaReach: the hand moves to a point."""

import numpy as np

from physics import Readout, World
from rigid_envs.twins.panda.task import LIMIT, RANGE, PandaTask, observed
from rigid_envs.twins.twin import along_axes, components

Array = np.ndarray


class PandaReach(PandaTask):
    """Goals lie within 15 cm of the middle and up to 30 cm above it; solved within 5 cm."""

    original = "PandaReach-v3"
    bounds = observed(PandaTask.hand)
    goal_bounds = components(LIMIT, *along_axes("hand"))
    draw_count = 3

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The hand at its start."""
        world.reset(mask)
        return 2.0 * RANGE * (draws - (0.5, 0.5, 0.0))

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the hand."""
        return self.hand.position(now)

"""FetchReach: the hand moves to a point."""

import numpy as np

from physics import Ground, Material, Readout, Scene, World
from rigid_envs.twins.fetch.arm import REACH_ARM
from rigid_envs.twins.fetch.hand import OBJECT, TABLE, ClosedHand
from rigid_envs.twins.fetch.task import FINGERS, FetchTask
from rigid_envs.twins.twin import along_axes, components

Array = np.ndarray

RANGE = 0.15  # m, largest offset of goals from the hand's start along each axis


class FetchReach(FetchTask):
    """Goals lie within 15 cm of the hand's start along each axis; solved within 5 cm."""

    original = "FetchReach-v4"
    hand = ClosedHand(REACH_ARM)
    bounds = components(
        np.inf,
        *along_axes("hand"), *FINGERS,
        *along_axes("hand velocity"), *(f"{finger} velocity" for finger in FINGERS),
    )  # fmt: skip
    goal_bounds = components(np.inf, *along_axes("hand"))
    draw_count = 3

    def scene(self) -> Scene:
        """The hand above the table."""
        table = Ground(Material(), TABLE, "table", OBJECT, OBJECT)
        return Scene(bodies=[], statics=[table], drives=[self.hand.drive()])

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The hand at its start."""
        world.reset(mask)
        world.set_state(drive_velocity=self.hand.arm.start_velocity, worlds=mask)
        return np.array(self.hand.start) + RANGE * (2.0 * draws - 1.0)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """As `bounds` names it; velocities are displacements per step."""
        out[:] = 0.0
        out[:, 0:3] = self.hand.position(now)
        out[:, 5:8] = self.frame * self.hand.velocity(now)

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the hand."""
        return self.hand.position(now)

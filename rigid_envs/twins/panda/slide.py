"""PandaSlide: the closed fingers hit a puck, which slides to a goal out of reach."""

from dataclasses import replace

import numpy as np

from physics import Body, Box, Cylinder, Drag, Material, Readout, Scene, World
from rigid_envs.tasks.rewards import distance
from rigid_envs.twins.panda.hand import HAND, OBJECT, ClosedHand
from rigid_envs.twins.panda.task import BEHIND, CUBE_FRICTION, PandaObject, observed
from rigid_envs.twins.twin import behind

Array = np.ndarray

RADIUS, HALF_HEIGHT, MASS = 0.03, 0.015, 1.0  # m, m and kg, of the puck
PUCK_FRICTION = 0.02  # Coulomb's coefficient of puck and table
DAMPING = 0.04  # 1/s, deceleration per speed that PyBullet adds
GRAVITY = 9.81  # m/s^2
# m, of fingers, half the size: as wide as the slanted ones at the puck's upper edge, 25 mm above
# the end effector of a hand on the table: 14.4 + (25 + 7) / 40 * 12.6 = 24.5 mm
UPRIGHT = Box((0.0097, 0.0245, 0.025))
REACH = 0.2  # m along x; beyond it the hand need not follow the puck


class PandaSlide(PandaObject):
    """The middle of the goals lies 40 cm ahead; solved while the puck is within 5 cm of one.

    As in the original the puck starts 1.5 cm above the table, and the goals are that high, too.
    """

    original = "PandaSlide-v3"
    hand = ClosedHand(UPRIGHT)
    bounds = observed(hand, "object")
    start_height = 2.0 * HALF_HEIGHT
    goal_height = 2.0 * HALF_HEIGHT
    goal_offset = 0.4
    solids = ((RADIUS, HALF_HEIGHT),)
    shaping = {"aim": 10.0, "reach": 3.0, "time": -1.0}

    def bodies(self) -> list[Body]:
        """A puck of 1 kg."""
        material = Material(PUCK_FRICTION**2 / CUBE_FRICTION, restitution=0.0)  # a pair's: the root
        return [
            Body(
                Cylinder(RADIUS, HALF_HEIGHT), mass=MASS, position=(0.0, 0.0, HALF_HEIGHT),
                material=material, name="puck", group=OBJECT, mask=OBJECT | HAND,
            )
        ]  # fmt: skip

    def scene(self) -> Scene:
        """The puck on the table, and the hand."""
        return replace(super().scene(), fields=[Drag(linear=DAMPING * MASS, body="puck")])

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`aim`: minus the distance in m from the goal at which the puck will pass it.

        `reach`: as in the other tasks, until the puck is out of reach.
        """
        velocity = now.linear_velocity[:, 0, :2].astype(float)
        speed = np.sqrt(np.sum(velocity**2, axis=1))
        ahead = velocity / np.maximum(speed, 1e-9)[:, None]
        to_goal = (desired - achieved)[:, :2]
        # how far it will be when it passes the goal, or when it stops before
        way = np.clip(
            np.sum(to_goal * ahead, axis=1), 0.0, speed**2 / (2.0 * PUCK_FRICTION * GRAVITY)
        )
        miss = np.sqrt(np.sum((to_goal - ahead * way[:, None]) ** 2, axis=1))
        reach = distance(self.hand.position(now), behind(achieved, desired, BEHIND))
        gone = achieved[:, 0] > REACH
        return {"aim": -miss, "reach": np.where(gone, 0.0, -reach)}

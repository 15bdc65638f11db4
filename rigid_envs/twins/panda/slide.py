"""PandaSlide: the closed fingers hit a puck, which slides to a goal out of reach."""

from physics import Body, Cylinder, Material
from rigid_envs.twins.panda.task import FRICTION, PandaObject, observed

RADIUS, HALF_HEIGHT = 0.03, 0.015  # m, of the puck
PUCK_FRICTION = 0.02  # Coulomb's coefficient of puck and table


class PandaSlide(PandaObject):
    """The middle of the goals lies 40 cm ahead; solved while the puck is within 5 cm of one.

    As in the original the puck starts 1.5 cm above the table, and the goals are that high, too.
    """

    original = "PandaSlide-v3"
    bounds = observed(PandaObject.hand, "object")
    start_height = 2.0 * HALF_HEIGHT
    goal_height = 2.0 * HALF_HEIGHT
    goal_offset = 0.4

    def bodies(self) -> list[Body]:
        """A puck of 1 kg."""
        material = Material(PUCK_FRICTION**2 / FRICTION, restitution=0.0)  # a pair's: the root
        return [
            Body(
                Cylinder(RADIUS, HALF_HEIGHT), mass=1.0, position=(0.0, 0.0, HALF_HEIGHT),
                material=material, name="puck",
            )
        ]  # fmt: skip

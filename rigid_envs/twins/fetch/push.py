"""FetchPush: the closed fingers push a cube over the table."""

from physics import Body, Box, Material
from rigid_envs.twins.fetch.arm import PUSH_ARM
from rigid_envs.twins.fetch.hand import HAND, OBJECT, TABLE, ClosedHand
from rigid_envs.twins.fetch.task import FetchObject

HALF = 0.025  # m, half the width of the cube


def cube() -> Body:
    """The cube of 2 kg."""
    return Body(
        Box((HALF,) * 3), mass=2.0, position=(1.25, 0.75, TABLE + HALF),
        material=Material(friction=1.0, restitution=0.0), name="cube",
        group=OBJECT, mask=OBJECT | HAND,
    )  # fmt: skip


class FetchPush(FetchObject):
    """Cube and goal lie within 15 cm of the hand along x and y; solved within 5 cm of the goal."""

    original = "FetchPush-v4"
    hand = ClosedHand(PUSH_ARM)

    def object(self) -> Body:
        """The cube."""
        return cube()

"""PandaPush: the closed fingers push a cube over the table."""

from physics import Body
from rigid_envs.twins.panda.task import HALF, PandaObject, cube, observed


class PandaPush(PandaObject):
    """Cube and goal lie within 15 cm of the middle; solved within 5 cm of the goal."""

    original = "PandaPush-v3"
    bounds = observed(PandaObject.hand, "object")

    def bodies(self) -> list[Body]:
        """A cube of 1 kg."""
        return [cube("cube", 1.0, HALF)]

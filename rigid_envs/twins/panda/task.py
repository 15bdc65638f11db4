"""What the Panda tasks share: table, cubes and hand, observation."""

from typing import ClassVar

import numpy as np

from physics import Body, Box, Ground, Material, Readout, Scene, World
from physics.orientation import to_euler
from rigid_envs.rendering.camera import Camera
from rigid_envs.tasks.rewards import distance
from rigid_envs.tasks.task import Bounds
from rigid_envs.twins.panda.arm import ARM
from rigid_envs.twins.panda.hand import HAND, OBJECT, ClosedHand, OpenHand, Solids
from rigid_envs.twins.twin import Twin, along_axes, behind, components

Array = np.ndarray

LIMIT = 10.0  # of every component, as the original's spaces say; its values can be larger
RANGE = 0.15  # m, largest offset of starts and goals from their middle along x and y
HALF = 0.02  # m, half the width of a cube
BEHIND = 0.045  # m, from the object to where the hand is led
CUBE_FRICTION = 0.25  # Coulomb's coefficient of cubes and table


class PandaTask(Twin):
    """A hand over a table, which has no edge.

    Attributes:
        hand: the hand.
        solids: half the width and half the height of each body, m.
    """

    ends_on_success = True
    parts = ARM.parts
    hand: ClassVar[ClosedHand | OpenHand] = ClosedHand()
    solids: ClassVar[Solids] = ()
    actions: tuple[str, ...] = ClosedHand.actions
    camera = Camera.around((0.0, 0.0, 0.04), 1.16, azimuth=-75.0, elevation=42.0)

    def bodies(self) -> list[Body]:
        """What lies on the table."""
        return []

    def scene(self) -> Scene:
        """The table, what lies on it, and the hand."""
        table = Ground(Material(CUBE_FRICTION, 0.0), 0.0, "table", OBJECT, OBJECT)
        return Scene(bodies=self.bodies(), statics=[table], drives=[self.hand.drive()])

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 5 cm along each axis, as far as the arm gets."""
        self.hand.act(world, now, actions, self.frame, self.solids)

    def proceed(self, world: World, part: int) -> None:
        """Moves the hand on along its path."""
        self.hand.proceed(world, world.read(), part, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """As `bounds` names it: m, m/s, rad and rad/s."""
        self.hand.observe(now, out)
        first = 6 + len(self.hand.names)
        for body in range(len(world.scene.bodies)):
            part = out[:, first + 12 * body : first + 12 * (body + 1)]
            part[:, 0:3] = now.position[:, body]
            part[:, 3:6] = to_euler(now.orientation[:, body])[:, ::-1]  # roll, pitch and yaw
            part[:, 6:9] = now.linear_velocity[:, body]
            part[:, 9:12] = now.angular_velocity[:, body]


class PandaObject(PandaTask):
    """One object on the table.

    Attributes:
        start_height: m, of the object's centre.
        goal_height: m.
        goal_offset: m along x, of the middle of the goals from that of the starts.
    """

    start_height: ClassVar[float] = HALF
    goal_height: ClassVar[float] = HALF
    goal_offset: ClassVar[float] = 0.0
    solids = ((HALF, HALF),)
    goal_bounds = components(LIMIT, *along_axes("object"))
    draw_count = 4
    shaping = {"distance": 10.0, "reach": 3.0}

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The object within 15 cm of the middle, the hand above it."""
        position = np.full((len(draws), 1, 3), self.start_height)
        position[:, 0, :2] = RANGE * (2.0 * draws[:, :2] - 1.0)
        world.reset(mask)
        world.set_state(position=position, worlds=mask)
        goals = np.full((len(draws), 3), self.goal_height)
        goals[:, :2] = RANGE * (2.0 * draws[:, 2:4] - 1.0)
        goals[:, 0] += self.goal_offset
        return goals

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the object."""
        return now.position[:, 0]

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`reach`: minus the distance in m from the hand to the point behind the object."""
        return {"reach": -distance(self.hand.position(now), behind(achieved, desired, BEHIND))}


def cube(name: str, mass: float, height: float) -> Body:
    """A cube of `mass` kg whose centre is `height` m above the table."""
    material = Material(CUBE_FRICTION, restitution=0.0)
    return Body(
        Box((HALF,) * 3), mass=mass, position=(0.0, 0.0, height), material=material, name=name,
        group=OBJECT, mask=OBJECT | HAND,
    )  # fmt: skip


def observed(hand: ClosedHand | OpenHand, *bodies: str) -> Bounds:
    """Bounds of an observation of the hand and of bodies."""
    parts = ("", " rotation", " velocity", " angular velocity")
    names = along_axes(*(f"{body}{part}" for body in bodies for part in parts))
    return components(LIMIT, *along_axes("hand", "hand velocity"), *hand.names, *names)

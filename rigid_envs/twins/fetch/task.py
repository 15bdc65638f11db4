"""What the Fetch tasks with an object share: table, object and hand, observation, starts, goals."""

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from physics import Body, Ground, Material, Readout, Scene, World
from physics.orientation import to_euler
from rigid_envs.rendering.camera import Camera
from rigid_envs.tasks.rewards import distance
from rigid_envs.twins.fetch.hand import ACTIONS, OBJECT, TABLE, ClosedHand, OpenHand
from rigid_envs.twins.twin import Twin, along_axes, behind, components

Array = np.ndarray

CAMERA = Camera.around((1.3, 0.75, 0.44), 1.16, azimuth=-75.0, elevation=42.0)
FINGERS = ("right finger", "left finger")
# drawn per episode; the first one that is far enough from the hand is used. One in five is in
# FetchSlide, so all fail once in 16,000 episodes
STARTS = 40
CLEARANCE = 0.1  # m, of the object's start from the hand along the table
BEHIND = 0.05  # m, from the object to where the hand is led


class FetchTask(Twin):
    """A hand over a table.

    Attributes:
        hand: the hand.
    """

    dtype = np.float64
    hand: ClassVar[ClosedHand | OpenHand]
    actions = ACTIONS
    camera = CAMERA

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 5 cm along each axis."""
        self.hand.act(world, now, actions, self.frame)


class FetchObject(FetchTask):
    """A hand over a table with an object on it.

    The table has no edge.

    Attributes:
        start_range: m, largest offset of the object's start from the hand's along x and y.
        goal_range: m, the same of the goals from their middle.
        goal_offset: m, of that middle from the hand's start along x.
        start_height: m, of the object's centre.
        goal_height: m.
        ground: m, height of the table as the object meets it.
        ground_friction: of the table's material as the object meets it.
    """

    start_range: ClassVar[float] = 0.15
    goal_range: ClassVar[float] = 0.15
    goal_offset: ClassVar[float] = 0.0
    start_height: ClassVar[float] = 0.424702
    goal_height: ClassVar[float] = 0.42469975
    ground: ClassVar[float] = TABLE
    ground_friction: ClassVar[float] = 1.0

    bounds = components(
        np.inf,
        *along_axes("hand", "object", "hand to object"), *FINGERS,
        *along_axes("object rotation", "object velocity relative to the hand"),
        *along_axes("object angular velocity", "hand velocity"),
        *(f"{finger} velocity" for finger in FINGERS),
    )  # fmt: skip
    goal_bounds = components(np.inf, *along_axes("object"))
    draw_count = 2 * STARTS + 4  # starts; x and y of the goal, and two for its height
    shaping = {"success": 1.0, "distance": 10.0, "reach": 3.0}

    @abstractmethod
    def object(self) -> Body:
        """The object."""

    def scene(self) -> Scene:
        """The object on the table, and the hand above it."""
        table = Ground(Material(self.ground_friction, 0.0), self.ground, "table", OBJECT, OBJECT)
        return Scene(bodies=[self.object()], statics=[table], drives=[self.hand.drive()])

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The object at least 10 cm beside the hand."""
        n, home = len(draws), np.array(self.hand.start[:2])
        offsets = self.start_range * (2.0 * draws[:, : 2 * STARTS].reshape(n, STARTS, 2) - 1.0)
        offsets[:, -1] = self.start_range  # the last resort is a corner
        far = np.sum(offsets**2, axis=2) >= CLEARANCE**2
        position = np.full((n, 1, 3), self.start_height)
        position[:, 0, :2] = home + offsets[np.arange(n), np.argmax(far, axis=1)]
        world.reset(mask)
        velocity = self.hand.arm.start_velocity
        world.set_state(position=position, drive_velocity=velocity, worlds=mask)
        goals = np.full((n, 3), self.goal_height)
        goals[:, :2] = home + self.goal_range * (2.0 * draws[:, 2 * STARTS : -2] - 1.0)
        goals[:, 0] += self.goal_offset
        return goals

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """As `bounds` names it; velocities are displacements per step, angles in rad."""
        hand, frame = self.hand.position(now), self.frame
        velocity = frame * self.hand.velocity(now)
        opening, opening_velocity = self.hand.fingers(now)
        out[:, 0:3] = hand
        out[:, 3:6] = now.position[:, 0]
        out[:, 6:9] = now.position[:, 0] - hand
        out[:, 9] = out[:, 10] = opening
        out[:, 11:14] = rotation(now.orientation[:, 0])
        out[:, 14:17] = frame * now.linear_velocity[:, 0] - velocity
        out[:, 17:20] = frame * now.angular_velocity[:, 0]
        out[:, 20:23] = velocity
        out[:, 23] = out[:, 24] = frame * opening_velocity

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the object."""
        return now.position[:, 0]

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`reach`: minus the distance in m from the hand to the point behind the object.

        Behind means 5 cm away on the far side as seen from the goal.
        """
        return {"reach": -distance(self.hand.position(now), behind(achieved, desired, BEHIND))}


def rotation(orientation: Array) -> Array:
    """Angles [n, 3] rad about x, y and z of quaternions [n, 4], as the originals observe them.

    The rotation is the product of rotations about x, y and z in this order (in the moving frame).
    """
    # the opposite rotation is that by the opposite angles about z, y and x
    opposite = orientation * np.array([-1.0, -1.0, -1.0, 1.0])
    return -to_euler(opposite)[:, ::-1]

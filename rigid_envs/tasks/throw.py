"""Throw: a hand holds a ball, swings and lets go, to hit a target beyond its reach."""

from collections.abc import Sequence

import numpy as np

from physics import Body, Fidelity, Ground, Material, Readout, Scene, Sphere, World
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Mark, Marker
from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

RADIUS = 0.02  # m, of the ball
MASS = 0.05  # kg
MIN_TARGET_DISTANCE, MAX_TARGET_DISTANCE = 0.5, 1.2  # m, from the origin
MAX_TARGET_ANGLE = 0.4  # rad, to either side of the x axis
THRESHOLD = 0.1  # m
BALL, GROUND = 0, 3  # indices of solids; the fingers are 1 and 2
GRAVITY = 9.81  # m/s^2


class Throw(Task):
    """The achieved goal is where the ball first touches the ground; until then, where it is."""

    hand = Hand(home=(-0.1, 0.0, 0.25), low=(-0.3, -0.2, 0.1), high=(0.3, 0.2, 0.5), stride=0.12)
    # from behind, so that the hand and the ball are near, and from the side, to show the arc
    camera = Camera.around((0.3, 0.03, 0.24), 1.9, -150.0, 20.0, field_of_view=38.0)
    workspace = ((-0.3, -0.57, 0.0), (1.3, 0.57, 0.5))
    video_camera = "follow"

    actions = hand.actions
    bounds = (
        *hand.bounds,
        *((f"ball {a}", "m", -5.0, 5.0) for a in "xyz"),
        *((f"ball velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"hand to ball {a}", "m", -5.0, 5.0) for a in "xyz"),
        ("landed", "", 0.0, 1.0),
    )
    goal_bounds = tuple((f"ball {a}", "m", -5.0, 5.0) for a in "xyz")
    draw_count = 2
    # a larger ball would leave the open fingers no clearance
    size_range = (0.5, 1.75)
    # without the penalty, holding the ball out towards a near target would pay more than hitting it
    reward = Reward(THRESHOLD, {"success": 1.0, "aim": 1.0}, time_penalty=1.0)

    def __init__(self) -> None:
        """Creates the task."""
        self._grasps: dict[Fidelity, tuple[Array, Array]] = {}

    def scene(self) -> Scene:
        """A ball between the pads of a hand above the ground."""
        material = Material(friction=0.5, restitution=0.3)
        pads = Material(friction=2.0, restitution=0.0)
        ball = Body(
            Sphere(RADIUS), mass=MASS, position=self.hand.home, material=material, name="ball"
        )
        hand = self.hand.gripper(2.0 * RADIUS, pads)
        return Scene(bodies=[ball], statics=[Ground(material, name="ground")], drives=[hand])

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Hand at home with the ball; target uniform by area in a sector of a ring.

        With a ball of another size only the distance between the fingers changes, so no world has
        to settle on its own.
        """
        if world.fidelity not in self._grasps:
            self._grasps[world.fidelity] = self.hand.settled_grasp(self.scene(), world, self.frame)
        pads, ball = self._grasps[world.fidelity]
        size = (
            world.parameters.size[mask, BALL]
            if world.features.per_world_parameters
            else np.ones(len(draws))
        )
        pads = np.repeat(pads, len(draws), axis=0)
        pads[:, :, 1] += RADIUS * (size - 1.0)[:, None] * (-1.0, 1.0)
        world.reset(mask)
        world.set_state(drive_position=pads, position=ball, worlds=mask)

        near, far = MIN_TARGET_DISTANCE**2, MAX_TARGET_DISTANCE**2
        radius = np.sqrt(near + (far - near) * draws[:, 0])
        angle = MAX_TARGET_ANGLE * (2.0 * draws[:, 1] - 1.0)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), RADIUS * size], 1)

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 12 cm along each axis, and its fingers."""
        self.hand.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Hand; ball position and velocity; offset from hand to ball; whether the ball landed."""
        first = len(self.hand.bounds)
        self.hand.observe(now, out[:, :first])
        ball = now.position[:, BALL]
        out[:, first : first + 3] = ball
        out[:, first + 3 : first + 6] = now.linear_velocity[:, BALL]
        out[:, first + 6 : first + 9] = ball - out[:, 0:3]
        out[:, first + 9] = ~np.isnan(world.first_touch(BALL, GROUND))

    def achieved(self, world: World, now: Readout) -> Array:
        """Centre of the ball at its first touch of the ground; before it, the current centre."""
        landed = world.first_touch_position(BALL, GROUND)
        return np.where(np.isnan(landed), now.position[:, BALL], landed)

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`aim`: minus the distance in m from the target to the landing point; and `landed`.

        Before the ball lands, the landing point is that of a ball released now.
        """
        landed = ~np.isnan(world.first_touch(BALL, GROUND))
        velocity = now.linear_velocity[:, BALL]
        ground_level = desired[:, 2]  # height of the centre of a ball on the ground, of any size
        height = np.maximum(achieved[:, 2] - ground_level, 0.0).astype(float)
        root = np.sqrt(velocity[:, 2] ** 2 + 2.0 * GRAVITY * height)
        flight_time = (velocity[:, 2] + root) / GRAVITY
        landing = achieved + np.where(landed, 0.0, flight_time)[:, None] * velocity
        landing[:, 2] = ground_level
        return {"aim": -distance(landing, desired), "landed": landed.astype(float)}

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """The target, and a cross where the ball first touched the ground."""
        spot = goal * (1.0, 1.0, 0.0)
        shown: list[Marker] = [Goal(spot, THRESHOLD), Goal(spot, 0.3 * THRESHOLD)]
        landed = world.first_touch_position(BALL, GROUND)[index]
        return shown if np.isnan(landed).any() else [*shown, Mark(landed, 0.4 * THRESHOLD)]

"""Throw: a hand that holds a ball swings and lets go, to hit a place beyond its reach."""

from collections.abc import Sequence

import numpy as np

from physics import Body, Fidelity, Ground, Material, Readout, Scene, Sphere, World
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Mark, Sign
from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

RADIUS = 0.02  # m
MASS = 0.05  # kg
NEAREST, FARTHEST = 0.5, 1.2  # m of the target from the origin
ASIDE = 0.4  # rad, by which it may lie to either side of x
THRESHOLD = 0.1  # m
BALL, FINGERS, GROUND = 0, (1, 2), 3  # solids
GRAVITY = 9.81  # m/s^2


class Throw(Task):
    """Where the ball first touches the ground counts, and before that, where it is."""

    hand = Hand(home=(-0.1, 0.0, 0.25), low=(-0.3, -0.2, 0.1), high=(0.3, 0.2, 0.5), stride=0.12)
    # from the side for the arc of a throw, and from behind for the fingers
    camera = Camera((0.4, 0.0, 0.16), 2.2, azimuth=-128.0, elevation=30.0, field_of_view=45.0)

    actions = hand.actions
    bounds = (
        *hand.bounds,
        *((f"ball {a}", "m", -5.0, 5.0) for a in "xyz"),
        *((f"ball velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"hand to ball {a}", "m", -5.0, 5.0) for a in "xyz"),
        ("landed", "", 0.0, 1.0),
    )
    goal_bounds = tuple((f"ball {a}", "m", -5.0, 5.0) for a in "xyz")
    draws = 2
    # above, the fingers would hardly open wider than the ball
    sizes = (0.5, 1.75)
    # in a hurry it costs to hold the ball out at a near target
    reward = Reward(THRESHOLD, {"success": 1.0, "aim": 1.0}, hurry=-1.0)

    def scene(self) -> Scene:
        """A ball between the pads of a hand above the ground."""
        material = Material(friction=0.5, restitution=0.3)
        pads = Material(friction=2.0, restitution=0.0)
        ball = Body(Sphere(RADIUS), mass=MASS, position=self.hand.home, material=material)
        hand = self.hand.gripper(2.0 * RADIUS, pads)
        return Scene(bodies=[ball], statics=[Ground(material)], drives=[hand])

    def __init__(self) -> None:
        """Nothing is known yet of how deep pads press into the ball."""
        self._held: dict[Fidelity, tuple[Array, Array]] = {}

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The hand at home, the ball in it; the target in a sector of a ring, by even area.

        Fingers about a ball of another size are only farther apart, so no world needs to settle for
        itself.
        """
        if world.fidelity not in self._held:
            self._held[world.fidelity] = self.hand.hold(self.scene(), world, self.frame)
        fingers, ball = self._held[world.fidelity]
        size = world.parameters.size[mask, BALL] if world.features.varied else np.ones(len(draws))
        fingers = np.repeat(fingers, len(draws), axis=0)
        fingers[:, :, 1] += RADIUS * (size - 1.0)[:, None] * (-1.0, 1.0)
        world.reset(mask)
        world.set_state(drive_position=fingers, position=ball, worlds=mask)
        square = NEAREST**2 + (FARTHEST**2 - NEAREST**2) * draws[:, 0]
        far, angle = np.sqrt(square), ASIDE * (2.0 * draws[:, 1] - 1.0)
        return np.stack([far * np.cos(angle), far * np.sin(angle), RADIUS * size], 1)

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 12 cm along each axis, and its fingers."""
        self.hand.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """The hand, the ball, the way from one to the other, and whether the ball has landed."""
        first = len(self.hand.bounds)
        self.hand.observe(now, out[:, :first])
        ball = now.position[:, BALL]
        out[:, first : first + 3] = ball
        out[:, first + 3 : first + 6] = now.linear_velocity[:, BALL]
        out[:, first + 6 : first + 9] = ball - out[:, 0:3]
        out[:, first + 9] = ~np.isnan(world.first_touch(BALL, GROUND))

    def achieved(self, world: World, now: Readout) -> Array:
        """The ball's centre, as it first touched the ground or as it is."""
        landed = world.first_touch_position(BALL, GROUND)
        return np.where(np.isnan(landed), now.position[:, BALL], landed)

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, apart: Array
    ) -> dict[str, Array]:
        """`aim`: m, minus the distance of the target from where the ball would land, let go now."""
        landed = ~np.isnan(world.first_touch(BALL, GROUND))
        speed = now.linear_velocity[:, BALL]
        lying = desired[:, 2]  # the height of a ball on the ground, whatever its size
        height = np.maximum(achieved[:, 2] - lying, 0.0).astype(float)
        flight = (speed[:, 2] + np.sqrt(speed[:, 2] ** 2 + 2.0 * GRAVITY * height)) / GRAVITY
        lands = achieved + np.where(landed, 0.0, flight)[:, None] * speed
        lands[:, 2] = lying
        return {"aim": -distance(lands, desired), "landed": landed.astype(float)}

    def signs(self, world: World, index: int, goal: Array) -> Sequence[Sign]:
        """The target, and a cross where the ball first touched the ground."""
        spot = goal * (1.0, 1.0, 0.0)
        shown: list[Sign] = [Goal(spot, THRESHOLD), Goal(spot, 0.3 * THRESHOLD)]
        landed = world.first_touch_position(BALL, GROUND)[index]
        return shown if np.isnan(landed).any() else [*shown, Mark(landed, 0.4 * THRESHOLD)]

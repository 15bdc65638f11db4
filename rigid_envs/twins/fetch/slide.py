"""FetchSlide: the closed fingers hit a puck, which slides to a goal out of reach.

The puck of the original touches the table with one or two points, sinks 6 mm into it and tumbles a
little. So how the table brakes it is taken from recorded slides, not from a coefficient: MuJoCo's
friction pyramid limits the sum of the forces along x and y, a slow puck is braked in proportion to
its speed, and once it is as slow as a few centimetres per second it glides on, faster or slower in
each episode. How fast is kept in the world's `memory`, as the difference from the average.
"""

import numpy as np

from physics import Body, Cylinder, Material, Readout, World
from rigid_envs.tasks.rewards import distance
from rigid_envs.twins.fetch.arm import SLIDE_ARM
from rigid_envs.twins.fetch.hand import CLEAR, HAND, OBJECT, RESTING, ClosedHand
from rigid_envs.twins.fetch.pyramid import friction
from rigid_envs.twins.fetch.task import FetchObject

Array = np.ndarray

RADIUS, HALF_HEIGHT, MASS = 0.025, 0.02, 2.0  # m, m and kg, of the puck
REACH = 0.4  # m along x from the hand's start; beyond it the hand can't follow the puck

# identified by `python -m benchmarks.twins identify`
DECELERATION = 1.0  # m/s^2, largest sum of the decelerations along x and y
DAMPING = 6.35  # 1/s, deceleration of a slow puck per speed above that at which it glides
GLIDING = 0.033  # m/s, on average: the middle of those that fit nine of ten slides
GLIDES = 0.028  # m/s, largest difference from that average in an episode

RESTITUTION = 0.37  # of the puck; chosen, see docs/twins.md
# m, chosen, over a hand that rests on the table: of one that is led to the puck, and at most
ABOVE, TOO_HIGH = 6e-3, 0.015
_STEPS = 25  # in which the motion of a puck to the end of its episode is computed


class FetchSlide(FetchObject):
    """The middle of the goals lies 40 cm ahead of the hand; solved within 5 cm of the goal."""

    original = "FetchSlide-v4"
    hand = ClosedHand(SLIDE_ARM)
    start_range = 0.1
    goal_range = 0.3
    goal_offset = 0.4
    start_height = 0.414023
    goal_height = 0.41401894
    ground = start_height - HALF_HEIGHT
    ground_friction = 0.0  # see `braking`
    draw_count = FetchObject.draw_count + 1
    shaping = {"hit": 3.0, "aim": 5.0, "reach": 1.0, "height": 0.5}

    def object(self) -> Body:
        """The puck."""
        return Body(
            Cylinder(RADIUS, HALF_HEIGHT), mass=MASS, position=(0.9, 0.75, self.start_height),
            material=Material(1.0, RESTITUTION), name="puck",
            group=OBJECT, mask=OBJECT | HAND,
        )  # fmt: skip

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """The puck at least 10 cm beside the hand; how fast it glides is drawn, too."""
        goals = super().start(world, mask, draws[:, :-1])
        world.memory("glide", 1)[mask] = GLIDES * (2.0 * draws[:, -1:] - 1.0)
        return goals

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 5 cm along each axis; the table brakes the puck."""
        super().act(world, now, actions)
        force = np.zeros((world.count, 3))
        gliding = GLIDING + world.memory("glide", 1)
        force[:, :2] = world.parameters.mass * braking(
            now.linear_velocity[:, 0, :2], gliding=gliding
        )
        world.apply_wrench(force, body="puck")

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`aim`: minus the distance in m from the goal to where the puck will be after 50 steps.

        `hit`: 1 where it will be at the goal then, falling to 1/e at 5 cm.

        `reach`: minus the distance in m from the hand to a place 5 cm behind the puck, as seen from
        the goal, and above the table, until the puck is out of reach.

        `height`: -1 where the hand is on the table, whose friction would hold it, or so high that
        it would hit the puck's edge.
        """
        end = np.array(achieved, dtype=float)
        left = np.maximum(self.frame * self.max_episode_steps - world.time[:, None], 0.0)
        gliding = GLIDING + world.memory("glide", 1)
        end[:, :2] = predicted(end[:, :2], now.linear_velocity[:, 0, :2], left, gliding)
        above = achieved + np.array([0.0, 0.0, RESTING + ABOVE - self.start_height])
        reach = super().guidance(world, now, above, desired, goal_distance)["reach"]
        height = self.hand.position(now)[:, 2] - RESTING
        wrong = (height < CLEAR) | (height > TOO_HIGH)
        gone = achieved[:, 0] > self.hand.start[0] + REACH
        miss = distance(end, desired)
        hit = np.exp(-((miss / self.threshold) ** 2))
        reach = np.where(gone, 0.0, reach)
        return {"hit": hit, "aim": -miss, "reach": reach, "height": -wrong.astype(float)}


def braking(
    velocity: Array,
    deceleration: float = DECELERATION,
    damping: float = DAMPING,
    gliding: Array | float = GLIDING,
) -> Array:
    """Acceleration [n, 2] m/s^2 of a puck that slides with a velocity [n, 2] m/s.

    A slow puck creeps, braked by damping (v - gliding v / |v|).

    Args:
        velocity: [n, 2] m/s.
        deceleration: see `DECELERATION`.
        damping: see `DAMPING`.
        gliding: m/s, at which it glides on; one number, or [n, 1].
    """
    speed = np.sqrt(np.sum(velocity.astype(float) ** 2, axis=1, keepdims=True))
    slip = velocity * (1.0 - gliding / np.maximum(speed, gliding))
    return friction(slip, deceleration, damping)


def predicted(
    position: Array, velocity: Array, duration: Array | float, gliding: Array | float = GLIDING
) -> Array:
    """Where [n, 2] m a puck that nothing touches will be.

    Args:
        position: [n, 2] m.
        velocity: [n, 2] m/s.
        duration: s, one number, or [n, 1].
        gliding: see `braking`.
    """
    step = duration / _STEPS
    velocity = velocity.astype(float)
    for _ in range(_STEPS):
        after = velocity + step * braking(velocity, gliding=gliding)
        position = position + 0.5 * step * (velocity + after)
        velocity = after
    return position

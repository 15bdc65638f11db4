"""Reach: a finger moves to a point."""

from collections.abc import Sequence

import numpy as np

from physics import Ground, Readout, Scene, World
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Marker
from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

THRESHOLD = 0.015  # m
LOW, HIGH = np.array([-0.15, -0.15, 0.03]), np.array([0.15, 0.15, 0.21])  # m, of goals
MIN_DISTANCE = 0.06  # m, of a goal from the finger's start
GOAL_DRAWS = 4  # goals drawn per episode; the first one that is far enough is used


class Reach(Task):
    """Goals lie in a box of 30 x 30 x 18 cm around the finger; solved within 1.5 cm."""

    finger = Finger((0.0, 0.0, 0.12), (-0.2, -0.2, Finger.RADIUS), (0.2, 0.2, 0.25), 0.05)
    camera = Camera.around((-0.03, -0.03, 0.09), 0.95, azimuth=-75.0, elevation=30.0)

    max_episode_steps = 25
    actions = finger.actions
    bounds = finger.bounds
    goal_bounds = tuple((f"finger {a}", "m", -0.5, 0.5) for a in "xyz")
    draw_count = 3 * GOAL_DRAWS
    reward = Reward(THRESHOLD, {"success": 1.0, "distance": 10.0})

    def scene(self) -> Scene:
        """A finger above the ground."""
        return Scene(bodies=[], statics=[Ground(name="ground")], drives=[self.finger.drive()])

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Finger at home; goal at a random point, at least 6 cm away."""
        world.reset(mask)
        goals = LOW + (HIGH - LOW) * draws.reshape(len(draws), GOAL_DRAWS, 3)
        home = np.array(self.finger.home)
        # the last resort is a corner
        goals = np.concatenate([goals, np.broadcast_to(HIGH, (len(goals), 1, 3))], axis=1)
        away = distance(goals, np.broadcast_to(home, goals.shape)) > MIN_DISTANCE
        return goals[np.arange(len(goals)), np.argmax(away, axis=1)]

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the finger by up to 5 cm along each axis, within its workspace."""
        self.finger.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Position and velocity of the finger."""
        self.finger.observe(now, out)

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the finger."""
        return self.finger.position(now)

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """None: the reward follows from the goals alone."""
        return {}

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """A ball at the goal and a disc below it."""
        return [Goal(goal, THRESHOLD)]

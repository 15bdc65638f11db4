"""Slide: a finger knocks a puck, which slides to a goal that the finger can't reach."""

from collections.abc import Sequence

import numpy as np

from physics import Body, Cylinder, Ground, Material, Readout, Scene, World
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Marker
from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

RADIUS, HEIGHT, MASS = 0.025, 0.02, 0.1  # m, m and kg, of the puck
FRICTION = 0.1  # Coulomb's coefficient of puck and ground
GRAVITY = 9.81  # m/s^2
THRESHOLD = 0.05  # m
START = 0.05  # m, largest offset of the puck's start from the origin along x and y
MIN_GOAL_DISTANCE, MAX_GOAL_DISTANCE = 0.4, 0.8  # m, from the origin
MAX_GOAL_ANGLE = 0.4  # rad, to either side of the x axis


class Slide(Task):
    """The goal lies 40 to 80 cm away, the finger reaches 20 cm; solved within 5 cm of the goal."""

    finger = Finger((-0.15, 0.0, 0.05), (-0.25, -0.2, Finger.RADIUS), (0.2, 0.2, 0.15), 0.05)
    # from behind, so that the finger and the puck are near
    camera = Camera.around((0.28, 0.04, -0.15), 1.45, -165.0, 37.0, field_of_view=36.0)
    workspace = ((-0.25, -0.36, 0.0), (0.85, 0.36, 0.15))

    actions = finger.actions
    bounds = (
        *finger.bounds,
        *((f"puck {a}", "m", -3.0, 3.0) for a in "xyz"),
        *((f"puck quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"puck velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"puck angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"finger to puck {a}", "m", -3.5, 3.5) for a in "xyz"),
    )
    goal_bounds = tuple((f"puck {a}", "m", -3.0, 3.0) for a in "xyz")
    draw_count = 4  # x and y of the puck; distance and angle of the goal
    # a larger puck could touch the finger at home
    size_range = (0.0, 2.0)
    reward = Reward(THRESHOLD, {"success": 1.0, "aim": 10.0, "reach": 1.0})

    def scene(self) -> Scene:
        """A puck on slippery ground, and a finger behind it."""
        material = Material(friction=FRICTION, restitution=0.1)
        puck = Body(
            Cylinder(RADIUS, 0.5 * HEIGHT),
            mass=MASS,
            position=(0, 0, 0.5 * HEIGHT),
            material=material,
            name="puck",
        )
        ground = Ground(material=material, name="ground")
        return Scene(bodies=[puck], statics=[ground], drives=[self.finger.drive()])

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Puck near the origin; goal uniform by area in a sector of a ring."""
        height = np.full(len(draws), 0.5 * HEIGHT)
        if world.features.per_world_parameters:
            height *= world.parameters.size[mask, 0]
        position = np.zeros((len(draws), 1, 3))
        position[:, 0, :2] = START * (2.0 * draws[:, :2] - 1.0)
        position[:, 0, 2] = height
        world.reset(mask)
        world.set_state(position=position, worlds=mask)
        near, far = MIN_GOAL_DISTANCE**2, MAX_GOAL_DISTANCE**2
        radius = np.sqrt(near + (far - near) * draws[:, 2])
        angle = MAX_GOAL_ANGLE * (2.0 * draws[:, 3] - 1.0)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the finger by up to 5 cm along each axis, within its workspace."""
        self.finger.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Position and velocity of the finger; pose and velocity of the puck; the offset to it."""
        self.finger.observe(now, out[:, 0:6])
        out[:, 6:19] = now.kinematics[:, 0]
        out[:, 19:22] = now.position[:, 0] - self.finger.position(now)

    def achieved(self, world: World, now: Readout) -> Array:
        """Position of the puck."""
        return now.position[:, 0]

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`aim`: minus the distance in m from the goal to the place where the puck will stop.

        Friction takes the kinetic energy of a sliding puck: it stops after v^2 / (2 mu g).
        `reach`: minus the distance in m from the finger to the point behind the puck as seen from
        the goal, until the puck has left the finger's workspace.
        """
        velocity = now.linear_velocity[:, 0, :2].astype(float)
        speed = np.sqrt(np.sum(velocity**2, axis=1, keepdims=True))
        stop = achieved.astype(float)
        stop[:, :2] += velocity * speed / (2.0 * self._friction(world) * GRAVITY)
        from_goal = achieved - desired
        radius = np.full(len(achieved), RADIUS)
        if world.features.per_world_parameters:
            radius *= world.parameters.size[:, 0]
        length = np.maximum(goal_distance, 1e-9)  # at the goal any point is behind
        behind = achieved + from_goal * ((radius + Finger.RADIUS) / length)[:, None]
        reach = distance(self.finger.position(now), behind)
        gone = achieved[:, 0] > self.finger.high[0]
        return {"aim": -distance(stop, desired), "reach": np.where(gone, 0.0, -reach)}

    def _friction(self, world: World) -> Array | float:
        """Coulomb's coefficient [count, 1] of puck and ground."""
        if not world.features.per_world_parameters:
            return FRICTION
        # the ground keeps its own; a pair has the geometric mean
        return np.sqrt(FRICTION * np.maximum(world.parameters.friction[:, :1], 1e-6))

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """The goal."""
        return [Goal(goal, THRESHOLD)]

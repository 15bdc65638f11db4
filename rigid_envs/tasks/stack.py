"""Stack: a gripper builds a tower of cubes at a goal."""

from collections.abc import Sequence

import numpy as np

from physics import Body, Box, Ground, Material, Readout, Scene, World
from physics.validation import integer
from rigid_envs.camera import Camera
from rigid_envs.rewards import Reward, distance
from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.task import Task
from rigid_envs.view import BODY_COLORS, Ghost, Sign

Array = np.ndarray

HALF = 0.02  # m, half a cube's width
MASS = 0.1  # kg
# m, of a grid of 3 x 3 places about the origin, in each of which starts at most one cube
CELL = 0.12
JITTER = 0.01  # m, by which cube or goal may lie beside the middle of its place
THRESHOLD = 0.02  # m
REACH = 0.1  # m, over which the shaped terms fall
PLACES = CELL * np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1)])


class Stack(Task):
    """Cube i belongs at level i of the tower; solved when all stand and no finger touches any.

    Args:
        blocks: number of cubes, 2 to 5.
    """

    hand = Hand(home=(0.0, 0.0, 0.2), low=(-0.2, -0.2, 0.016), high=(0.2, 0.2, 0.3), stride=0.05)
    # the fingers close across the picture
    camera = Camera(target=(0.0, 0.0, 0.14), distance=1.15, azimuth=-25.0, elevation=26.0)
    # below, a cube beside the tower would be within the threshold of its place on it; above, the
    # open fingers about a cube would reach the next one
    sizes = (0.5, 1.5)

    def __init__(self, blocks: int = 2) -> None:
        """Lists what is observed of so many cubes."""
        self.blocks = integer("blocks", blocks, low=2)
        if self.blocks > 5:
            raise ValueError(f"blocks must be at most 5, got {blocks!r}")
        self.actions = self.hand.actions
        self.bounds = (
            *self.hand.bounds,
            *(entry for i in range(self.blocks) for entry in _cube_bounds(f"cube {i}")),
        )
        self.goal_bounds = (
            *((f"cube {i} {a}", "m", -1.0, 1.0) for i in range(self.blocks) for a in "xyz"),
            ("released", "m", 0.0, 1.0),
        )
        self.draws = len(PLACES) + 2 * (self.blocks + 1)
        # never above 0: else it would pay to put the end off where success ends an episode
        self.reward = Reward(THRESHOLD, {"success": 1.0, "stage": 1.0, "time": -2.0})

    def scene(self) -> Scene:
        """Cubes on the ground, and an open gripper above them."""
        material = Material(friction=0.5, restitution=0.1)
        pads = Material(friction=2.0, restitution=0.0)
        cube = Box((HALF,) * 3)
        return Scene(
            bodies=[
                Body(cube, mass=MASS, position=(*PLACES[i], HALF), material=material)
                for i in range(self.blocks)
            ],
            statics=[Ground(material)],
            drives=[self.hand.gripper(self.hand.widest, pads)],
        )

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Cubes in places of their own, square to the fingers; the tower in one that is free.

        Heights are those of cubes of each world's sizes.
        """
        n, count = self.blocks, len(draws)
        order = np.argsort(draws[:, : len(PLACES)], axis=1)[:, : n + 1]
        jitter = JITTER * (2.0 * draws[:, len(PLACES) :].reshape(count, n + 1, 2) - 1.0)
        places = PLACES[order] + jitter
        size = world.parameters.size[mask] if world.features.varied else np.ones((count, n))
        position = np.empty((count, n, 3))
        position[:, :, :2] = places[:, :n]
        position[:, :, 2] = HALF * size
        world.reset(mask)
        world.set_state(position=position, worlds=mask)

        goals = np.ones((count, 3 * n + 1))
        tower = goals[:, :-1].reshape(count, n, 3)
        tower[:, :, :2] = places[:, n, None]
        tower[:, :, 2] = HALF * (2.0 * np.cumsum(size, axis=1) - size)
        return goals

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 5 cm along each axis, and its fingers."""
        self.hand.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """The hand; poses and velocities of the cubes, and the way from the hand to each."""
        first = len(self.hand.bounds)
        self.hand.observe(now, out[:, :first])
        for i in range(self.blocks):
            cube = out[:, first + 16 * i : first + 16 * (i + 1)]
            cube[:, :13] = now.kinematics[:, i]
            cube[:, 13:] = now.position[:, i] - out[:, 0:3]

    def achieved(self, world: World, now: Readout) -> Array:
        """Where the cubes are, and 1 where no finger touches any."""
        cubes = [now.position[:, i] for i in range(self.blocks)]
        free = self._pressing(world).max(axis=(0, 1)) <= 0.0
        return np.concatenate([*cubes, free[:, None]], axis=1)

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, apart: Array
    ) -> dict[str, Array]:
        """`placed`: cubes that stand, from below; `reach`, `grasp` and `place` of the next.

        They are 0 to 1, and so is `stage`, all of it in one number.
        """
        n, hand = self.blocks, self.hand.place(now)
        goal = [slice(3 * i, 3 * i + 3) for i in range(n)]
        away = np.array([distance(achieved[:, i], desired[:, i]) for i in goal])
        reach = np.array([distance(achieved[:, i], hand) for i in goal])
        placed = np.cumprod(away <= THRESHOLD, axis=0).sum(axis=0)
        done = placed == n
        next_one = np.minimum(placed, n - 1)[None]
        near = _near(np.take_along_axis(reach, next_one, axis=0)[0])
        place = _near(np.take_along_axis(away, next_one, axis=0)[0])
        both = self._pressing(world).min(axis=1) > 0.0
        held = np.take_along_axis(both, next_one, axis=0)[0]
        free = achieved[:, -1]
        stage = np.where(done, 0.5 * free, 0.3 * near + 0.2 * held + 0.5 * place)
        return {
            "placed": placed.astype(float),
            "reach": np.where(done, 1.0, near),
            "grasp": np.where(done, free, held).astype(float),
            "place": np.where(done, 1.0, place),
            "stage": (placed + stage) / (n + 0.5),
        }

    def signs(self, world: World, index: int, goal: Array) -> Sequence[Sign]:
        """A place for each cube, in its colour."""
        places = goal[:-1].reshape(-1, 3)
        size = world.parameters.size[index] if world.features.varied else np.ones(self.blocks)
        halves = np.full((self.blocks, 3), HALF) * size[:, None]
        return [Ghost(h, p, c) for h, p, c in zip(halves, places, BODY_COLORS, strict=False)]

    def _pressing(self, world: World) -> Array:
        """[blocks, 2, count] N with which each finger presses each cube."""
        n = self.blocks
        pairs = [[world.pressing(i, n + finger) for finger in (0, 1)] for i in range(n)]
        return np.array(pairs)


def _near(apart: Array) -> Array:
    """1 at no distance, falling to 0 over some `REACH` m."""
    return 1.0 - np.tanh(apart / REACH)


def _cube_bounds(name: str) -> tuple[tuple[str, str, float, float], ...]:
    return (
        *((f"{name} {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"{name} quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"{name} velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"{name} angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"hand to {name} {a}", "m", -2.0, 2.0) for a in "xyz"),
    )

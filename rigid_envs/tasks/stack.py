"""Stack: a gripper builds a tower of cubes at a goal."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from physics import Body, Box, Fidelity, Ground, Material, Readout, Scene, World
from physics.scene.validation import integer, number
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import BODY_COLORS, Ghost, Sign
from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Task

Array = np.ndarray

HALF = 0.02  # m, half a cube's width
MASS = 0.1  # kg
# m, of a grid of 3 x 3 places about the origin, in each of which starts at most one cube
CELL = 0.12
JITTER = 0.01  # m, by which cube or goal may lie beside the middle of its place
THRESHOLD = 0.02  # m
NEAR = 0.15  # m of way, in which the shaped terms fall to 1/e
# m above its end at which a way over other cubes leads; m in which it may lead down, to half a
# cube beside its end; and how many times a way up counts: what stays low runs into cubes
OVER, DOWN, CLIMB = 0.05, 0.04, 3.0
# of the terms of a cube, in what is done of its stage
STAGE = {"reach": 0.15, "grasp": 0.1, "place": 0.4, "release": 0.35}
# m beside its place along x and y, and above it, at which a cube held at the start is at most
ASIDE, HIGHER = 0.05, 0.08
PLACES = CELL * np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1)])


class Next(NamedTuple):
    """Of each world's next cube: the lowest that isn't placed, or the last where all are.

    Attributes:
        placed: [count] cubes that stand, let go, from below.
        cube: [count, 3] m, where it is.
        place: [count, 3] m, where it belongs.
        held: [count] whether both fingers press it, beside it.
    """

    placed: Array
    cube: Array
    place: Array
    held: Array


class Stack(Task):
    """Cube i belongs at level i of the tower; solved when all stand and no finger touches any.

    Args:
        blocks: number of cubes, 2 to 5.
        begun: share of episodes that start with a tower begun, of one cube or more, all but one at
            most, each number as often. An easier way in for training: where a tower of one is
            common, what comes after it is learned too.
        at_hand: share of episodes that start with the next cube at hand: in half of them between
            open fingers where it lies, in the others held by the closed ones above its place. A
            learner that is told nothing but success meets it sooner.
    """

    hand = Hand(home=(0.0, 0.0, 0.2), low=(-0.2, -0.2, 0.016), high=(0.2, 0.2, 0.3), stride=0.05)
    # the fingers close across the picture
    camera = Camera(target=(0.0, 0.0, 0.14), distance=1.15, azimuth=-25.0, elevation=26.0)
    # below, a cube beside the tower would be within the threshold of its place on it; above, the
    # open fingers about a cube would reach the next one
    sizes = (0.5, 1.5)
    guides = (
        *((f"hand to next cube {a}", "m", -2.0, 2.0) for a in "xyz"),
        *((f"next cube to its place {a}", "m", -2.0, 2.0) for a in "xyz"),
        ("share placed", "", 0.0, 1.0),
    )

    def __init__(self, blocks: int = 2, begun: float = 0.0, at_hand: float = 0.0) -> None:
        """Lists what is observed of so many cubes."""
        self.blocks = integer("blocks", blocks, low=2)
        self.begun = number("begun", begun, low=0.0, high=1.0)
        self.at_hand = number("at_hand", at_hand, low=0.0, high=1.0)
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
        # the last five are of easier starts
        self.draws = len(PLACES) + 2 * (self.blocks + 1) + 5
        self._held: dict[Fidelity, tuple[Array, Array]] = {}
        self.reward = Reward(THRESHOLD, {"success": 1.0, "stage": 1.0}, hurry=-2.0)

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
        beside = draws[:, len(PLACES) : len(PLACES) + 2 * (n + 1)].reshape(count, n + 1, 2)
        jitter = JITTER * (2.0 * beside - 1.0)
        places = PLACES[order] + jitter
        size = world.parameters.size[mask] if world.features.varied else np.ones((count, n))
        position = np.empty((count, n, 3))
        position[:, :, :2] = places[:, :n]
        position[:, :, 2] = HALF * size

        goals = np.ones((count, 3 * n + 1))
        tower = goals[:, :-1].reshape(count, n, 3)
        tower[:, :, :2] = places[:, n, None]
        tower[:, :, 2] = HALF * (2.0 * np.cumsum(size, axis=1) - size)
        stand = np.zeros(count, dtype=int)
        if self.begun:
            ahead = 1.0 - draws[:, -5] / self.begun  # above 0 in the share, evenly up to 1
            stand = np.maximum(np.ceil(ahead * (n - 1)), 0.0).astype(int)
            position = np.where((np.arange(n) < stand[:, None])[:, :, None], tower, position)
        world.reset(mask)
        world.set_state(position=position, worlds=mask)
        near = draws[:, -4] < self.at_hand
        if near.any():
            worlds = np.zeros(len(mask), dtype=bool)
            worlds[np.flatnonzero(mask)[near]] = True
            cubes, of = position[near], (np.arange(near.sum()), stand[near])
            fingers = self.hand.fingers(np.maximum(cubes[of], self.hand.low))
            held = draws[near, -4] < 0.5 * self.at_hand
            own = size[near][of]
            above = self._above(tower[near][of], own, size[near].max(axis=1), draws[near, -3:])
            pads, cube = self._holding(world)
            pads = above[:, None] + pads - cube
            pads[:, :, 1] += HALF * (own - 1.0)[:, None] * (-1.0, 1.0)
            cubes[of] = np.where(held[:, None], above, cubes[of])
            fingers = np.where(held[:, None, None], pads, fingers)
            world.set_state(position=cubes, drive_position=fingers, worlds=worlds)
        return goals

    def _above(self, place: Array, own: Array, largest: Array, draws: Array) -> Array:
        """[n, 3] m, where cubes of sizes [n] are held: by their place, clear of all other cubes.

        Clear of those in the places around it, which are as large as `largest` [n] at most, and so
        are the pads, which reach farther along y, and below small cubes.
        """
        room = CELL - 2.0 * JITTER - HALF * (own + largest)
        room = np.stack([room, room - 2.0 * self.hand.PAD], axis=1)
        beside = np.empty_like(place)
        beside[:, :2] = np.minimum(np.maximum(room, 0.0), ASIDE) * (2.0 * draws[:, :2] - 1.0)
        beside[:, 2] = np.maximum(self.hand.PAD - HALF * own, 0.0) + HIGHER * draws[:, 2]
        return np.maximum(place + beside, self.hand.low)

    def _holding(self, world: World) -> tuple[Array, Array]:
        """See `Hand.hold`, of a cube."""
        if world.fidelity not in self._held:
            scene = self.scene()
            cube = replace(scene.bodies[0], position=self.hand.home)
            hand = self.hand.gripper(2.0 * HALF, scene.drives[0].material)
            alone = replace(scene, bodies=(cube,), drives=(hand,))
            self._held[world.fidelity] = self.hand.hold(alone, world, self.frame)
        return self._held[world.fidelity]

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

    def guide(
        self, world: World, now: Readout, achieved: Array, desired: Array, out: Array
    ) -> None:
        """The way to the next cube, its way to its place, and how much of the tower stands."""
        of = self._next(world, now, achieved, desired)
        out[:, 0:3] = of.cube - self.hand.place(now)
        out[:, 3:6] = of.place - of.cube
        out[:, 6] = of.placed / self.blocks

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, apart: Array
    ) -> dict[str, Array]:
        """`placed`: cubes that stand, let go, from below; what is done of the next; and `stage`.

        Of the next: `reach`, `grasp`, `place` and `release`, each 0 to 1. `stage`, 0 to 1 too, is
        all of it in one number.
        """
        n, hand, of = self.blocks, self.hand.place(now), self._next(world, now, achieved, desired)
        done, there = of.placed == n, distance(of.cube, of.place) <= THRESHOLD
        # fingers that stand open about a cube should feel that they could close
        about = np.all(np.abs(hand - of.cube) < HALF, axis=1)
        closing = about * np.minimum(1.0 - self.hand.asked(now) / self.hand.widest, 0.5)
        terms = {
            "reach": _near(_way(hand, of.cube)),
            # a hand that lets go of a cube in its place loses nothing
            "grasp": np.where(there | of.held, 1.0, closing),
            "place": _near(_way(of.cube, of.place)),
            # a hand that only asks for a little less than a tight grip should feel it
            "release": there * self.hand.slackness(now),
        }
        terms = {name: np.where(done, 1.0, term) for name, term in terms.items()}
        stage = sum(weight * terms[name] for name, weight in STAGE.items())
        return {
            "placed": of.placed.astype(float),
            **terms,
            "stage": np.where(done, n, of.placed + stage) / n,
        }

    def signs(self, world: World, index: int, goal: Array) -> Sequence[Sign]:
        """A place for each cube, in its colour."""
        places = goal[:-1].reshape(-1, 3)
        size = world.parameters.size[index] if world.features.varied else np.ones(self.blocks)
        halves = np.full((self.blocks, 3), HALF) * size[:, None]
        return [Ghost(h, p, c) for h, p, c in zip(halves, places, BODY_COLORS, strict=False)]

    def _next(self, world: World, now: Readout, achieved: Array, desired: Array) -> Next:
        """What is to be done next, of goals [count, goal]."""
        n, worlds = self.blocks, np.arange(len(achieved))
        cubes, places = (goals[:, :-1].reshape(-1, n, 3) for goals in (achieved, desired))
        stand = np.array([distance(cubes[:, i], places[:, i]) <= THRESHOLD for i in range(n)])
        # closed fingers may press a cube from above, and those about one the cube below it
        beside = np.abs(cubes[:, :, 2].T - self.hand.place(now)[:, 2]) < HALF
        held = beside & (self._pressing(world).min(axis=1) > 0.0)
        placed = np.cumprod(stand & ~held, axis=0).sum(axis=0)
        which = np.minimum(placed, n - 1)
        cube, place = (of[worlds, which].astype(float) for of in (cubes, places))
        return Next(placed, cube, place, held[which, worlds])

    def _pressing(self, world: World) -> Array:
        """[blocks, 2, count] N with which each finger presses each cube."""
        n = self.blocks
        pairs = [[world.pressing(i, n + finger) for finger in (0, 1)] for i in range(n)]
        return np.array(pairs)


def _way(start: Array, end: Array) -> Array:
    """Length [n] m of a way from start to end [n, 3] m, over what stands between: up, across, down.

    A straight way would end at another cube, or pay a hand for staying down beside the tower.
    """
    across = np.sqrt(np.sum((end - start)[:, :2] ** 2, axis=1))
    over = OVER * np.clip((across - HALF) / DOWN, 0.0, 1.0)
    level = np.maximum(start[:, 2], end[:, 2] + over)
    return CLIMB * (level - start[:, 2]) + across + np.abs(level - end[:, 2])


def _near(way: Array) -> Array:
    """1 at no distance; 1/e less with every `NEAR` m of way."""
    return np.exp(-way / NEAR)


def _cube_bounds(name: str) -> tuple[tuple[str, str, float, float], ...]:
    return (
        *((f"{name} {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"{name} quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"{name} velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"{name} angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"hand to {name} {a}", "m", -2.0, 2.0) for a in "xyz"),
    )

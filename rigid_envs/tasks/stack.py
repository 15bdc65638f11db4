"""Stack: a gripper builds a tower of cubes at a goal."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from physics import Body, Box, Fidelity, Ground, Material, Readout, Scene, World
from physics.scene.validation import integer, number
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import BODY_COLORS, Ghost, Marker
from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.rewards import Reward, distance
from rigid_envs.tasks.task import Bounds, Task

Array = np.ndarray

HALF = 0.02  # m, half the width of a cube
MASS = 0.1  # kg
THRESHOLD = 0.02  # m

# start: cubes and tower stand on different cells of a 3 x 3 grid about the origin
CELL = 0.12  # m, width of a cell
JITTER = 0.01  # m, largest offset from the middle of a cell along x and y
CELL_CENTERS = CELL * np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1)])
# m, largest offset along x and y, and largest height above its goal, of a cube that is held at the
# start
HELD_OFFSET, HELD_HEIGHT = 0.05, 0.08

# dense reward: weights of the next cube's terms within `stage`, and of those of a finished tower
STAGE_WEIGHTS = {"reach": 0.15, "grasp": 0.1, "place": 0.4, "release": 0.35}
RETREAT_WEIGHT, PRECISION_WEIGHT = 0.3, 0.5
# `place` of a cube that is not held, relative to that of one that is: cubes are to be carried, as a
# cube that is pushed along the ground cannot be placed on another (chosen by a few trials)
PUSHED = 0.2
RETREAT = 0.1  # m above the place of the top cube at which `retreat` is 1
DECAY_LENGTH = 0.15  # m of path after which `reach` and `place` fall to 1/e
# Paths lead over other cubes, at the height of their end plus PASS_HEIGHT (m). The extra height
# falls to 0 while the horizontal distance to the end falls from HALF + DESCENT to HALF (m). Rising
# counts CLIMB_FACTOR times, since a hand or a cube that moves low runs into other cubes
PASS_HEIGHT, DESCENT, CLIMB_FACTOR = 0.05, 0.04, 3.0


class NextCube(NamedTuple):
    """The cube to place next in each world: the lowest that is not placed, or the last cube.

    Attributes:
        placed: [count] number of cubes, counted from the bottom, that are at their goal and not
            held.
        position: [count, 3] m, where the cube is.
        goal: [count, 3] m, where it belongs.
        held: [count] whether both fingers press on it from its sides.
        largest_distance: [count] m, of any cube from its goal.
    """

    placed: Array
    position: Array
    goal: Array
    held: Array
    largest_distance: Array


class Stack(Task):
    """Cube i belongs at level i of the tower. Solved when all stand and no finger touches any cube.

    Args:
        blocks: number of cubes, 2 to 5.
        partial_tower_start_prob: fraction of episodes that start with a part of the tower already
            built: at least one cube and at most all but one, each number equally likely. These
            starts make training easier: the agent practises the later cubes from the beginning.
        near_grasp_start_prob: fraction of episodes that start with the hand at the next cube. In
            half of them, the cube lies between the open fingers. In the other half, the closed
            fingers hold the cube near its goal. With the sparse reward, an agent succeeds earlier
            from these starts.
    """

    hand = Hand(home=(0.0, 0.0, 0.2), low=(-0.2, -0.2, 0.016), high=(0.2, 0.2, 0.3), stride=0.05)
    # azimuth chosen so that the fingers close across the frame
    camera = Camera.around((0.0, 0.0, 0.14), distance=1.15, azimuth=-25.0, elevation=26.0)
    max_episode_steps = 100
    # with smaller cubes, a cube next to the tower would be within the threshold of its goal on the
    # tower; with larger cubes, fingers that are open about a cube would reach the next cube
    size_range = (0.5, 1.5)
    guide_bounds = (
        *((f"hand to next cube {a}", "m", -2.0, 2.0) for a in "xyz"),
        *((f"next cube to its goal {a}", "m", -2.0, 2.0) for a in "xyz"),
        ("fraction placed", "", 0.0, 1.0),
    )

    def __init__(
        self,
        blocks: int = 2,
        partial_tower_start_prob: float = 0.0,
        near_grasp_start_prob: float = 0.0,
    ) -> None:
        """Sets the bounds, which depend on the number of cubes."""
        self.blocks = integer("blocks", blocks, low=2)
        if self.blocks > 5:
            raise ValueError(f"blocks must be at most 5, got {blocks!r}")
        self.partial_tower_start_prob = number(
            "partial_tower_start_prob", partial_tower_start_prob, low=0.0, high=1.0
        )
        self.near_grasp_start_prob = number(
            "near_grasp_start_prob", near_grasp_start_prob, low=0.0, high=1.0
        )
        self.actions = self.hand.actions
        self.bounds = (
            *self.hand.bounds,
            *(bound for i in range(self.blocks) for bound in _cube_bounds(f"cube {i}")),
        )
        self.goal_bounds = (
            *((f"cube {i} {a}", "m", -1.0, 1.0) for i in range(self.blocks) for a in "xyz"),
            ("released", "", 0.0, 1.0),
        )
        # cells, offsets within the cells, and five numbers for the easier starts
        self.draw_count = len(CELL_CENTERS) + 2 * (self.blocks + 1) + 5
        self._grasps: dict[Fidelity, tuple[Array, Array]] = {}
        weights = {
            "success": 1.0,
            "stage": 1.0,
            "retreat": RETREAT_WEIGHT,
            "precision": PRECISION_WEIGHT,
        }
        self.reward = Reward(THRESHOLD, weights, time_penalty=2.0)

    def scene(self) -> Scene:
        """Cubes on the ground, and an open gripper above them."""
        material = Material(friction=0.5, restitution=0.1)
        pads = Material(friction=2.0, restitution=0.0)
        cube = Box((HALF,) * 3)
        return Scene(
            bodies=[
                Body(
                    cube,
                    mass=MASS,
                    position=(*CELL_CENTERS[i], HALF),
                    material=material,
                    name=f"cube {i}",
                )
                for i in range(self.blocks)
            ],
            statics=[Ground(material, name="ground")],
            drives=[self.hand.gripper(self.hand.max_opening, pads)],
        )

    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Cubes on different cells, aligned with the fingers; the goal on a cell that is free.

        Heights follow the sizes of the cubes in each world.
        """
        n, count, cells = self.blocks, len(draws), len(CELL_CENTERS)
        order = np.argsort(draws[:, :cells], axis=1)[:, : n + 1]
        offset = draws[:, cells : cells + 2 * (n + 1)].reshape(count, n + 1, 2)
        places = CELL_CENTERS[order] + JITTER * (2.0 * offset - 1.0)
        size = (
            world.parameters.size[mask]
            if world.features.per_world_parameters
            else np.ones((count, n))
        )
        cubes = np.empty((count, n, 3))
        cubes[:, :, :2] = places[:, :n]
        cubes[:, :, 2] = HALF * size

        goals = np.ones((count, 3 * n + 1))
        tower = goals[:, :-1].reshape(count, n, 3)
        tower[:, :, :2] = places[:, n, None]
        tower[:, :, 2] = HALF * (2.0 * np.cumsum(size, axis=1) - size)

        placed = np.zeros(count, dtype=int)
        if self.partial_tower_start_prob:
            # positive in the chosen fraction of episodes, where it is uniform in (0, 1]
            progress = 1.0 - draws[:, -5] / self.partial_tower_start_prob
            placed = np.maximum(np.ceil(progress * (n - 1)), 0.0).astype(int)
            cubes = np.where((np.arange(n) < placed[:, None])[:, :, None], tower, cubes)
        world.reset(mask)
        world.set_state(position=cubes, worlds=mask)
        if self.near_grasp_start_prob:
            near = draws[:, -4] < self.near_grasp_start_prob
            worlds = np.zeros(len(mask), dtype=bool)
            worlds[np.flatnonzero(mask)[near]] = True
            self._start_at_cube(
                world, worlds, cubes[near], tower[near], size[near], placed[near], draws[near, -4:]
            )
        return goals

    def _start_at_cube(
        self,
        world: World,
        worlds: Array,
        cubes: Array,
        tower: Array,
        size: Array,
        placed: Array,
        draws: Array,
    ) -> None:
        """Puts the hand at the next cube: open around the cube, or holding it near its goal.

        Args:
            world: the worlds to write to.
            worlds: [count] bool; n of its entries are true.
            cubes: [n, blocks, 3] m, the cubes' positions.
            tower: [n, blocks, 3] m, the cubes' goals.
            size: [n, blocks] factors.
            placed: [n] number of cubes that are in the tower already.
            draws: [n, 4] random numbers.
        """
        if not worlds.any():
            return
        next_cube = np.arange(len(cubes)), placed
        own_size = size[next_cube]
        held = draws[:, 0] < 0.5 * self.near_grasp_start_prob
        open_pads = self.hand.pad_positions(np.maximum(cubes[next_cube], self.hand.low))

        held_cube = self._held_positions(tower[next_cube], own_size, size.max(axis=1), draws[:, 1:])
        pads, cube = self._settled_grasp(world)
        closed_pads = held_cube[:, None] + pads - cube
        closed_pads[:, :, 1] += HALF * (own_size - 1.0)[:, None] * (-1.0, 1.0)

        cubes[next_cube] = np.where(held[:, None], held_cube, cubes[next_cube])
        pads = np.where(held[:, None, None], closed_pads, open_pads)
        world.set_state(position=cubes, drive_position=pads, worlds=worlds)

    def _held_positions(
        self, goal: Array, own_size: Array, largest_size: Array, draws: Array
    ) -> Array:
        """Positions [n, 3] m of held cubes: near their goal, clear of all other cubes.

        Cubes in the cells around the goal have at most the size `largest_size` [n]. Cube and pads
        have to stay clear of them. The pads reach further along y than the cube, and further down
        than a small cube.
        """
        room = CELL - 2.0 * JITTER - HALF * (own_size + largest_size)
        room = np.stack([room, room - 2.0 * self.hand.PAD], axis=1)
        offset = np.empty_like(goal)
        offset[:, :2] = np.minimum(np.maximum(room, 0.0), HELD_OFFSET) * (2.0 * draws[:, :2] - 1.0)
        offset[:, 2] = np.maximum(self.hand.PAD - HALF * own_size, 0.0) + HELD_HEIGHT * draws[:, 2]
        return np.maximum(goal + offset, self.hand.low)

    def _settled_grasp(self, world: World) -> tuple[Array, Array]:
        """`Hand.settled_grasp` of a cube, computed once per fidelity."""
        if world.fidelity not in self._grasps:
            scene = self.scene()
            cube = replace(scene.bodies[0], position=self.hand.home)
            hand = self.hand.gripper(2.0 * HALF, scene.drives[0].material)
            alone = replace(scene, bodies=(cube,), drives=(hand,))
            self._grasps[world.fidelity] = self.hand.settled_grasp(alone, world, self.frame)
        return self._grasps[world.fidelity]

    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Moves the hand by up to 5 cm along each axis, and its fingers."""
        self.hand.act(world, now, actions, self.frame)

    def observe(self, world: World, now: Readout, out: Array) -> None:
        """The hand; pose and velocity of each cube, and the offset from the hand to it."""
        first = len(self.hand.bounds)
        self.hand.observe(now, out[:, :first])
        for i in range(self.blocks):
            cube = out[:, first + 16 * i : first + 16 * (i + 1)]
            cube[:, :13] = now.kinematics[:, i]
            cube[:, 13:] = now.position[:, i] - out[:, 0:3]

    def achieved(self, world: World, now: Readout) -> Array:
        """Positions of the cubes, and 1 where no finger touches any cube."""
        cubes = [now.position[:, i] for i in range(self.blocks)]
        released = self._finger_forces(world).max(axis=(0, 1)) <= 0.0
        return np.concatenate([*cubes, released[:, None]], axis=1)

    def guide(
        self, world: World, now: Readout, achieved: Array, desired: Array, out: Array
    ) -> None:
        """Offset to the next cube, its offset to its goal, and the fraction of cubes placed."""
        cube = self._next_cube(world, now, achieved, desired)
        out[:, 0:3] = cube.position - self.hand.position(now)
        out[:, 3:6] = cube.goal - cube.position
        out[:, 6] = cube.placed / self.blocks

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """`placed`; the next cube's `reach`, `grasp`, `place`, `release`; the tower's terms.

        `placed` is the number of cubes that stand in the tower and are not held. The four terms of
        the next cube lie within 0 and 1. `stage` combines all of them in one number from 0 to 1.
        `retreat` rises with the hand above a finished tower, and `precision` is higher the nearer
        its cubes are to their places, both from 0 to 1.
        """
        n, hand = self.blocks, self.hand.position(now)
        cube = self._next_cube(world, now, achieved, desired)
        all_placed = cube.placed == n
        at_goal = distance(cube.position, cube.goal) <= THRESHOLD
        opened = self.hand.commanded_opening(now) / self.hand.max_opening
        # fingers around a cube are rewarded for starting to close, and for pressing firmly: a cube
        # that is held loosely slips when it is lifted
        around = np.all(np.abs(hand - cube.position) < HALF, axis=1)
        grip = np.where(
            cube.held, np.maximum(1.0 - opened, 0.5), around * np.minimum(1.0 - opened, 0.5)
        )
        terms = {
            "reach": proximity(path_length(hand, cube.position)),
            # 1 at the goal too, so that letting go of the cube there costs nothing
            "grasp": np.where(at_goal, 1.0, grip),
            "place": proximity(path_length(cube.position, cube.goal))
            * np.where(cube.held | at_goal, 1.0, PUSHED),
            # rises as soon as the action asks for a weaker grip, before the fingers move; a grip
            # that still holds a cube of 4 cm earns less than half of it
            "release": at_goal * opened,
        }
        # `release` is kept where all are placed, so that opening the fingers still pays: they are
        # then clear of the tower
        terms = {
            name: term if name == "release" else np.where(all_placed, 1.0, term)
            for name, term in terms.items()
        }
        stage = sum(weight * terms[name] for name, weight in STAGE_WEIGHTS.items())
        above = hand[:, 2] - cube.goal[:, 2]
        return {
            "placed": cube.placed.astype(float),
            **terms,
            "stage": (np.minimum(cube.placed, n - 1) + stage) / n,
            "retreat": all_placed * np.clip(above / RETREAT, 0.0, 1.0),
            "precision": all_placed * np.maximum(1.0 - cube.largest_distance / THRESHOLD, 0.0),
        }

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """The outline of each cube at its goal, in the colour of the cube."""
        places = goal[:-1].reshape(-1, 3)
        size = (
            world.parameters.size[index]
            if world.features.per_world_parameters
            else np.ones(self.blocks)
        )
        halves = np.full((self.blocks, 3), HALF) * size[:, None]
        return [Ghost(h, p, c) for h, p, c in zip(halves, places, BODY_COLORS, strict=False)]

    def _next_cube(self, world: World, now: Readout, achieved: Array, desired: Array) -> NextCube:
        """The cube to place next, given goals [count, goal]."""
        n = self.blocks
        # [blocks, 3, count]: NumPy is faster where the worlds come last, as in a readout
        cubes, places = (goals[:, :-1].T.reshape(n, 3, -1) for goals in (achieved, desired))
        distances = np.array([distance(a.T, b.T) for a, b in zip(cubes, places, strict=True)])
        at_goal = distances <= THRESHOLD
        # fingers that press on a cube from above do not hold it: closed fingers, or fingers around
        # a cube that stands on it
        same_height = np.abs(cubes[:, 2] - self.hand.position(now)[:, 2]) < HALF
        held = same_height & (self._finger_forces(world).min(axis=1) > 0.0)
        placed, stands = np.zeros(len(achieved), dtype=int), True
        for i in range(n):
            stands = stands & at_goal[i] & ~held[i]
            placed += stands

        def of_next(values: Array) -> Array:  # of the last cube where all are placed
            chosen = values[0]
            for i in range(1, n):
                chosen = np.where(placed >= i, values[i], chosen)
            return chosen

        position, goal = (of_next(points).T.astype(float) for points in (cubes, places))
        return NextCube(placed, position, goal, of_next(held), distances.max(axis=0))

    def _finger_forces(self, world: World) -> Array:
        """Normal forces [blocks, 2, count] in N between each cube and each finger."""
        n = self.blocks
        forces = [[world.normal_force(i, n + finger) for finger in (0, 1)] for i in range(n)]
        return np.array(forces)


def path_length(start: Array, end: Array) -> Array:
    """Length [n] m of a path that leads up, across and down, from start to end, both [n, 3] m.

    The path passes over other cubes. With the length of a straight path instead, the reward would
    lead the hand into cubes that are in between, or keep it down next to the tower.
    """
    x, y, _ = (end - start).T
    across = np.sqrt(x**2 + y**2)
    clearance = PASS_HEIGHT * np.minimum(np.maximum((across - HALF) / DESCENT, 0.0), 1.0)
    level = np.maximum(start[:, 2], end[:, 2] + clearance)
    return CLIMB_FACTOR * (level - start[:, 2]) + across + np.abs(level - end[:, 2])


def proximity(length: Array) -> Array:
    """1 at a path length of 0 m; falls by 1/e with every `DECAY_LENGTH`."""
    return np.exp(-length / DECAY_LENGTH)


def _cube_bounds(name: str) -> Bounds:
    return (
        *((f"{name} {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"{name} quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"{name} velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"{name} angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"hand to {name} {a}", "m", -2.0, 2.0) for a in "xyz"),
    )

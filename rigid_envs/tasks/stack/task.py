"""Stack: a gripper builds a tower of cubes at a goal."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from physics import Body, Box, Fidelity, Ground, Material, Readout, Scene, World
from physics.scene.validation import integer, number
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import BODY_COLORS, GOAL_COLOR, Ghost, Marker
from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.rewards import Reward
from rigid_envs.tasks.stack.reward import WEIGHTS, reward_terms
from rigid_envs.tasks.stack.starts import CELL_CENTERS, Grasp, built, hand_at_cube, random_cells
from rigid_envs.tasks.stack.tower import HALF, MASS, THRESHOLD, NextCube, next_cube, tower
from rigid_envs.tasks.task import Bounds, Task

Array = np.ndarray


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
        self._grasps: dict[Fidelity, Grasp] = {}
        self.reward = Reward(THRESHOLD, WEIGHTS, time_penalty=2.0)

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
        places = random_cells(draws[:, : cells + 2 * (n + 1)], n + 1)
        size = (
            world.parameters.size[mask]
            if world.features.per_world_parameters
            else np.ones((count, n))
        )
        cubes = np.empty((count, n, 3))
        cubes[:, :, :2] = places[:, :n]
        cubes[:, :, 2] = HALF * size
        goals = np.ones((count, 3 * n + 1))
        levels = goals[:, :-1].reshape(count, n, 3)
        levels[:] = tower(places[:, n], size)

        placed = np.zeros(count, dtype=int)
        if self.partial_tower_start_prob:
            placed = built(draws[:, -5], self.partial_tower_start_prob, n)
            cubes = np.where((np.arange(n) < placed[:, None])[:, :, None], levels, cubes)
        world.reset(mask)
        world.set_state(position=cubes, worlds=mask)
        if self.near_grasp_start_prob:
            near = draws[:, -4] < self.near_grasp_start_prob
            worlds = np.zeros(len(mask), dtype=bool)
            worlds[np.flatnonzero(mask)[near]] = True
            self._start_at_cube(
                world, worlds, cubes[near], levels[near], size[near], placed[near], draws[near, -4:]
            )
        return goals

    def _start_at_cube(
        self,
        world: World,
        worlds: Array,
        cubes: Array,
        levels: Array,
        size: Array,
        placed: Array,
        draws: Array,
    ) -> None:
        """Puts the hand at the next cube, see `hand_at_cube`.

        Args:
            world: the worlds to write to.
            worlds: [count] bool; n of its entries are true.
            cubes: [n, blocks, 3] m, the cubes' positions.
            levels: [n, blocks, 3] m, the cubes' goals.
            size: [n, blocks] factors.
            placed: [n] number of cubes that are in the tower already.
            draws: [n, 4] random numbers; the first is below `near_grasp_start_prob`.
        """
        if not worlds.any():
            return
        chosen = np.arange(len(cubes)), placed
        draws = draws / (self.near_grasp_start_prob, 1.0, 1.0, 1.0)
        cubes[chosen], pads = hand_at_cube(
            self.hand, self._grasp(world), cubes[chosen], levels[chosen], size[chosen],
            size.max(axis=1), draws,
        )  # fmt: skip
        world.set_state(position=cubes, drive_position=pads, worlds=worlds)

    def _grasp(self, world: World) -> Grasp:
        """A cube between closed fingers, computed once per fidelity."""
        if world.fidelity not in self._grasps:
            scene = self.scene()
            cube = replace(scene.bodies[0], position=self.hand.home)
            hand = self.hand.gripper(2.0 * HALF, scene.drives[0].material)
            alone = replace(scene, bodies=(cube,), drives=(hand,))
            self._grasps[world.fidelity] = Grasp(*self.hand.settled_grasp(alone, world, self.frame))
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
        """The terms of the next cube and of a finished tower, see `reward_terms`."""
        cube = self._next_cube(world, now, achieved, desired)
        opened = self.hand.commanded_opening(now) / self.hand.max_opening
        return reward_terms(cube, self.blocks, self.hand.position(now), opened)

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """The outline of each cube at its goal: in its colour, or green where the cube counts."""
        places = goal[:-1].reshape(-1, 3)
        away = np.linalg.norm(world.position[index, : self.blocks] - places, axis=1)
        colors = [
            GOAL_COLOR if near else BODY_COLORS[i % len(BODY_COLORS)]
            for i, near in enumerate(away <= THRESHOLD)
        ]
        size = (
            world.parameters.size[index]
            if world.features.per_world_parameters
            else np.ones(self.blocks)
        )
        halves = np.full((self.blocks, 3), HALF) * size[:, None]
        return [Ghost(*one) for one in zip(halves, places, colors, strict=True)]

    def _next_cube(self, world: World, now: Readout, achieved: Array, desired: Array) -> NextCube:
        """The cube to place next, given goals [count, goal]."""
        return next_cube(achieved, desired, self.hand.position(now), self._finger_forces(world))

    def _finger_forces(self, world: World) -> Array:
        """Normal forces [blocks, 2, count] in N between each cube and each finger."""
        n = self.blocks
        forces = [[world.normal_force(i, n + finger) for finger in (0, 1)] for i in range(n)]
        return np.array(forces)


def _cube_bounds(name: str) -> Bounds:
    return (
        *((f"{name} {a}", "m", -1.0, 1.0) for a in "xyz"),
        *((f"{name} quaternion {a}", "", -1.0, 1.0) for a in "xyzw"),
        *((f"{name} velocity {a}", "m/s", -20.0, 20.0) for a in "xyz"),
        *((f"{name} angular velocity {a}", "rad/s", -1000.0, 1000.0) for a in "xyz"),
        *((f"hand to {name} {a}", "m", -2.0, 2.0) for a in "xyz"),
    )

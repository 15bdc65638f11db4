"""Trials with stated criteria: towers, a heavy cube on a light tower, a cube in a gripper."""

import numpy as np

from benchmarks.trade.trial import Trace, Trial, Worlds
from physics import Body, Box, Gripper, Material, Scene
from physics.reference.scenes import CUBE, tower

WIDTH = 2.0 * CUBE.half_extents[2]  # m
STANDING, HELD = 10.0, 5.0  # s
RATIO = 250.0
FINGER, PAD = Box((0.01, 0.005, 0.01)), 0.005  # half its thickness in m


def _standing(trace: Trace) -> float:
    cubes = trace.position.shape[2]
    drift = np.abs(trace.position[-1, 0] - trace.position[0, 0]).max()
    sink = (cubes - 0.5) * WIDTH - trace.position[-1, 0, -1, 2]
    return float(drift + abs(sink)) / WIDTH


def _tower(cubes: int) -> Trial:
    return Trial(
        f"tower of {cubes}", f"{cubes} cubes of 4 cm stand on each other for 10 s",
        "drift of the cube that drifts most plus sink of the topmost, relative to a cube's width",
        tower(cubes), _standing, settle=1.0, time=STANDING, timed=0.4, longest=0.04,
        events=False,
    )  # fmt: skip


def heavy_tower(cubes: int = 5, ratio: float = RATIO) -> Scene:
    """A tower of cubes of 64 g, and a cube on it that is `ratio` times as heavy as one."""
    below = tower(cubes)
    top = Body(
        CUBE, mass=0.064 * ratio, position=(0.0, 0.0, (cubes + 0.5) * WIDTH),
        material=below.bodies[0].material,
    )  # fmt: skip
    return Scene([*below.bodies, top], below.statics)


def grasp() -> Scene:
    """A cube of 100 g between the fingers of a gripper that presses with 5 N; friction 0.5."""
    material = Material(0.5, 0.0)
    gripper = Gripper(
        FINGER, mass=0.1, force_limit=50.0, grip_limit=5.0, position=(0, 0, 0.2),
        distance=WIDTH + 2.0 * PAD, material=material,
    )  # fmt: skip
    cube = Body(CUBE, mass=0.1, position=(0, 0, 0.2), material=material)
    return Scene([cube], drives=[gripper])


def _close(worlds: Worlds) -> None:
    """The fingers get set points 1 cm inside the cube."""
    worlds.move_drives([(0.0, -0.015, 0.2), (0.0, 0.015, 0.2)], 1e-3)


def _slip(trace: Trace) -> float:
    moved = trace.position[-1, 0, 0] - trace.position[0, 0, 0]
    return float(np.linalg.norm(moved)) / WIDTH


TRIALS = (
    _tower(5),
    _tower(10),
    Trial(
        "250 : 1", "A cube 250 times as heavy as one below stands on a tower of five for 10 s",
        "drift of the cube that drifts most plus sink of the topmost, relative to a cube's width",
        heavy_tower(), _standing, settle=1.0, time=STANDING, timed=0.4, events=False,
    ),
    Trial(
        "grasp", "A gripper holds a cube for 5 s, with five times the force that it needs",
        "slip of the cube, relative to its width",
        grasp(), _slip, prepare=_close, settle=1.0, time=HELD, timed=0.4, grip=True, events=False,
    ),
)  # fmt: skip

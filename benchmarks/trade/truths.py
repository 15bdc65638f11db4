"""Trials that other trials don't see: a dome, a seam, five balls, loads, overlaps, rocking.

`physics.reference.truths` and `loads` say more of most of them.
"""

import math

import numpy as np

from benchmarks.trade.impacts import oblique
from benchmarks.trade.starts import tiled
from benchmarks.trade.trial import Trace, Trial, Worlds
from physics import Body, Box, Ground, Material, Scene, Sphere, Static
from physics.reference.blocks import BLOCK, ROCKING
from physics.reference.closed_forms import incline_acceleration
from physics.reference.scenes import CUBE, GRAVITY, block_on_ground
from physics.reference.truths import DOME, RADIUS

WIDTH = 2.0 * CUBE.half_extents[2]  # m
START = 0.05  # rad from the top of the dome
CROSSING = 0.5  # m/s
FRICTION, EXCESS = 0.5, 1.01  # how much steeper an incline is than friction holds
SLIM, STEEP = (0.02, 0.02, 0.06), 0.9  # m; of the slope that tips it
OVERLAP = 1e-3  # m
ROCKS = 24  # worlds


def _dome() -> Trial:
    far, smooth = DOME + RADIUS, Material(friction=0.0)
    ball = Body(Sphere(RADIUS), mass=0.1, material=smooth,
                position=(far * math.sin(START), 0.0, far * math.cos(START)))  # fmt: skip
    leaves = 2.0 / 3.0 * math.cos(START)  # cosine
    along = math.sqrt(GRAVITY * far * leaves) * leaves

    def error(trace: Trace) -> float:
        return abs(float(trace.linear_velocity[-1, 0, 0, 0]) / along - 1.0)

    return Trial(
        "dome", "A smooth ball slides off a dome", "relative error of its final speed sideways",
        Scene([ball], [Static(Sphere(DOME), material=smooth)]), error, time=1.2,
    )  # fmt: skip


def _seam() -> Trial:
    smooth, half = Material(friction=0.0), 0.1
    tiles = [
        Static(Box((half, half, half)), position=(x, 0.0, -half), material=smooth)
        for x in (-half, half)
    ]
    cube = Body(CUBE, mass=0.1, position=(-0.05, 0.0, 0.5 * WIDTH), material=smooth)

    def begin(worlds: Worlds) -> None:
        worlds.set_state(linear_velocity=np.array([CROSSING, 0.0, 0.0]))

    def error(trace: Trace) -> float:
        return abs(float(trace.linear_velocity[-1, 0, 0, 0]) / CROSSING - 1.0)

    return Trial(
        "seam", "A smooth cube crosses the seam of two flush boxes", "relative error of its speed",
        Scene([cube], tiles), error, begin, settle=0.4, time=0.2,
    )  # fmt: skip


def _five_balls() -> Trial:
    hard = Material(friction=0.0, restitution=1.0)
    places = [-2.0 * RADIUS - 1e-3, *(2.0 * RADIUS * n for n in range(4))]
    balls = [
        Body(Sphere(RADIUS), mass=0.1, position=(x, 0.0, 0.0), material=hard,
             linear_velocity=(float(n == 0), 0.0, 0.0))
        for n, x in enumerate(places)
    ]  # fmt: skip

    def error(trace: Trace) -> float:
        energy = np.sum(trace.linear_velocity[-1] ** 2)
        return abs(float(energy) - 1.0)

    return Trial(
        "five balls", "A ball hits four that touch, e = 1", "relative error of the energy",
        Scene(balls, gravity=(0.0, 0.0, 0.0)), error, time=0.2, restitution=1.0,
    )  # fmt: skip


def _too_steep() -> Trial:
    angle = math.atan(EXCESS * FRICTION)

    def error(trace: Trace) -> float:
        exact = incline_acceleration(angle, FRICTION, GRAVITY) * trace.time[-1]
        return abs(float(trace.linear_velocity[-1, 0, 0, 0]) / exact - 1.0)

    return Trial(
        "incline, 1 % too steep", "A cube is put on an incline that is 1 % too steep for it",
        "relative error of the speed after two seconds",
        block_on_ground(friction=FRICTION, angle=angle), error, time=2.0, timed=0.4,
    )  # fmt: skip


def _slim_box() -> Trial:
    angle = math.atan(STEEP * SLIM[0] / SLIM[2])

    def error(trace: Trace) -> float:
        return float(np.linalg.norm(trace.position[-1, 0, 0] - trace.position[0, 0, 0])) / SLIM[0]

    return Trial(
        "slim box", "A box is put on 90 % of the slope that tips it",
        "distance that its centre moves, relative to half its width",
        block_on_ground(SLIM, 1.0, angle=angle), error, time=2.0, timed=0.4,
    )  # fmt: skip


def _overlap() -> Trial:
    cubes = [
        Body(CUBE, mass=0.1, position=(0.0, 0.0, z)) for z in (0.5 * WIDTH, 1.5 * WIDTH - OVERLAP)
    ]

    def error(trace: Trace) -> float:
        return float(np.linalg.norm(trace.position[-1, 0, 1] - (0.0, 0.0, 1.5 * WIDTH))) / WIDTH

    return Trial(
        "overlap", "A cube is put 1 mm deep into one on the ground, and comes to rest on it",
        "distance from where it should be, relative to its width",
        Scene(cubes, [Ground()]), error, time=2.0, timed=0.4, events=False,
    )  # fmt: skip


def _rocking() -> Trial:
    wide, high = BLOCK
    rough = Material(1.0)
    block = Body(Box((wide, *BLOCK)), mass=0.1, position=(0.0, 0.0, high), material=rough)
    inertia = block.shape.inertia(0.1)[1]
    tilt = np.linspace(0.5, 0.6, ROCKS) * math.atan2(wide, high)

    def begin(worlds: Worlds) -> None:
        place, turn = np.zeros((ROCKS, 3)), np.zeros((ROCKS, 4))
        place[:, 0] = high * np.sin(tilt) - wide * np.cos(tilt)
        place[:, 2] = wide * np.sin(tilt) + high * np.cos(tilt)
        turn[:, 1], turn[:, 3] = np.sin(0.5 * tilt), np.cos(0.5 * tilt)
        worlds.set_state(position=tiled(place, worlds.count), orientation=tiled(turn, worlds.count))

    def error(trace: Trace) -> float:
        """Energy above that of the block upright, when it has tilted farthest over its other edge.

        Its root is the ratio of the angular velocities before and after the impact.
        """
        angle = 2.0 * np.arctan2(trace.orientation[:, :, 0, 1], trace.orientation[:, :, 0, 3])
        energy = (
            0.05 * np.sum(trace.linear_velocity[:, :, 0] ** 2, axis=-1)
            + 0.5 * inertia * np.sum(trace.angular_velocity[:, :, 0] ** 2, axis=-1)
            + 0.1 * GRAVITY * (trace.position[:, :, 0, 2] - high)
        )
        farthest = np.argmin(angle, axis=0)
        left = np.maximum(energy[farthest, np.arange(ROCKS)], 0.0)
        return abs(float(np.sqrt(left / energy[0]).mean()) / ROCKING - 1.0)

    return Trial(
        "rocking", "A block rocks from one edge to the other, e = 0",
        "relative error of the angular velocity after the impact, mean of 24 starts",
        Scene([block], [Ground(material=rough)]), error, begin, worlds=ROCKS, time=0.4,
        restitution=0.0,
    )  # fmt: skip


TRIALS = (
    _dome(),
    _seam(),
    _five_balls(),
    oblique("landing, slides", "A ball lands without a rebound and slides on", 0.3, 2.0, e=0.0),
    _too_steep(),
    _slim_box(),
    _overlap(),
    _rocking(),
)

"""Trials with friction: slide, inclines, roll; their closed forms are in physics/reference."""

import math
from collections.abc import Callable

import numpy as np

from benchmarks.trade.starts import along_x
from benchmarks.trade.trial import Trace, Trial
from physics import Scene
from physics.reference.closed_forms import incline_acceleration, rolling_speed, slide_distance
from physics.reference.measures import BLOCK, FRICTION
from physics.reference.scenes import GRAVITY, block_on_ground, sphere_on_ground

SPEEDS = (0.5, 0.75, 1.0, 1.5, 2.0)  # m/s
REST, SLIDE, START = 20.0, 28.0, 30.0  # degrees; friction holds up to 26.6


def _stopping(trace: Trace) -> float:
    distance = trace.position[-1, :, 0, 0] - trace.position[0, :, 0, 0]
    exact = np.array([slide_distance(v, FRICTION, GRAVITY) for v in SPEEDS])
    return float(np.abs(distance / exact - 1.0).max())


def _creep(trace: Trace) -> float:
    moved = trace.position[-1, 0, 0] - trace.position[0, 0, 0]
    return float(np.linalg.norm(moved)) / (2.0 * BLOCK[0])


def _gain(degrees: float) -> Callable[[Trace], float]:
    def error(trace: Trace) -> float:
        gained = trace.linear_velocity[-1, 0, 0, 0] - trace.linear_velocity[0, 0, 0, 0]
        exact = incline_acceleration(math.radians(degrees), FRICTION, GRAVITY) * trace.time[-1]
        return abs(float(gained) / exact - 1.0)

    return error


def _rolling(trace: Trace) -> float:
    return abs(float(trace.linear_velocity[-1, 0, 0, 0]) / rolling_speed(1.0) - 1.0)


def _incline(degrees: float) -> Scene:
    return block_on_ground(BLOCK, FRICTION, angle=math.radians(degrees), mass=1.0)


TRIALS = (
    Trial(
        "slide", "A cube slides to rest, from 0.5 to 2 m/s",
        "largest relative error of the stopping distance v²/(2 μ g)",
        block_on_ground(BLOCK, FRICTION, mass=1.0), _stopping, along_x(SPEEDS), worlds=len(SPEEDS),
        settle=1.0, time=0.6,
    ),
    Trial(
        "incline, rest", "A cube rests on an incline of 20°, friction holds up to 26.6°",
        "distance that it creeps in 10 s, relative to its width of 10 cm",
        _incline(REST), _creep, settle=1.0, time=10.0, timed=1.0,
    ),
    Trial(
        "incline, slide", "A cube slides down an incline of 28°",
        "relative error of the speed gained in a second",
        _incline(SLIDE), _gain(SLIDE), settle=1.0, time=1.0,
    ),
    Trial(
        "incline, first second", "A cube starts to slide down an incline of 30°",
        "relative error of the speed after the first second",
        _incline(START), _gain(START), time=1.0,
    ),
    Trial(
        "roll", "A ball slides at 1 m/s until it rolls",
        "relative error of the rolling speed, 5/7 of the first",
        sphere_on_ground(0.05, FRICTION, mass=1.0), _rolling, along_x((1.0,)),
        settle=1.0, time=0.24,
    ),
)  # fmt: skip

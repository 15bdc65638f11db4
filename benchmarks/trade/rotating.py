"""Trials without contact: a tumbling box, a pendulum, a spinning top."""

import math
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from benchmarks.trade.trial import Trace, Trial
from physics import BallJoint, Body, Box, Hinge, Scene
from physics.reference.scenes import GRAVITY, torque_free_box

Array = np.ndarray

TUMBLING = 10.0  # s
ROD, ROD_MASS, AMPLITUDE, SWINGING = Box((0.01, 0.01, 0.25)), 1.0, 1.4, 4.0  # rad, s
DISC, DISC_MASS, ARM, LEAN, PRECESSION, PRECEDING = (
    Box((0.05, 0.05, 0.01)), 0.5, 0.08, 0.5, 3.0, 2.0,
)  # kg, m, rad, rad/s, s  # fmt: skip


def _tumbled(scene: Scene, time: float) -> Array:
    """Orientation x y z w of a torque-free body, by Euler's equations."""
    body = scene.bodies[0]
    inertia = body.shape.inertia(float(body.mass or 1.0))

    def rate(_: float, y: Array) -> Array:
        spin, (x, yy, z, w) = y[:3], y[3:]
        turn = np.array([w * spin[0] + yy * spin[2] - z * spin[1],
                         w * spin[1] + z * spin[0] - x * spin[2],
                         w * spin[2] + x * spin[1] - yy * spin[0],
                         -x * spin[0] - yy * spin[1] - z * spin[2]])  # fmt: skip
        return np.concatenate([np.cross(inertia * spin, spin) / inertia, 0.5 * turn])

    start = np.array([*body.angular_velocity, 0.0, 0.0, 0.0, 1.0])
    found = solve_ivp(rate, (0.0, time), start, method="DOP853", rtol=1e-13, atol=1e-13)
    return np.asarray(found.y[3:, -1] / np.linalg.norm(found.y[3:, -1]))


def _tumble() -> Trial:
    # without the ground, for where bodies can touch there are neither RK4 nor adaptive steps
    scene = replace(torque_free_box(), statics=())
    exact = _tumbled(scene, TUMBLING)

    def error(trace: Trace) -> float:
        found = trace.orientation[-1, 0, 0] / np.linalg.norm(trace.orientation[-1, 0, 0])
        apart = min(np.linalg.norm(found - exact), np.linalg.norm(found + exact))
        return 4.0 * math.asin(0.5 * float(apart))  # a cosine would lose half of the digits

    return Trial(
        "tumbling box", "A box tumbles about its middle axis for 10 s, free of forces",
        "angle between its orientation and the exact one, rad",
        scene, error, time=TUMBLING, joints=True,
    )  # fmt: skip


def _pendulum() -> Trial:
    half = ROD.half_extents[2]
    centre = (half * math.sin(AMPLITUDE), 0.0, -half * math.cos(AMPLITUDE))
    turn = (0.0, -math.sin(0.5 * AMPLITUDE), 0.0, math.cos(0.5 * AMPLITUDE))
    body = Body(ROD, mass=ROD_MASS, position=centre, orientation=turn)
    scene = Scene([body], joints=[Hinge(0, None, (0, 0, 0), (0, -1, 0))])
    inertia = float(ROD.inertia(ROD_MASS)[1]) + ROD_MASS * half**2
    slow, m = math.sqrt(ROD_MASS * GRAVITY * half / inertia), math.sin(0.5 * AMPLITUDE) ** 2

    def error(trace: Trace) -> float:
        sine = math.sqrt(m) * ellipj(ellipk(m) - slow * trace.time, m)[0]
        angle = 2.0 * np.arcsin(sine)
        exact = half * np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
        apart = np.linalg.norm(trace.position[:, 0, 0, ::2] - exact, axis=-1)
        return float(apart.max()) / half

    return Trial(
        "pendulum", "A rod swings on a hinge, by 80° to both sides",
        "largest distance of its centre from the exact one in 4 s, relative to its arm",
        scene, error, time=SWINGING, joints=True,
    )  # fmt: skip


def _top() -> Trial:
    """Steady precession: I Ω² cos θ - I₃ ω₃ Ω + m g l = 0, and ω₃ = s + Ω cos θ."""
    across, _, along = DISC.inertia(DISC_MASS)
    across += DISC_MASS * ARM**2
    turn = across * PRECESSION**2 * math.cos(LEAN) + DISC_MASS * GRAVITY * ARM
    spin = turn / (along * PRECESSION)  # about its axis
    axis = np.array([math.sin(LEAN), 0.0, math.cos(LEAN)])
    sideways = PRECESSION * np.array([0.0, 0.0, 1.0])
    velocity = sideways + (spin - PRECESSION * math.cos(LEAN)) * axis
    body = Body(
        DISC, mass=DISC_MASS, position=tuple(ARM * axis),
        orientation=(0.0, math.sin(0.5 * LEAN), 0.0, math.cos(0.5 * LEAN)),
        angular_velocity=tuple(velocity), linear_velocity=tuple(np.cross(velocity, ARM * axis)),
    )  # fmt: skip
    scene = Scene([body], joints=[BallJoint(0, None, (0, 0, 0))])
    radius = ARM * math.sin(LEAN)

    def error(trace: Trace) -> float:
        angle = PRECESSION * trace.time
        height = np.full_like(angle, ARM * math.cos(LEAN))
        exact = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)
        return float(np.linalg.norm(trace.position[:, 0, 0] - exact, axis=-1).max()) / radius

    return Trial(
        "spinning top", "A top precesses steadily on a ball joint",
        "largest distance of its centre from the exact one in 2 s, relative to its circle's radius",
        scene, error, time=PRECEDING, joints=True,
    )  # fmt: skip


TRIALS = (_tumble(), _pendulum(), _top())

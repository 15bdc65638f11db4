"""Trials with impacts: a ball that bounces, oblique impacts, a bullet and a thin wall."""

import numpy as np

from benchmarks.trade.starts import phases, tiled
from benchmarks.trade.trial import FRAME, Trace, Trial, Worlds
from physics import Body, Box, Material, Scene, Sphere, Static
from physics.reference.closed_forms import oblique_impact
from physics.reference.scenes import sphere_on_ground

RADIUS, SPEED = 0.05, 1.0  # m, m/s
PHASES = 32  # times of first contact, spread over 8 ms
SPREAD = 8e-3  # s
MUZZLE, BULLET, HALF_WALL = 300.0, 0.0025, 0.001  # m/s, radius in m, m
SHOTS = 64


def _fall(worlds: Worlds) -> None:
    place = np.zeros((PHASES, 3))
    place[:, 2] = RADIUS + 0.005 + SPEED * SPREAD * phases(PHASES)
    worlds.set_state(
        position=tiled(place, worlds.count), linear_velocity=np.array([0.0, 0.0, -SPEED])
    )


def bounce(e: float) -> Trial:
    """A ball without gravity or friction hits the ground at 1 m/s."""

    def error(trace: Trace) -> float:
        return float(np.abs(trace.linear_velocity[-1, :, 0, 2] / SPEED - e).max())

    return Trial(
        f"bounce, e = {e:g}", f"A ball bounces, coefficient of restitution {e:g}",
        "largest error of e over 32 times of impact within a step",
        sphere_on_ground(RADIUS, 0.0, e, gravity=0.0), error, _fall, worlds=PHASES,
        time=0.2, restitution=e,
    )  # fmt: skip


def oblique(name: str, title: str, friction: float, along: float, e: float = 0.5) -> Trial:
    """A ball hits the ground obliquely, without gravity."""
    exact = oblique_impact(along, SPEED, friction, e, RADIUS)

    def begin(worlds: Worlds) -> None:
        _fall(worlds)
        worlds.set_state(linear_velocity=np.array([along, 0.0, -SPEED]))

    def error(trace: Trace) -> float:
        return float(np.abs(trace.linear_velocity[-1, :, 0, 0] / exact[0] - 1.0).max())

    return Trial(
        name, title, "largest relative error of the speed along the ground after the impact",
        sphere_on_ground(RADIUS, friction, e, gravity=0.0), error, begin, worlds=PHASES,
        time=0.2, restitution=e,
    )  # fmt: skip


def _bullet() -> Trial:
    e, material = 0.5, Material(friction=0.0, restitution=0.5)
    scene = Scene(
        [Body(Sphere(BULLET), mass=0.004, position=(-1, 0, 0), material=material)],
        [Static(Box((HALF_WALL, 0.06, 0.06)), position=(0, 0, 0), material=material)],
        gravity=(0, 0, 0),
    )
    face = -HALF_WALL - BULLET
    away = 0.1 + 0.6 * phases(SHOTS)  # m from the wall

    def begin(worlds: Worlds) -> None:
        place = np.zeros((SHOTS, 3))
        place[:, 0] = face - away
        worlds.set_state(
            position=tiled(place, worlds.count), linear_velocity=np.array([MUZZLE, 0.0, 0.0])
        )

    def error(trace: Trace) -> float:
        back = e * (MUZZLE * trace.time[-1] - away)
        return float(np.abs((face - trace.position[-1, :, 0, 0]) / back - 1.0).max())

    return Trial(
        "bullet", "A bullet of 5 mm at 300 m/s rebounds from a wall of 2 mm",
        "largest relative error of its distance from the wall after 40 ms",
        scene, error, begin, worlds=SHOTS, time=FRAME, restitution=e,
    )  # fmt: skip


TRIALS = (
    *(bounce(e) for e in (0.0, 0.25, 0.5, 0.75, 1.0)),
    oblique("oblique, slides", "A ball grazes the ground: it slides during the impact", 0.1, 2.0),
    oblique("oblique, sticks", "A ball hits the ground obliquely and rolls on", 0.5, 0.5),
    _bullet(),
)

"""What each preset must hold. A test measures it; docs/trade.md shows it."""

from typing import NamedTuple


class Promise(NamedTuple):
    """What a preset holds, for cubes of 4 cm and balls.

    Attributes:
        cubes: that stand on each other for 10 s, after one second to settle, and drift by less
            than a millimetre.
        sink: m, of a cube that rests on the ground, at most.
        creep: m/s, of a cube on a slope of 20 degrees with friction 0.5, at most.
        slide: largest relative error of the distance in which a cube slides to rest from 0.5 m/s.
        restitution: largest error of the coefficient of a ball, for 0, 0.25, 0.5 and 0.75 and any
            time of impact within a step.
    """

    cubes: int
    sink: float
    creep: float
    slide: float
    restitution: float


PROMISES: dict[str, Promise] = {
    "fast": Promise(cubes=3, sink=4e-4, creep=1e-9, slide=2e-3, restitution=2e-3),
    "balanced": Promise(cubes=5, sink=2e-4, creep=1e-9, slide=5e-4, restitution=2e-3),
    "accurate": Promise(cubes=10, sink=2e-5, creep=1e-9, slide=5e-6, restitution=1e-3),
    "solid": Promise(cubes=10, sink=2e-5, creep=1e-9, slide=1e-3, restitution=1e-9),
}

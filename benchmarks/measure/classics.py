"""Classic problems of mechanics by preset: rolling disks, tops, arches, shaken and granular bodies.

`physics.reference.classics` and `driven` state each scene and derive its right value. Newton's
method has no drives and at most 32 bodies.
"""

import math
from collections.abc import Callable, Iterator

from benchmarks.measure.truths import NEWTON
from benchmarks.report.tables import Cell, Table
from physics import PRESETS, Fidelity
from physics.reference import classics, driven
from physics.reference.truths import Level

Problem = tuple[str, str, Callable[[Level], str]]


def _ratios(values: tuple[float, ...]) -> str:
    return "; ".join(f"{value:.3f}" for value in values)


def _degrees(level: Level, friction: float, cubes: bool) -> str:
    return f"{math.degrees(driven.repose(level, friction, cubes)):.0f}"


def _top(level: Level) -> str:
    change, cosine, _ = classics.tippe_top(level, 0.1)
    return f"{change:.1g}; {cosine:.2f}"


def _loop(level: Level) -> str:
    heights, stays = classics.loop(level)
    return f"{heights.min():.3f} … {heights.max():.3f}; {'yes' if stays else 'no'}"


def _flights(level: Level) -> str:
    least, flights = driven.lift_off(level)
    return _ratios((least, *flights))


FEW: tuple[Problem, ...] = (
    ("overhang of 2, 3 and 4 bricks, over the harmonic series", "1",
     lambda f: "; ".join(f"{classics.overhang(f, n):.2f}" for n in (2, 3, 4))),
    ("arch of 1.5 and 0.95 times the least thickness, largest drop, m", "0; > 0.5",
     lambda f: "; ".join(f"{classics.arch_drop(f, x * classics.LEAST_THICKNESS):.2g}"
                         for x in (1.5, 0.95))),
    ("disk on its rim, μ = 0: precession over theory; energy gained", "1; 0",
     lambda f: "{:.4f}; {:.1g}".format(*classics.euler_disk(f, 0.0))),
    ("disk on its rim, μ = 1", "1; 0",
     lambda f: "{:.4f}; {:.1g}".format(*classics.euler_disk(f))),
    ("hoop: period above, growth below its least speed, over theory", "1; 1",
     lambda f: _ratios(classics.hoop(f))),
    ("tippe-top: change of Jellett's invariant; cosine of its axis after 6 s", "0; < −0.2", _top),
    ("loop: heights where a ball leaves, over theory; stays from 5/2 R on", "1; yes", _loop),
    ("Painlevé's rod, 256 starts: largest gain of energy", "≤ 0",
     lambda f: f"{driven.jammed_rod(f):.1g}"),
    ("cube that spins at 300 rad/s: arm of friction, over half its width", "0.77 … 1.41",
     lambda f: f"{driven.twist_arm(f, 300.0):.2f}"),
)  # fmt: skip
MANY: tuple[Problem, ...] = (
    ("chain: distance from the catenary, m", "0",
     lambda f: f"{classics.hanging_chain(f):.0g}"),
    ("Kapitza's pendulum: least (a ω)², over 2 g l", "1",
     lambda f: f"{driven.upside_down(f):.3f}"),
    ("ball on a shaken plate: least A ω²/g; flights at 1.2 and 1.4 g, over theory", "1; 1; 1",
     _flights),
    ("160 balls after 8 s, μ = 0.5 and 0: speed, m/s", "0; 0",
     lambda f: "; ".join(f"{driven.rest_speed(driven.heap(f, mu)):.1g}" for mu in (0.5, 0.0))),
    ("silo of 10 and 20 layers: layers that its floor carries", "saturates",
     lambda f: "; ".join(f"{driven.silo(f, n)[0]:.1f}" for n in (10, 20))),
    ("slope of collapsed balls, μ = 0.05 and 0.8, °", "grows",
     lambda f: "; ".join(_degrees(f, mu, False) for mu in (0.05, 0.8))),
    ("slope of collapsed cubes, μ = 0.05 and 0.8, °", "grows",
     lambda f: "; ".join(_degrees(f, mu, True) for mu in (0.05, 0.8))),
)  # fmt: skip


def measure() -> Iterator[Table]:
    """Right values, and those of each preset and of Newton's method."""
    levels: dict[str, Fidelity] = {**PRESETS, "newton": NEWTON}
    rows: list[list[Cell]] = [
        [name, right, *(value(level) for level in levels.values())] for name, right, value in FEW
    ]
    rows += [
        [name, right, *(value(level) for level in PRESETS.values()), ""]
        for name, right, value in MANY
    ]
    yield Table("classics", "Classic problems", ["problem", "right", *levels], rows)

"""Truths of theory by preset: forces on curved surfaces, impacts, rocking, loads that tip and pull.

`physics.reference.truths` and `loads` state each scene and derive its right value. Values are
ratios unless a unit is given.
"""

import math
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec

from benchmarks.peers.mujoco_options import MujocoOptions
from benchmarks.report.tables import Cell, Table
from physics import PRESETS, Fidelity, Mesh, Particles
from physics.reference import loads, meshes
from physics.reference.blocks import BLOCKS
from physics.reference.truths import BALL, BALLS, RADIUS, Engine
from physics.scene.fidelity import NEWTON


def _peer() -> dict[str, Engine]:
    """MuJoCo at its default step of 2 ms, if it is installed."""
    if find_spec("mujoco") is None:
        return {}
    worlds = import_module("benchmarks.peers.mujoco_worlds").MujocoWorlds
    return {"MuJoCo, 2 ms": lambda scene, count: worlds(scene, MujocoOptions(), count)}


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}"


def _tipping(slow: bool, size: float) -> Callable[[Engine], str]:
    def cell(engine: Engine) -> str:
        found = _degrees(loads.tipping_slope(engine, slow, size))
        if callable(engine):
            return found
        predicted = loads.predicted_tipping(engine, size)
        bound = _degrees(predicted.gradual) if slow else f"≥ {_degrees(predicted.sudden)}"
        return f"{found} ({bound})"

    return cell


def _pull(part: float, slow: bool) -> Callable[[Engine], str]:
    def cell(engine: Engine) -> str:
        moved, speed = loads.pulled(engine, part, slow)
        found = f"{speed:.4f}" if part > 1.0 else f"{1e3 * moved:.2g}"
        if callable(engine):
            return found
        predicted = loads.predicted_pull(engine, part)
        if part > 1.0:
            most = 2.0 * (part - 1.0) * loads.FRICTION * loads.GRAVITY + predicted.speed
            return f"{found} (≤ {most:.4f})"
        bound = f"{1e3 * predicted.gradual:.2g}" if slow else f"≤ {1e3 * predicted.sudden:.2g}"
        return f"{found} ({bound})"

    return cell


def _leaning(slow: bool) -> Callable[[Engine], str]:
    return lambda engine: "; ".join(_degrees(angle) for angle in loads.leaning(engine, slow))


def _loads() -> tuple[tuple[str, str, Callable[[Engine], str]], ...]:
    """Name of a load, right value, and the measured one at a fidelity, with the predicted one."""
    right = _degrees(math.atan2(*loads.BOX))
    stick = _degrees(loads.leaning_angle())
    speed = f"{0.02 * loads.FRICTION * loads.GRAVITY:.4f}"
    return (
        ("box, slow pull that tips it, °", right, _tipping(True, 1.0)),
        ("box set down, slope that tips it, °", right, _tipping(False, 1.0)),
        ("one ten times as large, set down, °", right, _tipping(False, 10.0)),
        ("cube, slow pull of 0.5 μ m g moves it, mm", "0", _pull(0.5, True)),
        ("cube, sudden pull of 0.9 μ m g moves it, mm", "0", _pull(0.9, False)),
        ("cube, pull of 1.01 μ m g, speed after 2 s, m/s", speed, _pull(1.01, False)),
        ("stick let go, least angle; where it stands then, °", stick, _leaning(False)),
        ("the same, its weight grows", stick, _leaning(True)),
    )


def measure() -> Iterator[Table]:
    """Right values, and those of each preset and of Newton's method; then what loads do."""
    levels: dict[str, Fidelity] = {**PRESETS, "newton": NEWTON}
    rows: list[list[Cell]] = [
        [name, f"{right:.4g}", *(f"{value(level, BALL):.4f}" for level in levels.values())]
        for name, right, value in BALLS
    ]
    rows += [
        [name, f"{right:.4g}", *(f"{value(level):.4f}" for level in levels.values())]
        for name, right, value in BLOCKS
    ]
    yield Table("truths", "Truths of theory", ["truth", "right", *levels], rows)
    vertices, faces = meshes.ball(RADIUS, 128)
    shapes = (Particles([[0.0, 0.0, 0.0]], RADIUS), Mesh(vertices=vertices, faces=faces))
    rows = [
        [
            name,
            f"{right:.4g}",
            *("; ".join(f"{value(level, b):.4f}" for b in shapes) for level in levels.values()),
        ]
        for name, right, value in BALLS
    ]
    title = "Truths of balls: one of Particles; a mesh of 16,128 faces"
    yield Table("balls", title, ["truth", "right", *levels], rows)
    engines: dict[str, Engine] = {**levels, **_peer()}
    rows = [
        [name, right, *(cell(engine) for engine in engines.values())]
        for name, right, cell in _loads()
    ]
    yield Table("loads", "Loads on bodies that stand", ["load", "rigid", *engines], rows)

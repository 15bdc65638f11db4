"""What each compile-time switch costs, and what leaving it out saves: ns per substep and world.

The engine derives `Features` from scene and fidelity, so that it models only what a scene requires.
Here each of them is also forced to the other value, in a scene that needs it and in one that
doesn't. A scene that needs a feature moves wrongly without it: that column is only a cost. One
thread, 1,024 worlds; scenes are timed from 1/4 s on and take turns.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple
from unittest import mock

from benchmarks.measure.features import (
    CUBE,
    ROUGH,
    ROUNDS,
    SECONDS,
    SLAB,
    SMOOTH,
    TOUCHING,
    WORLDS,
    ball,
    cube,
    flying,
    frame_side,
    meshed,
    slope,
)
from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import take_turns
from physics import (
    PRESETS,
    Body,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Drag,
    Drive,
    Fidelity,
    Gripper,
    Hinge,
    Material,
    Part,
    Scene,
    Sphere,
    SurfaceDrag,
    Torus,
    World,
)
from physics.model.features import BISECTION, FIXED, GENERAL, ISOTROPIC, MIDPOINT, NO_ROTATION, RK4
from physics.reference.scenes import tower
from physics.scene.fidelity import NEWTON
from physics.step import simulation

SETTLED = 0.25  # s
SOLID = PRESETS["solid"]


def _on(shape: Any, height: float) -> Scene:
    """A small cube on a body of this shape, which reaches from -height to height."""
    below = Body(shape, mass=0.5, position=(0, 0, height), material=ROUGH)
    half = 0.005
    above = Body(Box((half,) * 3), mass=0.01, position=(0, 0, 2 * height + half), material=ROUGH)
    return Scene([below, above], cube().statics)


def _two_balls() -> Scene:
    scene = ball(ROUGH)
    other = replace(scene.bodies[0], position=(0.04 - 1e-5, 0, 0.02))
    return replace(scene, bodies=[*scene.bodies, other])


def _gripped() -> Scene:
    hand = Gripper(
        Box((0.005, 0.005, 0.015)), 0.2, 20.0, 5.0, (0, 0, 0.02), 0.0501, material=ROUGH
    )  # fmt: skip
    return replace(cube(), drives=[hand])


def _two_fingers() -> Scene:
    fingers = [
        Drive(Sphere(0.015), 0.2, 5.0, (0, y, 0.02), material=ROUGH)
        for y in (-TOUCHING, TOUCHING)
    ]  # fmt: skip
    return replace(cube(), drives=fingers)


def _hinged() -> Scene:
    hinge = Hinge("arm", None, anchor=(0, 0, 0.1), axis=(0, 1, 0))
    return Scene([Body(CUBE, mass=0.1, name="arm")], joints=[hinge])


RESISTING = Material(friction=0.5, rolling_resistance=1e-4)
FINGER = cube(finger=(-TOUCHING + 1e-4, 0, 0.02))
CUBES = cube(cubes=2)
L_SHAPE = Compound([Part(Box((0.01, 0.01, 0.03))), Part(Box((0.01, 0.01, 0.03)), (0.02, 0, 0))])
SCENES: dict[str, tuple[Scene, Fidelity]] = {
    "cube rests": (cube(), Fidelity()),
    "cube rests, no friction": (cube(SMOOTH), Fidelity()),
    "cube rests, viscous friction": (cube(), Fidelity(friction="viscous")),
    "cube rests, linear dashpot": (cube(), Fidelity(damping="dashpot")),
    "cube rests, impulses": (cube(), SOLID),
    "cube rests on a slope": (slope(), Fidelity()),
    "slab flies and spins": (flying(SLAB, 1.0), Fidelity()),
    "cube flies and spins": (flying(CUBE, 1.0), Fidelity()),
    "slab flies and spins, RK4": (flying(SLAB, 1.0), Fidelity(integrator="rk4")),
    "ball flies": (flying(Sphere(0.02), 0.0), Fidelity()),
    "ball rests": (ball(ROUGH), Fidelity()),
    "ball with rolling resistance": (ball(RESISTING), Fidelity()),
    "ball rests, bisection": (ball(ROUGH), replace(SOLID, time_control="bisection")),
    "ball rests, impulses": (ball(ROUGH), SOLID),
    "cube and touching finger": (FINGER, Fidelity()),
    "cube in a gripper": (_gripped(), Fidelity()),
    "cube between two fingers": (_two_fingers(), Fidelity()),
    "two cubes stacked": (CUBES, Fidelity()),
    "two balls side by side": (_two_balls(), Fidelity()),
    "cube on a capsule": (_on(Capsule(0.02, 0.02), 0.04), Fidelity()),
    "cube on a cylinder": (_on(Cylinder(0.02, 0.02), 0.02), Fidelity()),
    "cube on a torus": (_on(Torus(0.02, 0.01), 0.01), Fidelity()),
    "cube on a compound": (_on(L_SHAPE, 0.03), Fidelity()),
    "two cubes stacked, particles": (CUBES, Fidelity(geometry="particle")),
    "two meshed cubes stacked": (meshed(2), Fidelity()),
    "cube with drag": (replace(cube(), fields=[Drag(linear=0.01)]), Fidelity()),
    "cube with surface drag": (replace(cube(), fields=[SurfaceDrag(1.2, 1.0)]), Fidelity()),
    "cube on a hinge": (_hinged(), Fidelity()),
    "tower of five, Newton": (tower(5), NEWTON),
    "tower of five, impulses": (tower(5), SOLID),
}


class Row(NamedTuple):
    """A feature.

    Attributes:
        name: of a field of `Features`.
        needs: the scene that needs it; "" if no scene does.
        other: the one that doesn't; "" if the feature follows from an argument of `World`.
        on: its value where it is needed.
        off: its value where it isn't.
    """

    name: str
    needs: str
    other: str
    on: Any = True
    off: Any = False


ROWS = (
    Row("friction", "cube rests", "cube rests, no friction"),
    Row("viscous", "cube rests, viscous friction", "cube rests"),
    Row("slope", "cube rests on a slope", "cube rests"),
    Row("dashpot", "cube rests, linear dashpot", "cube rests"),
    Row("impulse", "cube rests, impulses", "cube rests"),
    Row("newton", "tower of five, Newton", "tower of five, impulses"),
    Row("lever", "cube and touching finger", "two cubes stacked"),
    Row("resistance", "ball with rolling resistance", "ball rests"),
    Row("rotation", "slab flies and spins", "cube flies and spins", GENERAL, ISOTROPIC),
    Row("rotation", "cube flies and spins", "ball flies", ISOTROPIC, NO_ROTATION),
    Row("integrator", "slab flies and spins, RK4", "slab flies and spins", RK4, MIDPOINT),
    Row("time_control", "ball rests, bisection", "ball rests, impulses", BISECTION, FIXED),
    Row("plane", "cube rests", "cube flies and spins"),
    Row("sphere", "two balls side by side", "cube rests"),
    Row("box", "two cubes stacked", "cube rests"),
    Row("capsule", "cube on a capsule", "cube rests"),
    Row("cylinder", "cube on a cylinder", "cube rests"),
    Row("torus", "cube on a torus", "cube rests"),
    Row("particles", "two cubes stacked, particles", "cube rests"),
    Row("compound", "cube on a compound", "two cubes stacked"),
    Row("grid", "two meshed cubes stacked", "two cubes stacked"),
    Row("mesh", "two meshed cubes stacked", "two cubes stacked"),
    Row("axial", "cube on a cylinder", "cube rests"),
    Row("drives", "cube and touching finger", "cube rests"),
    Row("gripper", "cube in a gripper", "cube between two fingers"),
    Row("fields", "cube with drag", "cube rests"),
    Row("surface_drag", "cube with surface drag", "cube with drag"),
    Row("joints", "cube on a hinge", "cube rests"),
    Row("wrench", "", "cube rests"),
    Row("per_world_parameters", "two cubes stacked", ""),
    Row("measures_work", "cube and touching finger", ""),
)
# without these what bodies touch is missing, so that nothing comparable is left
TOUCHED = (
    "plane",
    "sphere",
    "box",
    "capsule",
    "cylinder",
    "torus",
    "particles",
    "compound",
    "grid",
)
ARGUMENTS = {"per_world_parameters": "per_world_parameters", "measures_work": "measure_work"}


def world_of(name: str, **forced: Any) -> World:
    """Worlds of a scene that have settled, with some features forced."""
    scene, fidelity = SCENES[name]
    build = simulation.build

    def built(*given: Any, **named: Any) -> Any:
        model, features = build(*given, **named)
        return model, features._replace(**forced)

    arguments = {ARGUMENTS[key]: forced.pop(key) for key in ARGUMENTS if key in forced}
    with mock.patch.object(simulation, "build", built):
        world = World(scene, fidelity, WORLDS, threads=1, **arguments)
        world.advance(SETTLED)
    return world


def measure() -> Iterator[Table]:
    """One table."""
    rows: list[list[Cell]] = []
    for row in ROWS:
        sides: dict[str, World] = {}
        if row.needs and row.other and row.name not in TOUCHED:
            sides["needs, off"] = world_of(row.needs, **{row.name: row.off})
        if row.needs:
            argument = {row.name: True} if row.name in ARGUMENTS else {}
            sides["needs, on"] = world_of(row.needs, **argument)
        if row.name in ARGUMENTS:
            sides["needs, off"] = world_of(row.needs)
        if row.other:
            sides["other, off"] = world_of(row.other)
            sides["other, on"] = world_of(row.other, **{row.name: row.on})
        turns = take_turns(
            {name: frame_side(world) for name, world in sides.items()}, ROUNDS, SECONDS
        )
        cost: dict[str, Cell] = {name: 1e9 / max(found) for name, found in turns.items()}
        figures = [cost.get(f"{scene}, {value}") for scene in ("needs", "other")
                   for value in ("off", "on")]  # fmt: skip
        rows.append([row.name, row.needs or None, *figures[:2], row.other or None, *figures[2:]])
    columns = ["feature", "scene that needs it", "forced off", "on",
               "scene that doesn't", "off", "forced on"]  # fmt: skip
    yield Table("flags", f"ns per substep and world, one thread, {WORLDS:,} worlds", columns, rows)

"""What each feature costs: ns per substep and world, one thread, 1,024 worlds, balanced.

Each row names the row that it extends, and the difference. A slab has unequal moments of inertia.
Scenes are timed from 1/4 s on: a resting cube then touches with all samples of a face, which is its
most expensive state. Scenes take turns; figures are the fastest round, as other load on the machine
can only add time.
"""

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import Side, take_turns
from physics import Body, Box, Drive, Fidelity, Ground, Material, Mesh, Scene, Sphere, World
from physics.reference import meshes
from physics.reference.scenes import tilted_gravity
from physics.scene.solids import Static
from physics.scene.validation import Vector

WORLDS = 1024
FRAME = 0.04  # s
ROUNDS, SECONDS = 5, 0.3

SMOOTH, ROUGH = Material(friction=0.0), Material(friction=0.5)
CUBE, SLAB = Box((0.02, 0.02, 0.02)), Box((0.02, 0.02, 0.015))
TOUCHING = 0.02 + 0.015  # m, distance at which a finger of 15 mm radius touches the cube's face


def cube(
    material: Material = ROUGH, shape: Box = CUBE, finger: Vector | None = None, cubes: int = 1
) -> Scene:
    """A tower of blocks on the ground, and a finger that stays at a position."""
    half = shape.half_extents[2]
    bodies = [
        Body(shape, mass=0.1, position=(0, 0, (2 * i + 1) * half), material=material)
        for i in range(cubes)
    ]
    drives = [] if finger is None else [Drive(Sphere(0.015), 0.2, 5.0, finger, material=material)]
    return Scene(bodies, [Ground(material)], drives)


def flying(shape: Box | Sphere, spin: float) -> Scene:
    """One body that spins, without gravity."""
    return Scene([Body(shape, mass=0.1, angular_velocity=(spin, 2 * spin, 0))], gravity=(0, 0, 0))


def ball(material: Material) -> Scene:
    """A ball on the ground."""
    body = Body(Sphere(0.02), mass=0.1, position=(0, 0, 0.02), material=material)
    return Scene([body], [Ground(material)])


def _two_cubes_apart() -> Scene:
    bodies = [Body(CUBE, mass=0.1, position=(x, 0, 0.02), material=ROUGH) for x in (-0.1, 0.1)]
    return Scene(bodies, [Ground(ROUGH)])


def _wall() -> Scene:
    scene = cube()
    wall = Static(Box((0.02, 0.2, 0.02)), position=(0.041, 0, 0.02), material=ROUGH)
    return Scene(scene.bodies, [*scene.statics, wall])


def slope() -> Scene:
    """A cube under inclined gravity."""
    return replace(cube(), gravity=tilted_gravity(0.2))


def meshed(cubes: int) -> Scene:
    """A tower of cubes as meshes."""
    vertices, faces = meshes.cuboid(CUBE.half_extents)
    scene, mesh = cube(cubes=cubes), Mesh(vertices=vertices, faces=faces)
    return replace(scene, bodies=[replace(body, shape=mesh) for body in scene.bodies])


# name: the scene that it extends, scene, fidelity
CASES: dict[str, tuple[str, Scene, Fidelity]] = {
    "ball flies": ("", flying(Sphere(0.02), 0.0), Fidelity()),
    "cube flies and spins": ("ball flies", flying(CUBE, 1.0), Fidelity()),
    "slab flies and spins": (
        "cube flies and spins",
        flying(SLAB, 1.0),
        Fidelity(),
    ),
    "ball rests, no friction": ("ball flies", ball(SMOOTH), Fidelity()),
    "ball rests": ("ball rests, no friction", ball(ROUGH), Fidelity()),
    "cube rests, no friction": ("cube flies and spins", cube(SMOOTH), Fidelity()),
    "cube rests": ("cube rests, no friction", cube(), Fidelity()),
    "cube rests on a slope": ("cube rests", slope(), Fidelity()),
    "slab rests": ("cube rests", cube(shape=SLAB), Fidelity()),
    "cube rests, linear dashpot": ("cube rests", cube(), Fidelity(damping="dashpot")),
    "cube and distant finger": ("cube rests", cube(finger=(0.2, 0, 0.1)), Fidelity()),
    "cube and touching finger": (
        "cube and distant finger",
        cube(finger=(-TOUCHING + 1e-4, 0, 0.02)),
        Fidelity(),
    ),
    "cube 1 mm from a wall": ("cube rests", _wall(), Fidelity()),
    "two cubes apart": ("cube rests", _two_cubes_apart(), Fidelity()),
    "two cubes stacked": ("two cubes apart", cube(cubes=2), Fidelity()),
    "two cubes stacked, particles": (
        "two cubes stacked",
        cube(cubes=2),
        Fidelity(geometry="particle"),
    ),
    "meshed cube rests": ("cube rests", meshed(1), Fidelity()),
    "two meshed cubes stacked": ("two cubes stacked", meshed(2), Fidelity()),
}


def frame_side(world: World) -> Side:
    """Each call advances all worlds by a frame; counts the substeps of all worlds."""
    substeps = WORLDS * round(FRAME / world.fidelity.substep)

    def frame() -> int:
        world.advance(FRAME)
        return substeps

    return frame


def measure() -> Iterator[Table]:
    """One table."""
    sides, touching = {}, {}
    for name, (_, scene, fidelity) in CASES.items():
        world = World(scene, fidelity, count=WORLDS, threads=1)
        world.advance(0.25)
        sides[name], touching[name] = frame_side(world), len(world.contacts().penetration)
    cost = {name: 1e9 / max(found) for name, found in take_turns(sides, ROUNDS, SECONDS).items()}
    rows: list[list[Cell]] = []
    for name, (base, _, _) in CASES.items():
        added = cost[name] - cost[base] if base else None
        rows.append([name, touching[name], cost[name], added, base or None])
    columns = ["scene", "contacts", "ns per substep", "difference", "from"]
    yield Table("features", f"One thread, {WORLDS:,} worlds, balanced", columns, rows)

"""How long a first step takes: fresh processes from start to end, interpreter and imports included.

Of the first frame only `render` counts.

Each row is a process with its own copy of a cache: empty, with the kernels that one run of Push
leaves, or with the general kernels only. Figures are the median of the runs and the longest one.
Two processes compile, on idle cores.
"""

import shutil
import statistics
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.report.processes import run_code
from benchmarks.report.provenance import ROOT
from benchmarks.report.tables import Cell, Table
from physics.reference.general import GENERAL_KERNELS
from physics.scene.fidelity import PRESETS
from rigid_envs.registration import NAMES

RUNS = 3

ENVIRONMENT = """
import gymnasium as gym, rigid_envs
env = gym.make("RigidEnvs/{name}-v0", fidelity="{preset}")
env.reset(seed=0)
env.step(env.action_space.sample())
"""
FRAME = """
from time import perf_counter
import gymnasium as gym, rigid_envs
env = gym.make("RigidEnvs/Push-v0", render_mode="rgb_array")
env.reset(seed=0)
begin = perf_counter()
assert env.render().shape == (480, 480, 3)
print(perf_counter() - begin)
"""
WORLD = """
from physics import *
from physics.reference import meshes, scenes
v, f = meshes.cuboid((0.02, 0.03, 0.02))
world = World({scene}{more})
world.advance(0.04)
world.read()
"""
TUNE = """
from physics import Body, Box, Ground, Scene, tune
cube = Body(Box((0.02, 0.02, 0.02)), mass=0.1, position=(0, 0, 0.02), linear_velocity=(1, 0, 0))
tune(Scene([cube], [Ground()]), tolerance=1e-3)
"""
GENERAL = """
from physics.reference.general import compile_general
compile_general({name!r})
"""
TASKS = """
import gymnasium as gym, rigid_envs
for name in {names!r}:
    env = gym.make(f"RigidEnvs/{{name}}-v0", kernel="general")
    env.reset(seed=0)
    env.step(env.action_space.sample())
"""
BOX = "Box((0.02, 0.02, 0.02))"
SCENES = {
    "cube on the ground": ("scenes.block_on_ground()", ""),
    "tower of five": ("scenes.tower(5)", ""),
    "hinge pendulum": (
        f"Scene([Body({BOX}, mass=0.1, position=(0.1, 0, 1))], "
        "joints=[Hinge(0, None, anchor=(0, 0, 1), axis=(0, 1, 0))])",
        "",
    ),
    "attractor": (
        f"Scene([Body({BOX}, mass=0.1, position=(1, 0, 0))], gravity=(0, 0, 0), "
        "fields=[Attractor((0, 0, 0), strength=1.0)])",
        "",
    ),
    "mesh that drops": (
        "Scene([Body(Mesh(vertices=v, faces=f), mass=0.1, position=(0, 0, 0.1))], [Ground()])",
        "",
    ),
    "per-world parameters": ("scenes.block_on_ground()", ", count=4, per_world_parameters=True"),
}


def measure() -> Iterator[Table]:
    """One table for each state of the cache."""
    with TemporaryDirectory() as folder:
        yield from _tables(Path(folder))


def _tables(folder: Path) -> Iterator[Table]:
    push = ENVIRONMENT.format(name="Push", preset="balanced")
    columns = ["s", "target", "median", "longest"]
    empty = folder / "empty"
    empty.mkdir()
    rows: list[list[Cell]] = [
        _row("first gym.make, reset, step of Push", 10.0, push, empty, folder),
        _row("first frame, 480 x 480", 3.0, FRAME, _after(push, folder / "push"), folder, True),
        _row("tune of a cube that slides", 20.0, TUNE, empty, folder),
    ]
    title = "Empty cache; the frame: `render` alone, with the kernels of a first run of Push"
    yield Table("startup empty", title, columns, rows)

    first = folder / "push"
    rows = [
        _row("Push, solid", 10.0, ENVIRONMENT.format(name="Push", preset="solid"), first, folder),
        *(_row(name, 10.0, _world(name), first, folder) for name in SCENES),
    ]
    yield Table("startup first", "With the kernels of the first run of Push", columns, rows)

    general, spent = folder / "general", 0.0
    rows = []
    for name in GENERAL_KERNELS:
        before = _size(general)
        seconds, _ = run_code(GENERAL.format(name=name), variables=_using(general))
        spent += seconds
        rows.append([name, seconds, (_size(general) - before) / 1e6])
    before = _size(general)
    seconds, _ = run_code(TASKS.format(names=list(NAMES)), variables=_using(general))
    rows.append(["small kernels of all tasks", seconds, (_size(general) - before) / 1e6])
    rows.append(["all", spent + seconds, _size(general) / 1e6])
    title = "General kernels, one process each; together at most 60 s"
    yield Table("startup general", title, ["kernel", "s", "MB"], rows)

    rows = [
        _row(f"{name}, {preset}", 1.5, ENVIRONMENT.format(name=name, preset=preset), general,
             folder)
        for name in NAMES
        for preset in PRESETS
    ]  # fmt: skip
    rows += [_row(name, 1.5, _world(name), general, folder) for name in SCENES]
    yield Table("startup ready", "With the general kernels and no special one", columns, rows)
    yield Table("startup edits", "After an edit, first step of Push", columns, _edits(folder))


def _world(name: str) -> str:
    scene, more = SCENES[name]
    return WORLD.format(scene=scene, more=more)


def _using(cache: Path) -> dict[str, str | None]:
    """A cache, and the kernels that a user gets without asking."""
    return {"NUMBA_CACHE_DIR": str(cache), "RIGID_ENVS_KERNEL": None}


def _after(code: str, cache: Path) -> Path:
    """A cache that a program has filled."""
    run_code(code, variables=_using(cache))
    return cache


def _size(cache: Path) -> int:
    return sum(path.stat().st_size for path in cache.rglob("*.*") if path.is_file())


def _row(
    name: str, target: float, code: str, cache: Path, folder: Path, prints: bool = False
) -> list[Cell]:
    """Median and longest time of a program that starts with a copy of a cache.

    `prints`: its last line is the time of the part that counts.
    """
    spent = []
    for _ in range(RUNS):
        copy = folder / "copy"
        shutil.copytree(cache, copy)
        whole, printed = run_code(code, variables=_using(copy))
        spent.append(float(printed.split()[-1]) if prints else whole)
        shutil.rmtree(copy)
    return [name, target, statistics.median(spent), max(spent)]


EDITS = (
    ("physics/tuning", None, "tuning/tune.py", "import math\n", "import math\n\nEDITED = 1\n"),
    ("a stage, gravity", 8.0, "motion/gravity.py", "= weight[axis, i]", "= 1.5 * weight[axis, i]"),
    ("a stage, contact loop", 8.0, "spring/contact_loop.py", "lighter = 1.0 +", "lighter = 2.0 +"),
)


def _edits(folder: Path) -> list[list[Cell]]:
    """The first step of Push in a copy of the sources, after edits."""
    tree = folder / "tree"
    for package in ("physics", "rigid_envs"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / package, tree / package, ignore=ignored)
    push = ENVIRONMENT.format(name="Push", preset="balanced")
    variables = {**_using(folder / "edited"), "PYTHONPATH": str(tree)}
    push = f"import sys; sys.path.insert(0, {str(tree)!r})\n" + push
    run_code(push, variables=variables)
    rows: list[list[Cell]] = []
    for name, target, file, line, other in EDITS:
        path = tree / "physics" / file
        source, spent = path.read_text(), []
        assert line in source
        path.write_text(source.replace(line, other, 1))
        saved = folder / "saved"
        shutil.copytree(folder / "edited", saved)
        for _ in range(RUNS):
            shutil.rmtree(folder / "edited")
            shutil.copytree(saved, folder / "edited")
            spent.append(run_code(push, variables=variables)[0])
        shutil.rmtree(saved)
        path.write_text(source)
        rows.append([name, target, statistics.median(spent), max(spent)])
    return rows

"""Error against cost for one scene: a cube slides to rest, at several steps of each method.

Error: the largest relative error of the stopping distance v²/(2 μ g) over five initial speeds.
Cost: wall time of one thread per simulated second of one world while the cube slides, ours for one
world and for 64 worlds at once. MuJoCo has its default contact parameters and elliptic friction
cones, and advances one world. All settings take turns; figures are the fastest round, as other load
on the machine can only add time.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from benchmarks.measure.tradeoff import MANY, SETTINGS
from benchmarks.peers.mujoco_scene import MujocoWorld
from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import Side, take_turns
from physics import Fidelity, World
from physics.reference.measures import BLOCK, FRICTION, Make, slide
from physics.reference.scenes import block_on_ground

SPEEDS = (0.5, 0.75, 1.0, 1.5, 2.0)  # m/s
OURS = {
    name: SETTINGS[name]
    for name in (
        "fast", "balanced", "spring, 1 ms", "spring, 0.5 ms", "accurate",
        "impulse, 4 ms", "solid", "impulse, 1 ms", "impulse, 0.5 ms",
    )
}  # fmt: skip
MUJOCO_STEPS = (4e-3, 2e-3, 1e-3, 0.5e-3, 0.25e-3)  # s
TURN = 0.2  # simulated s of a call: from 2 m/s the cube slides for 0.4 s
ROUNDS, SECONDS = 5, 0.1


def sliding_side(world: World | MujocoWorld, worlds: int) -> Side:
    """Each call advances sliding cubes by TURN; counts simulated microseconds of all worlds."""
    world.advance(1.0)

    def slide_on() -> int:
        world.set_state(linear_velocity=(2.0, 0.0, 0.0))
        world.advance(TURN)
        return worlds * round(1e6 * TURN)

    return slide_on


def measure(
    settings: Mapping[str, Fidelity] = OURS,
    steps: Sequence[float] = MUJOCO_STEPS,
    rounds: int = ROUNDS,
    seconds: float = SECONDS,
) -> Iterator[Table]:
    """One table.

    Args:
        settings: fidelities by name.
        steps: of MuJoCo, in s.
        rounds: turns of each side.
        seconds: shortest duration of a turn.
    """
    scene = block_on_ground(BLOCK, FRICTION, mass=1.0)
    errors: dict[str, float] = {}
    methods: dict[str, str] = {}
    single: dict[str, Side] = {}
    many: dict[str, Side] = {}
    for name, fidelity in settings.items():
        make: Any = partial(World, fidelity=fidelity, threads=1)
        methods[name], errors[name] = fidelity.law, _error(make)
        single[name] = sliding_side(make(scene), 1)
        many[name] = sliding_side(make(scene, count=MANY), MANY)
    for step in steps:
        name = f"MuJoCo {1e3 * step:g} ms"
        make = partial(MujocoWorld, timestep=step)
        methods[name], errors[name] = "MuJoCo", _error(make)
        single[name] = sliding_side(make(scene), 1)
    alone = _cost(take_turns(single, rounds, seconds))
    together = _cost(take_turns(many, rounds, seconds))
    rows: list[list[Cell]] = [
        [name, method, errors[name], together.get(name), alone[name]]
        for name, method in methods.items()
    ]
    columns = ["setting", "method", "error of the stopping distance"]
    columns += [f"ms per simulated s, {MANY} worlds", "one world"]
    title = "Cube that slides to rest: error and wall time, one core"
    yield Table("work precision", title, columns, rows)


def _error(make: Make) -> float:
    return max(slide(BLOCK, speed, make) for speed in SPEEDS)


def _cost(rates: Mapping[str, list[float]]) -> dict[str, float]:
    """Wall time in ms per simulated s, from rates in simulated microseconds per second."""
    return {name: 1e3 / (1e-6 * max(found)) for name, found in rates.items()}

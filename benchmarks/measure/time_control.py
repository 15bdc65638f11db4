"""Time control: what passes through a thin wall at 300 m/s, and what each setting costs.

1,000 worlds each, impulse law, substeps of 2 ms. A bullet of 5 mm is shot at a wall of 2 mm at
random angles and phases; at a marble of 16 mm; a rod of 30 cm turns at 1,500 rad/s beside a marble.
Balls at 20 m/s with restitution 0 meet the wall with springs. Costs: one thread, 1,024 worlds, of a
cube at rest on the ground and of the bullet's flight and impact; times take turns, the fastest
counts.
"""

import math
from collections.abc import Iterator

import numpy as np

from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import Side, take_turns
from physics import Body, Box, Fidelity, Material, Scene, Sphere, World
from physics.reference.scenes import block_on_ground
from physics.scene.fidelity import TIME_CONTROLS
from physics.scene.solids import Static

COUNT, SPEED, TURNING, STEP = 1000, 300.0, 1500.0, 2e-3
BULLET, MARBLE, ROD = Sphere(0.0025), Sphere(0.008), Box((0.15, 0.004, 0.004))
WALL = Box((0.001, 0.06, 0.06))
WORLDS, FRAME = 1024, 6e-3
ROUNDS, SECONDS = 5, 0.3


def _fidelity(time_control: str, law: str = "impulse") -> Fidelity:
    resolution = 1.8 if law == "impulse" else 0.5
    return Fidelity(law=law, contact_resolution=resolution, time_control=time_control)


def _material(restitution: float) -> Material:
    return Material(friction=0.0, restitution=restitution)


def _range(restitution: float) -> Scene:
    """A ball and a thin wall across x."""
    material = _material(restitution)
    return Scene(
        [Body(BULLET, mass=0.004, position=(-1, 0, 0), material=material)],
        [Static(WALL, position=(0, 0, 0), material=material)],
        gravity=(0, 0, 0),
    )


def _pair(first: Sphere | Box, mass: float) -> Scene:
    """A solid at the origin and a marble elsewhere."""
    material = _material(0.5)
    bodies = [
        Body(first, mass=mass, position=(0, 0, 0), material=material),
        Body(MARBLE, mass=0.004, position=(1, 0, 0), material=material),
    ]
    return Scene(bodies, gravity=(0, 0, 0))


def _shots(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities [count, 1, 3] of bullets on their way to the wall."""
    random = np.random.default_rng(0)
    angle, turn = random.uniform(0.0, 1.0, count), random.uniform(0.0, 2.0 * math.pi, count)
    across = [np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn)]
    velocity = SPEED * np.stack([np.cos(angle), *across], axis=1)
    start = -velocity * (random.uniform(0.1, 0.7, count) / velocity[:, 0])[:, None]
    start[:, 1:] += random.uniform(-0.05, 0.05, (count, 2))
    return start[:, None], velocity[:, None]


def _through_wall(time_control: str) -> int:
    world = World(_range(0.5), _fidelity(time_control), COUNT)
    position, velocity = _shots(COUNT)
    world.set_state(position=position, linear_velocity=velocity)
    world.advance(5 * STEP)
    return int((world.position[:, 0, 0] > 0.0).sum())


def _past_marble(time_control: str) -> int:
    world = World(_pair(BULLET, 0.004), _fidelity(time_control), COUNT)
    position = np.zeros((COUNT, 2, 3))
    position[:, 1, 0] = np.random.default_rng(1).uniform(0.1, 0.7, COUNT)
    velocity = np.zeros((COUNT, 2, 3))
    velocity[:, 0, 0] = SPEED
    world.set_state(position=position, linear_velocity=velocity)
    world.advance(2 * STEP)
    return int((world.linear_velocity[:, 1, 0] == 0.0).sum())


def _past_rod(time_control: str) -> int:
    world = World(_pair(ROD, 0.05), _fidelity(time_control), COUNT)
    angle = np.random.default_rng(2).uniform(0.3, 2.8, COUNT)
    position, spin = np.zeros((COUNT, 2, 3)), np.zeros((COUNT, 2, 3))
    position[:, 1, 0], position[:, 1, 1] = 0.12 * np.cos(angle), 0.12 * np.sin(angle)
    spin[:, 0, 2] = TURNING
    world.set_state(position=position, angular_velocity=spin)
    world.advance(STEP)
    return int((np.abs(world.linear_velocity[:, 1]).max(axis=1) == 0.0).sum())


def _through_springs(time_control: str) -> int:
    world = World(_range(0.0), _fidelity(time_control, "spring"), COUNT)
    position = np.zeros((COUNT, 1, 3))
    position[:, 0, 0] = -0.3 - 20.0 * STEP * np.arange(COUNT) / COUNT
    world.set_state(position=position, linear_velocity=(20.0, 0.0, 0.0))
    world.advance(0.05)
    return int((world.position[:, 0, 0] > 0.0).sum())


def _rest(time_control: str) -> Side:
    world = World(block_on_ground(), _fidelity(time_control), WORLDS, threads=1)
    world.advance(0.5)

    def frame() -> int:
        world.advance(20 * STEP)
        return 20 * WORLDS

    return frame


def _shoot(time_control: str) -> Side:
    world = World(_range(0.5), _fidelity(time_control), WORLDS, threads=1)
    position, velocity = _shots(WORLDS)

    def frame() -> int:
        world.set_state(position=position, linear_velocity=velocity)
        world.advance(FRAME)
        return round(FRAME / STEP) * WORLDS

    return frame


def measure() -> Iterator[Table]:
    """Two tables: misses, and costs relative to fixed steps."""
    rows: list[list[Cell]] = []
    for name in TIME_CONTROLS:
        springs = _through_springs(name) if name in ("fixed", "adaptive") else None
        rows.append([name, _through_wall(name), _past_marble(name), _past_rod(name), springs])
    columns = ["time control", "wall", "marble", "rod", "springs, wall"]
    yield Table("time_control misses", f"Missed, of {COUNT:,}", columns, rows)

    cost = {}
    for place, side in (("rest", _rest), ("bullet", _shoot)):
        found = take_turns({name: side(name) for name in TIME_CONTROLS}, ROUNDS, SECONDS)
        cost[place] = {name: 1e9 / max(rates) for name, rates in found.items()}
    rows = []
    for name in TIME_CONTROLS:
        row: list[Cell] = [name]
        for place in ("rest", "bullet"):
            row += [cost[place][name], cost[place][name] / cost[place]["fixed"]]
        rows.append(row)
    columns = ["time control", "cube at rest, ns", "ratio", "bullet, ns", "ratio "]
    title = f"ns per substep and world; one thread, {WORLDS:,} worlds"
    yield Table("time_control cost", title, columns, rows)

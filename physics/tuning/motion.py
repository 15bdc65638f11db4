"""The motion of a scene at a fidelity, read at regular times, and what it cost."""

import math
import warnings
from collections.abc import Callable, Iterable
from contextlib import suppress
from time import perf_counter
from typing import NamedTuple

import numpy as np

from physics.analysis.soft_supports import SoftSupport
from physics.compiler.jit import LANES
from physics.engines import MANY
from physics.errors import SimulationDiverged
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.step.kernel_choice import load_kernels, requested
from physics.world import World

Array = np.ndarray

# called once before the first frame
Start = Callable[[World], None]
# called before every frame with its index
Control = Callable[[World, int], None]

FRAME = 0.04  # s, a frame of the environments
_MEASURED = 0.02  # s, shortest wall time whose measurement counts
_REPEATS = 20  # at most, to reach it
_CALLS = 5  # of which the fastest tells how long a call takes by itself
_LEAST = 0.1  # fraction of a measured time that is the simulation's own, at least


def side_by_side(scene: Scene) -> int:
    """Number of worlds that the engine advances together: a lane group, or one of many bodies.

    Their cost, without that of calls, is nearly that of as many of thousands.
    """
    return LANES if len(scene.bodies) < MANY else 1


class Motion(NamedTuple):
    """What was read at the start and after every frame.

    Attributes:
        position: [frames + 1, worlds, bodies, 3] m.
        orientation: [frames + 1, worlds, bodies, 4] x y z w.
        velocity: [frames + 1, worlds, bodies, 3] m/s.
        energy: [frames + 1, worlds] J, kinetic and potential.
        kinetic: [frames + 1, worlds] J.
        penetration: [frames + 1, worlds] m, largest since the last frame; zeros if not asked for.
        speed: [frames + 1, worlds] m/s, of the fastest body or drive.
    """

    position: Array
    orientation: Array
    velocity: Array
    energy: Array
    kinetic: Array
    penetration: Array
    speed: Array


class Simulated(NamedTuple):
    """A motion, or why there is none.

    Attributes:
        motion: None if the fidelity is refused or the simulation diverges.
        cost: wall time in s per simulated s of one world of many, on one thread.
        note: the message of the error, "" if there is none.
    """

    motion: Motion | None
    cost: float = math.inf
    note: str = ""


class Course(NamedTuple):
    """What happens in a scene, whatever the fidelity.

    Attributes:
        scene: what is in each world.
        frames: number of frames.
        frame: s.
        worlds: number of worlds that are simulated side by side.
        start: sets the initial states; None: those of the scene.
        control: moves drives and motors; None: nothing does.
    """

    scene: Scene
    frames: int
    frame: float
    worlds: int
    start: Start | None = None
    control: Control | None = None

    @property
    def simulated(self) -> float:
        """Simulated s of all worlds together."""
        return self.frames * self.frame * self.worlds


def simulate(
    course: Course, fidelity: Fidelity, *, timed: bool = True, closely: bool = False
) -> Simulated:
    """Simulates a course at a fidelity.

    Args:
        course: what happens.
        fidelity: how accurately it is simulated.
        timed: repeat short simulations until their cost can be measured.
        closely: read penetrations, and speeds after every substep, not only after frames.

    Raises:
        Exception: whatever `start` or `control` raise.
    """
    try:
        world = _world(course, fidelity)
    except ValueError as error:
        return Simulated(None, note=str(error))
    try:
        # compiles, so that the cost is that of later runs
        world.advance(fidelity.substep)
        called = _call_time(world, course) * course.frames
        motion, spent = _run(world, course)
        shortest, total, repeats = spent, spent, 1
        while timed and total < _MEASURED and repeats < _REPEATS:
            again = _run(world, course)[1]
            shortest, total, repeats = min(shortest, again), total + again, repeats + 1
        if closely:
            motion = _run(world, course, fidelity.substep)[0]
    except SimulationDiverged as error:
        return Simulated(None, note=str(error))
    # a call's own time is a small part where thousands of worlds share it
    return Simulated(motion, max(shortest - called, _LEAST * shortest) / course.simulated)


def _world(course: Course, fidelity: Fidelity) -> World:
    kernel = requested(None, "special")  # as in training: its cost is what counts
    with warnings.catch_warnings():  # of candidates, most of which aren't chosen
        warnings.simplefilter("ignore", SoftSupport)
        return World(course.scene, fidelity, course.worlds, threads=1, kernel=kernel)


def compile_for(course: Course, fidelities: Iterable[Fidelity]) -> None:
    """Makes sure that the kernels are compiled; a fidelity that the scene refuses needs none."""
    simulations = []
    for fidelity in fidelities:
        with suppress(ValueError):
            simulations.append(_world(course, fidelity)._simulation)
    load_kernels((s.features, s.base, s.fidelity) for s in simulations)


def begin(course: Course, fidelities: Iterable[Fidelity]) -> None:
    """Calls `start` and `control` once, so that their errors come before anything is compiled.

    Args:
        course: what happens.
        fidelities: of which the first that the scene allows is taken.

    Raises:
        Exception: whatever `start` or `control` raise.
    """
    for fidelity in fidelities:
        try:
            world = _world(course, fidelity)
        except ValueError:
            continue
        with suppress(SimulationDiverged):  # at this fidelity
            if course.start is not None:
                course.start(world)
            if course.control is not None:
                course.control(world, 0)
            return


def _call_time(world: World, course: Course) -> float:
    """How many s a call of `advance` takes by itself: one that advances no world."""
    if course.worlds == 1:
        return 0.0
    nobody, times = np.zeros(world.count, dtype=bool), []
    for _ in range(_CALLS):
        begin = perf_counter()
        world.advance(course.frame, nobody)
        times.append(perf_counter() - begin)
    return min(times)


def _run(world: World, course: Course, piece: float | None = None) -> tuple[Motion, float]:
    """The motion, and the s that the engine needed for it.

    With `piece`, penetrations are read, and of the readings every `piece` s within a frame the
    largest penetration and speed count.
    """
    world.reset()
    pieces = max(1, math.ceil(course.frame / piece * (1.0 - 1e-9))) if piece else 1
    if course.start is not None:
        course.start(world)
    nothing = np.zeros(world.count)
    penetration, speed = world.penetration() if piece else nothing, _speed(world)
    frames, spent = [(*_read(world), penetration, speed)], 0.0
    for k in range(course.frames):
        if course.control is not None:
            course.control(world, k)
        penetration, speed = nothing, nothing
        for _ in range(pieces):
            begin = perf_counter()
            world.advance(course.frame / pieces)
            spent += perf_counter() - begin
            if piece:
                penetration = np.maximum(penetration, world.penetration())
                speed = np.maximum(speed, _speed(world))
        frames.append((*_read(world), penetration, speed if piece else _speed(world)))
    return Motion(*(np.stack(values) for values in zip(*frames, strict=True))), spent


def _read(world: World) -> tuple[Array, ...]:
    kinetic = world.kinetic_energy()
    return (
        world.position.copy(),
        world.orientation.copy(),
        world.linear_velocity.copy(),
        kinetic + world.potential_energy(),
        kinetic,
    )


def _speed(world: World) -> Array:
    velocities = np.concatenate([world.linear_velocity, world.drive_velocity], axis=1)
    return np.asarray(np.linalg.norm(velocities, axis=-1).max(axis=1, initial=0.0))

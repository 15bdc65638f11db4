"""Runs a scene of many bodies in one world, and shows how fast and how far it is."""

import math
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from physics.model.free_memory import check_memory
from physics.reference.many_bodies import SCENES
from physics.scene.fidelity import resolve
from physics.world import World
from training.settings.errors import UsageError

if TYPE_CHECKING:
    from training.results.film import Film

# of a body, in the scene and in the engine, at least
_LEAST_BYTES = 1500
# pixels, width and height of a frame
SIZE = 480
# s of simulated time between two lines of the counter, and between two frames of a video
_SHOWN_EVERY = 0.04


class SceneRun(NamedTuple):
    """What was made.

    Attributes:
        seconds: s of simulated time.
        wall: s that it took, without compiling.
        steps: substeps.
        kinetic: J, kinetic energy at the end.
        energy: J, kinetic and potential, at the end.
        penetration: m, the deepest at the end.
        interrupted: ended by Ctrl-C.
    """

    seconds: float
    wall: float
    steps: int
    kinetic: float
    energy: float
    penetration: float
    interrupted: bool


def run(
    name: str,
    bodies: int,
    seconds: float,
    seed: int,
    threads: int | None,
    video: Path | None = None,
    size: int = SIZE,
    preset: str | None = None,
) -> SceneRun:
    """Runs a scene and prints its progress; Ctrl-C ends it with what was made so far.

    Args:
        name: of the scene.
        bodies: how many.
        seconds: s of simulated time.
        seed: of what is random in it.
        threads: all cores if None.
        video: the mp4 or GIF to write, with 25 frames for each simulated second, of which a GIF
            keeps every second one; none if None.
        size: width and height of a frame in pixels.
        preset: name of the fidelity; by default the one that suits the scene.

    Raises:
        UsageError: no such scene or preset, more bodies than memory can hold, or a video that
            can't be written.
    """
    if name not in SCENES:
        raise UsageError(f"unknown scene {name!r}: choose one of {', '.join(SCENES)}")
    if video is not None:  # before a scene of many bodies is built
        _check_size(size)
    try:
        check_memory(bodies * _LEAST_BYTES, f"the {bodies} bodies of a scene")
        scene, fidelity = SCENES[name](bodies, seed)
        if preset is not None:
            fidelity = resolve(preset)
        world = World(scene, fidelity, threads=threads)
    except (MemoryError, ValueError) as error:
        raise UsageError(str(error)) from None
    count = len(scene.bodies)
    asked = f" of the {bodies} asked for" if count != bodies else ""
    print(
        f"{name}: {count} {'body' if count == 1 else 'bodies'}{asked}, law {fidelity.law}, "
        f"substep {fidelity.substep * 1e3:.3g} ms"
    )
    substeps = max(1, round(_SHOWN_EVERY / fidelity.substep))
    frame, steps, wall, interrupted = substeps * fidelity.substep, 0, 0.0, False
    film = _film(world, video, size, 1.0 / frame)
    try:
        world.advance(fidelity.substep)  # compiles the kernels
        steps = 1
        while float(world.time[0]) < seconds - 1e-9:
            span = min(frame, seconds - float(world.time[0]))
            start = time.perf_counter()
            world.advance(span)
            wall += time.perf_counter() - start
            steps += math.ceil(span / fidelity.substep * (1.0 - 1e-12))
            if film is not None:
                film.add()
            _show(world, steps, wall, seconds)
    except KeyboardInterrupt:
        interrupted = True
    finally:
        if film is not None:
            film.close()
    kinetic = float(world.kinetic_energy()[0])
    energy = kinetic + float(world.potential_energy()[0])
    made = SceneRun(
        float(world.time[0]), wall, steps, kinetic, energy, float(world.penetration()[0]),
        interrupted,
    )  # fmt: skip
    _summarise(made, count)
    if film is not None:
        print(f"video       {film.path}, {film.count} frames drawn, {film.rate:.1f} a second")
    return made


def _film(world: World, video: Path | None, size: int, fps: float) -> "Film | None":
    """The video, whose writers are imported only if one is asked for."""
    if video is None:
        return None
    from training.results.film import Film

    return Film(world, video, fps, size)


def _check_size(size: int) -> None:
    """Raises UsageError for a size that a video can't have."""
    from rigid_envs.rendering.pictures import LEAST, MOST

    if not LEAST <= size <= MOST:
        raise UsageError(f"--size is {size}, should be {LEAST} to {MOST} pixels")


def _show(world: World, steps: int, wall: float, seconds: float) -> None:
    """One line that replaces the last one; nothing where the output is not a terminal."""
    if not sys.stdout.isatty():
        return
    now, fastest = float(world.time[0]), float(np.abs(world.linear_velocity).max())
    print(
        f"\r{now:7.2f} of {seconds:g} s  {steps / wall:8.0f} steps/s  "
        f"{now / wall:6.2f} simulated s per s  fastest {fastest:5.2f} m/s",
        end="", flush=True,
    )  # fmt: skip


def _summarise(made: SceneRun, bodies: int) -> None:
    if sys.stdout.isatty():
        print()
    if made.wall > 0.0:
        rate = made.steps / made.wall
        print(
            f"{rate:.0f} steps/s, {1e-6 * rate * bodies:.3f} million body-steps/s, "
            f"{made.seconds / made.wall:.3f} simulated seconds a second"
        )
    print(
        f"{'interrupted: ' if made.interrupted else ''}{made.seconds:.3f} s simulated in "
        f"{made.steps} {'step' if made.steps == 1 else 'steps'}; energy {made.energy:.6g} J, "
        f"kinetic {made.kinetic:.3g} J; deepest penetration {1e3 * made.penetration:.3g} mm"
    )

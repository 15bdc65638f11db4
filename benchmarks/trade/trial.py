"""A trial: a scene, how it starts, and how far from the right answer it ends."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from physics import Scene, SimulationDiverged

Array = np.ndarray

FRAME = 0.04  # s between two readings; a whole number of every step that is measured
# of the body that moves fastest: beyond it a run counts as diverged
_FASTEST = 1e5  # m/s


class Worlds(Protocol):
    """What trials use of an engine: a physics.World, or MujocoWorlds."""

    count: int

    @property
    def position(self) -> Array: ...
    @property
    def orientation(self) -> Array: ...
    @property
    def linear_velocity(self) -> Array: ...
    @property
    def angular_velocity(self) -> Array: ...
    @property
    def time(self) -> Array: ...
    def advance(self, time: float) -> None: ...
    def set_state(
        self,
        *,
        position: Any = ...,
        orientation: Any = ...,
        linear_velocity: Any = ...,
        angular_velocity: Any = ...,
    ) -> None: ...
    def move_drives(self, target: Any, time: float) -> None: ...
    def kinetic_energy(self) -> Array: ...
    def potential_energy(self) -> Array: ...
    def angular_momentum(self) -> Array: ...
    def penetration(self) -> Array: ...


# builds worlds of a scene: ours or the peer's, of a setting
Make = Callable[[Scene, int], Worlds]


class Trace(NamedTuple):
    """What was read after the start, and after every FRAME.

    Attributes:
        time: [frames + 1] s since the start.
        position: [frames + 1, worlds, bodies, 3] m.
        orientation: [frames + 1, worlds, bodies, 4].
        linear_velocity: [frames + 1, worlds, bodies, 3] m/s.
        angular_velocity: [frames + 1, worlds, bodies, 3] rad/s.
        momentum: [frames + 1, worlds, 3] kg m^2/s, angular, about the origin.
    """

    time: Array
    position: Array
    orientation: Array
    linear_velocity: Array
    angular_velocity: Array
    momentum: Array


@dataclass(frozen=True)
class Trial:
    """A scene with a right answer.

    Args:
        name: key in the results.
        title: a sentence for readers.
        error_of: what the error is, and relative to what.
        scene: what is in each world.
        error: of a trace; 0 for a perfect engine.
        prepare: moves drives before the worlds settle; None: there are none.
        begin: sets the states of all worlds once they have settled; None: they are the scene's.
        worlds: number of worlds whose largest error counts.
        settle: s before the start.
        time: s that are judged.
        timed: s after the start that the cost is measured on; None: all of `time`.
        longest: s, longest step that is measured.
        restitution: e of the impacts, for which the peer's contacts are tuned; None: no impacts.
        grip: the peer's fingers press with a force instead of following a path.
        joints: the scene is about rotation or joints, not contact.
        events: settings that stop at every impact are measured, too. Cubes that rattle while they
            stand have thousands of impacts a second.
    """

    name: str
    title: str
    error_of: str
    scene: Scene
    error: Callable[[Trace], float]
    begin: Callable[[Worlds], None] | None = None
    prepare: Callable[[Worlds], None] | None = None
    worlds: int = 1
    settle: float = 0.0
    time: float = 1.0
    timed: float | None = None
    longest: float = 0.02
    restitution: float | None = None
    grip: bool = False
    joints: bool = False
    events: bool = True


class Outcome(NamedTuple):
    """How a run ended.

    Attributes:
        status: "stable", or why there are no figures: "diverged" or "refused".
        error: see the trial; nan if the status isn't "stable".
        energy: largest gain of energy, relative to the largest kinetic energy plus what it takes to
            lift every body by its width.
        penetration: m, deepest at any frame after the start.
        note: the message of a refusal.
    """

    status: str
    error: float = math.nan
    energy: float = math.nan
    penetration: float = math.nan
    note: str = ""


def start(trial: Trial, make: Make, count: int) -> Worlds:
    """Worlds at the start of a trial; the `trial.worlds` starts are repeated.

    Raises:
        ValueError: the engine refuses the setting.
    """
    worlds = make(trial.scene, count)
    if trial.prepare is not None:
        trial.prepare(worlds)
    if trial.settle:
        worlds.advance(trial.settle)
    if trial.begin is not None:
        trial.begin(worlds)
    return worlds


def judge(trial: Trial, make: Make) -> Outcome:
    """Runs a trial and judges it."""
    try:
        worlds = start(trial, make, trial.worlds)
        frames = [_read(worlds)]
        energy = [worlds.kinetic_energy() + worlds.potential_energy()]
        moving, deepest = worlds.kinetic_energy() + _lift(trial.scene), 0.0
        for _ in range(round(trial.time / FRAME)):
            worlds.advance(FRAME)
            frames.append(_read(worlds))
            now = worlds.kinetic_energy()
            moving = np.maximum(moving, now + _lift(trial.scene))
            energy.append(now + worlds.potential_energy())
            deepest = max(deepest, float(worlds.penetration().max()))
            fastest = np.abs(frames[-1].linear_velocity).max()
            if not fastest < _FASTEST:
                return Outcome("diverged")
    except SimulationDiverged as error:
        return Outcome("diverged", note=str(error))
    except ValueError as error:
        return Outcome("refused", note=str(error))
    trace = Trace(*(np.stack(values) for values in zip(*frames, strict=True)))
    trace = trace._replace(time=trace.time - trace.time[0])
    wrong = float(trial.error(trace))
    if not math.isfinite(wrong):
        return Outcome("diverged")
    gained = (np.max(energy, axis=0) - energy[0]) / np.maximum(moving, 1e-12)
    return Outcome("stable", wrong, float(gained.max()), deepest)


def _lift(scene: Scene) -> float:
    """J that lift every body by its own width: the scale of energies where all is at rest."""
    weight = math.hypot(*scene.gravity)
    return sum(float(body.mass or 0.0) * weight * body.shape.width for body in scene.bodies)


def _read(worlds: Worlds) -> Trace:
    return Trace(
        worlds.time[0],
        worlds.position.copy(),
        worlds.orientation.copy(),
        worlds.linear_velocity.copy(),
        worlds.angular_velocity.copy(),
        worlds.angular_momentum().copy(),
    )

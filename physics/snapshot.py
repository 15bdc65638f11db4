"""Snapshots: the complete state of worlds, saved and restored."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from physics.analysis.parameter_limits import ParameterLimits
from physics.model.features import Features
from physics.model.state import State, convert, copy
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene
from physics.step.simulation import Simulation

Array = np.ndarray


class Snapshot(NamedTuple):
    """The complete state of worlds, hidden contact state included, and their scene and fidelity.

    Attributes:
        features: of the kernel that advanced them: what it remembers of contacts depends on it.
        engine: that simulates them, see `physics.engines`.
    """

    scene: Scene
    fidelity: Fidelity
    state: State
    features: Features
    engine: str
    parameters: Parameters | None = None  # of worlds with per-world parameters
    hidden: Any = None  # of worlds of many bodies: their pairs
    memory: Mapping[str, Array] = MappingProxyType({})  # see `World.memory`


def save(simulation: Simulation) -> Snapshot:
    """A snapshot of all worlds."""
    everyone, own = simulation.everyone, simulation.parameters
    parameters = own.pick(everyone) if simulation.features.per_world_parameters else None  # a copy
    return Snapshot(
        simulation.scene, simulation.fidelity, copy(simulation.state), simulation.features,
        simulation.engine, parameters, simulation.saved(),
    )  # fmt: skip


def restore(simulation: Simulation, saved: Snapshot, limits: ParameterLimits | None) -> None:
    """Returns all worlds to a snapshot.

    Args:
        simulation: of the worlds.
        saved: a snapshot of worlds of the same scene, fidelity and count.
        limits: check parameters that differ from the present ones; None: don't.

    Raises:
        ValueError: a snapshot of other worlds; parameters that `ParameterLimits` refuses. The state
            is then unchanged.
    """
    what = _difference(simulation, saved)
    if what:
        raise ValueError(
            f"saved must be a snapshot of a World of the same scene, fidelity and count; it has "
            f"another {what}"
        )
    if saved.parameters is not None:
        pairs = zip(simulation.parameters, saved.parameters, strict=True)
        other = np.any([np.any(mine != theirs, axis=1) for mine, theirs in pairs], axis=0)
        if other.any():
            new = saved.parameters.pick(other)
            if limits is not None:
                limits.check(new, np.flatnonzero(other))
            simulation.write_parameters(other, new)
    simulation.set_wrenches(saved.state.wrench)
    state = saved.state
    if state.candidate.dtype != simulation.state.candidate.dtype:  # of another kernel
        state = convert(state, saved.features, simulation.features)
    for name in state._fields:
        if name != "wrench":
            getattr(simulation.state, name)[...] = getattr(state, name)
    simulation.restore(saved.hidden)
    simulation.changed()


def _difference(simulation: Simulation, saved: Snapshot) -> str:
    """In what the worlds of a snapshot differ; empty if they are alike."""
    count = len(saved.state.world)
    if count != simulation.count:
        return f"count: {count} instead of {simulation.count}"
    if saved.engine != simulation.engine:
        return f"engine: {saved.engine!r} instead of {simulation.engine!r}"
    if saved.fidelity != simulation.fidelity:
        ours = vars(simulation.fidelity)
        fields = [f"{k}={v!r}" for k, v in vars(saved.fidelity).items() if v != ours[k]]
        return f"fidelity: {', '.join(fields)}"
    if saved.scene != simulation.scene:
        return "scene"
    arrays = zip(State._fields, saved.state, simulation.state, strict=True)
    if any(name != "candidate" and a.dtype != b.dtype for name, a, b in arrays):
        return "version: its arrays have other fields"
    if saved.state.servo.shape != simulation.state.servo.shape:
        return f"measure_work: {saved.state.servo.size > 0}"
    if (saved.parameters is not None) != simulation.features.per_world_parameters:
        return f"per_world_parameters: {saved.parameters is not None}"
    return ""

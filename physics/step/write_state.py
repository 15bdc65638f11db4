"""Writes poses and velocities that a user gives into the state of chosen worlds."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from physics.model.features import NO_ROTATION
from physics.scene.validation import array
from physics.step.simulation import Simulation, angular_momentum_of

Array = np.ndarray


def write_state(simulation: Simulation, given: Mapping[str, Any], worlds: Array) -> None:
    """Writes any part of the state of the worlds of a mask, and clears what is hidden in them.

    Args:
        simulation: whose state.
        given: by the names of `World.set_state`; None for what stays.
        worlds: mask [count].

    Raises:
        ValueError: see `World.set_state`; nothing is written then.
    """
    new = _checked(simulation, given, int(worlds.sum()))
    state, bodies, chosen = simulation.state, simulation.bodies, np.flatnonzero(worlds)
    # what isn't given stays: the spin, not its momentum, where only the orientation changes
    angular_velocity = new.get("angular_velocity")
    if angular_velocity is None and "orientation" in new:
        turning = state.dynamic["angular_momentum"][worlds].any()
        angular_velocity = simulation.angular_velocity()[worlds] if turning else None
    if "position" in new:
        state.dynamic["position"][worlds, :bodies] = new["position"]
    if "orientation" in new:
        state.dynamic["orientation"][worlds, :bodies] = new["orientation"]
    if "linear_velocity" in new:
        inverse = simulation.of_bodies("inverse_mass", chosen)
        state.dynamic["momentum"][worlds, :bodies] = new["linear_velocity"] / inverse[..., None]
    if angular_velocity is not None:
        turn = state.dynamic["orientation"][worlds, :bodies]
        inertia = simulation.of_bodies("inertia", chosen)
        state.dynamic["angular_momentum"][worlds, :bodies] = angular_momentum_of(
            inertia, turn, angular_velocity
        )
    if "drive_position" in new:
        state.dynamic["position"][worlds, bodies:] = new["drive_position"]
        state.dynamic["reference"][worlds, bodies:] = new["drive_position"]
        state.dynamic["reference_velocity"][worlds, bodies:] = 0.0
    if "drive_velocity" in new:
        inverse = simulation.base.dynamic["inverse_mass"][bodies:, None]
        state.dynamic["momentum"][worlds, bodies:] = new["drive_velocity"] / inverse
    if "time" in new:
        state.world["time"][worlds] = new["time"]
    simulation.forget(worlds)


def _checked(simulation: Simulation, given: Mapping[str, Any], chosen: int) -> dict[str, Array]:
    """What is given as arrays [chosen, ...], unit quaternions included."""
    bodies, drives = simulation.bodies, len(simulation.scene.driven_bodies)
    sizes = {
        "position": (bodies, 3),
        "orientation": (bodies, 4),
        "linear_velocity": (bodies, 3),
        "angular_velocity": (bodies, 3),
        "drive_position": (drives, 3),
        "drive_velocity": (drives, 3),
        "time": (),
    }
    new = {
        name: array(name, value, (chosen, *sizes[name]))
        for name, value in given.items()
        if value is not None
    }
    if "orientation" in new:
        new["orientation"] = _unit(new["orientation"])
    spins = np.any(new.get("angular_velocity", 0.0))
    if simulation.features.rotation == NO_ROTATION and spins:
        raise ValueError(
            "angular_velocity must be zero in a scene of frictionless balls at rest, where "
            "rotation isn't simulated; give a body its spin in the Scene"
        )
    for name in ("drive_position", "drive_velocity"):
        for first, _ in simulation.scene.grippers if name in new else ():
            one, other = new[name][:, first, ::2], new[name][:, first + 1, ::2]
            if np.any(one != other):
                raise ValueError(
                    f"{name} must have the same x and z for both fingers of a gripper, tools "
                    f"{first} and {first + 1}, which are one solid along these axes"
                )
    return new


def _unit(quaternion: Array) -> Array:
    """Quaternions [..., 4] of length one; those of length zero raise ValueError."""
    # of the largest entry first: squares of large ones overflow
    largest = np.abs(quaternion).max(axis=-1, keepdims=True)
    if np.any(largest < 1e-12):
        raise ValueError(
            "orientation holds a quaternion of length zero; no rotation is (0, 0, 0, 1)"
        )
    turn = quaternion / largest
    return np.asarray(turn / np.sqrt(np.sum(turn**2, axis=-1, keepdims=True)))

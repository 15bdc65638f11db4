"""Writes poses and velocities from the user into the state of selected worlds."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from physics.model.features import NO_ROTATION
from physics.model.joint_values import pose_errors
from physics.scene.validation import array
from physics.step.simulation import Simulation, angular_momentum_of

Array = np.ndarray

# m or rad, by which poses from the user may violate a joint; the next step removes it
JOINT_TOLERANCE = 1e-6


def write_state(simulation: Simulation, given: Mapping[str, Any], worlds: Array) -> None:
    """Writes parts of the state of selected worlds, and clears their hidden contact state.

    Args:
        simulation: the simulation to change.
        given: values by argument name of `World.set_state`; None for values that stay unchanged.
        worlds: mask [count] of the selected worlds.

    Raises:
        ValueError: see `World.set_state`; the state is then unchanged.
    """
    new = _checked(simulation, given, int(worlds.sum()))
    _check_joints(simulation, new, worlds)
    state, bodies, chosen = simulation.state, simulation.bodies, np.flatnonzero(worlds)
    # if only the orientation changes, the angular velocity stays and the angular momentum changes
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
        orientation = state.dynamic["orientation"][worlds, :bodies]
        inertia = simulation.of_bodies("inertia", chosen)
        state.dynamic["angular_momentum"][worlds, :bodies] = angular_momentum_of(
            inertia, orientation, angular_velocity
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
    """Checks the given values and broadcasts them to arrays [chosen, ...].

    Args:
        simulation: see `write_state`.
        given: see `write_state`.
        chosen: number of selected worlds.

    Returns:
        Arrays by name, of the values that are not None; orientations have length one.

    Raises:
        ValueError: see `World.set_state`.
    """
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
    if simulation.needed.rotation == NO_ROTATION and spins:
        raise ValueError(
            "angular_velocity must be zero in a scene of frictionless balls at rest, where "
            "rotation is not simulated; set the angular_velocity of a Body in the Scene instead"
        )
    for name in ("drive_position", "drive_velocity"):
        for first, _ in simulation.scene.grippers if name in new else ():
            one, other = new[name][:, first, ::2], new[name][:, first + 1, ::2]
            if np.any(one != other):
                raise ValueError(
                    f"{name} must have the same x and z for both fingers of a gripper, drives "
                    f"{first} and {first + 1}, which are one solid along these axes"
                )
    return new


def _check_joints(simulation: Simulation, new: Mapping[str, Array], worlds: Array) -> None:
    """Raises ValueError if new poses violate a joint: the next step would throw the bodies."""
    joints = simulation.scene.joints
    moved = {"position", "orientation", "drive_position"} & set(new)
    if not joints or not moved or not worlds.any():
        return
    poses = simulation.state.dynamic[worlds]  # a copy
    for name, field, first in (
        ("position", "position", 0),
        ("orientation", "orientation", 0),
        ("drive_position", "position", simulation.bodies),
    ):
        if name in new:
            poses[field][:, first : first + new[name].shape[1]] = new[name]
    rows = simulation.base.joint_row
    errors = pose_errors(simulation.scene, rows, poses["position"], poses["orientation"])
    errors = np.nan_to_num(errors, nan=np.inf)  # of poses that overflow
    n, j = divmod(int(np.argmax(errors)), len(joints))
    if errors[n, j] > JOINT_TOLERANCE:
        name = joints[j].name or f"joint {j}"
        raise ValueError(
            f"position and orientation must agree with the joints within {JOINT_TOLERANCE:g} m or "
            f"rad: in world {np.flatnonzero(worlds)[n]} they violate {name}, a "
            f"{type(joints[j]).__name__} between {joints[j].a!r} and {joints[j].b!r}, by "
            f"{errors[n, j]:.3g}; set the poses of both bodies"
        )


def _unit(quaternion: Array) -> Array:
    """Quaternions [..., 4] scaled to length one.

    Raises:
        ValueError: a quaternion has length zero.
    """
    # divide by the largest entry first, because the squares of large entries overflow
    largest = np.abs(quaternion).max(axis=-1, keepdims=True)
    if np.any(largest < 1e-12):
        raise ValueError(
            "orientation holds a quaternion of length zero; no rotation is (0, 0, 0, 1)"
        )
    scaled = quaternion / largest
    return np.asarray(scaled / np.sqrt(np.sum(scaled**2, axis=-1, keepdims=True)))

"""Potential energy of bodies in fields: springs to points and attractors."""

from typing import Any

import numpy as np

from physics.model.tables import ATTRACTOR, POINT_SPRING
from physics.rotation import rotate
from physics.step.simulation import Simulation

Array = np.ndarray


def field_energy(simulation: Simulation) -> Array:
    """[count] J of all springs and attractors of a scene."""
    energy = np.zeros(simulation.count)
    for row in simulation.base.field:
        if row["kind"] == POINT_SPRING:
            energy += _spring_energy(simulation, row)
        elif row["kind"] == ATTRACTOR:
            energy += _attractor_energy(simulation, row)
    return energy


def _spring_energy(simulation: Simulation, row: Any) -> Array:
    here = point_position(simulation, int(row["body"]), row["point"])
    other = int(row["other"])
    there = row["to"] if other < 0 else point_position(simulation, other, row["to"])
    length = np.sqrt(np.sum((there - here) ** 2, axis=-1))
    return np.asarray(0.5 * row["stiffness"] * (length - row["rest_length"]) ** 2)


def point_position(simulation: Simulation, body: int, point: Array) -> Array:
    """[count, 3] m, position of a point given in the frame of a body."""
    rows = simulation.state.dynamic[:, body]
    arm = rotate(rows["orientation"], np.broadcast_to(point, (simulation.count, 3)))
    return np.asarray(rows["position"] + arm)


def _attractor_energy(simulation: Simulation, row: Any) -> Array:
    """With r^-n the force per mass and strength: r^(1 - n)/(1 - n), ln r for n = 1."""
    inverse, inertia = (simulation.of_bodies(name) for name in ("inverse_mass", "inertia"))
    mass = np.broadcast_to(1.0 / inverse, (simulation.count, simulation.bodies))
    inertia = np.broadcast_to(inertia, (*mass.shape, 3))
    strength, n = float(row["strength"]), float(row["exponent"])
    total = np.zeros(simulation.count)
    for body in range(simulation.bodies):
        points = np.zeros((1, simulation.count, 3))
        if row["per_particle"]:
            J = inertia[:, body]
            mean_square = (J.sum(axis=-1, keepdims=True) - 2.0 * J) / (2.0 * mass[:, body, None])
            reach = np.sqrt(np.maximum(3.0 * mean_square, 0.0))
            points = np.concatenate([sign * reach * np.eye(3)[:, None] for sign in (1.0, -1.0)])
        for point in points:
            offset = point_position(simulation, body, point) - row["to"]
            r = np.sqrt(np.sum(offset**2, axis=-1))
            potential = np.log(r) if n == 1.0 else r ** (1.0 - n) / (1.0 - n)
            total += strength * mass[:, body] / len(points) * potential
    return total

"""Energies and momenta of the bodies of all worlds."""

import numpy as np

from physics.analysis.field_energies import field_energy
from physics.step.simulation import Simulation

Array = np.ndarray


def kinetic_energy(simulation: Simulation) -> Array:
    """[count] J of the bodies, translation and rotation."""
    momentum = simulation.state.dynamic["momentum"][:, : simulation.bodies]
    inverse = simulation.of_bodies("inverse_mass")
    axes = "wbi,wbi,b->w" if inverse.ndim == 1 else "wbi,wbi,wb->w"
    translation = np.einsum(axes, momentum, momentum, inverse)
    angular = simulation.state.dynamic["angular_momentum"][:, : simulation.bodies]
    rotation = np.einsum("wbi,wbi->w", angular, simulation.angular_velocity())
    return 0.5 * (translation + rotation)


def potential_energy(simulation: Simulation) -> Array:
    """[count] J of the bodies in gravity, springs to points and attractors."""
    weight = simulation.of_bodies("weight")
    axes = "wbi,bi->w" if weight.ndim == 2 else "wbi,wbi->w"
    position = simulation.state.dynamic["position"][:, : simulation.bodies]
    return field_energy(simulation) - np.einsum(axes, position, weight)


def drive_energy(simulation: Simulation) -> Array:
    """[count, drives] J, kinetic energy of each drive."""
    momentum = simulation.state.dynamic["momentum"][:, simulation.bodies :]
    inverse = simulation.base.dynamic["inverse_mass"][simulation.bodies :]
    return np.asarray(0.5 * inverse * np.sum(momentum**2, axis=-1))


def drive_work(simulation: Simulation) -> Array:
    """[count, drives] J, work of each drive's servo since the state was set.

    Raises:
        ValueError: it is not measured.
    """
    if not simulation.features.measures_work:
        raise ValueError("drive_work needs a World that is built with measure_work=True")
    return np.asarray(simulation.state.servo["work"][:, simulation.bodies :].copy())


def linear_momentum(simulation: Simulation) -> Array:
    """[count, 3] kg m/s of the bodies."""
    return np.asarray(simulation.state.dynamic["momentum"][:, : simulation.bodies].sum(axis=1))


def angular_momentum(simulation: Simulation) -> Array:
    """[count, 3] kg m^2/s of the bodies about the origin."""
    dynamic = simulation.state.dynamic[:, : simulation.bodies]
    orbital = np.cross(dynamic["position"], dynamic["momentum"])
    return np.asarray((orbital + dynamic["angular_momentum"]).sum(axis=1))

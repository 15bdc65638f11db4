"""What the equations of motion say now: forces, accelerations, inertia in the world frame.

    a = F / M,   alpha = J^-1 (tau - omega x J omega),
    J = R J0 R^T,   dJ/dt = [omega]x J - J [omega]x,

and for a point at r from the centre, fixed to the body, v + omega x r and
a + alpha x r + omega x (omega x r). (The lecture's alpha = tau / I holds for a sphere.)

Forces are those at the present positions. Where they depend on velocities, contacts use those of
half a step before.
"""

import numpy as np

from physics.orientation import matrix_rate
from physics.rotation import rotate, rotate_back, rotation_matrix
from physics.step.simulation import Simulation

Array = np.ndarray


def force(simulation: Simulation) -> Array:
    """[count, bodies, 3] N."""
    return simulation.state.dynamic["force"][:, : simulation.bodies].copy()


def torque(simulation: Simulation) -> Array:
    """[count, bodies, 3] N m about the centres of mass."""
    return simulation.state.dynamic["torque"][:, : simulation.bodies].copy()


def linear_acceleration(simulation: Simulation) -> Array:
    """[count, bodies, 3] m/s^2."""
    return np.asarray(force(simulation) * simulation.of_bodies("inverse_mass")[..., None])


def angular_acceleration(simulation: Simulation) -> Array:
    """[count, bodies, 3] rad/s^2."""
    dynamic = simulation.state.dynamic[:, : simulation.bodies]
    omega, q = simulation.angular_velocity(), dynamic["orientation"]
    turning = torque(simulation) - np.cross(omega, dynamic["angular_momentum"])
    return np.asarray(rotate(q, simulation.of_bodies("inverse_inertia") * rotate_back(q, turning)))


def inertia(simulation: Simulation) -> Array:
    """[count, bodies, 3, 3] kg m^2."""
    R = rotation_matrix(simulation.state.dynamic["orientation"][:, : simulation.bodies])
    moments = simulation.of_bodies("inertia")
    axes = "wbij,bj,wbkj->wbik" if moments.ndim == 2 else "wbij,wbj,wbkj->wbik"
    return np.asarray(np.einsum(axes, R, moments, R))


def inertia_rate(simulation: Simulation) -> Array:
    """[count, bodies, 3, 3] kg m^2/s."""
    product = matrix_rate(inertia(simulation), simulation.angular_velocity())  # [omega]x J
    return np.asarray(product + np.swapaxes(product, -1, -2))


def _arm(simulation: Simulation, body: int, point: Array) -> Array:
    return rotate(simulation.state.dynamic["orientation"][:, body], point)


def point_velocity(simulation: Simulation, body: int, point: Array) -> Array:
    """[count, 3] m/s of points [count, 3] m in the body frame."""
    momentum = simulation.state.dynamic["momentum"][:, body]
    velocity = momentum * simulation.of_bodies("inverse_mass")[..., body, None]
    omega = simulation.angular_velocity()[:, body]
    return np.asarray(velocity + np.cross(omega, _arm(simulation, body, point)))


def point_acceleration(simulation: Simulation, body: int, point: Array) -> Array:
    """[count, 3] m/s^2 of points [count, 3] m in the body frame."""
    omega, arm = simulation.angular_velocity()[:, body], _arm(simulation, body, point)
    alpha = angular_acceleration(simulation)[:, body]
    central = np.cross(omega, np.cross(omega, arm))
    return np.asarray(linear_acceleration(simulation)[:, body] + np.cross(alpha, arm) + central)

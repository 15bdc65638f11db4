"""What can be asked of joints: angle or displacement, its rate, and how well the joint holds."""

import numpy as np

from physics.model.joint_values import frame_of, measure, pose_errors
from physics.model.joints import free_directions
from physics.step.simulation import Simulation

Array = np.ndarray


def positions(simulation: Simulation) -> Array:
    """[count, joints] rad of hinges, m of sliders; NaN of others."""
    return _of_free_directions(simulation)[0]


def velocities(simulation: Simulation) -> Array:
    """[count, joints] rad/s of hinges, m/s of sliders; NaN of others."""
    return _of_free_directions(simulation)[1]


def errors(simulation: Simulation) -> Array:
    """[count, joints] the largest violation of each joint's constraints, m or rad."""
    dynamic, rows = simulation.state.dynamic, simulation.base.joint_row
    return pose_errors(simulation.scene, rows, dynamic["position"], dynamic["orientation"])


def _of_free_directions(simulation: Simulation) -> Array:
    """[2, count, joints] value and rate of the direction that each joint leaves free."""
    scene, dynamic, bodies = simulation.scene, simulation.state.dynamic, simulation.bodies
    velocity, omega = np.zeros((2, *dynamic["position"].shape))
    inverse_mass = simulation.of_bodies("inverse_mass")[..., None]
    velocity[:, :bodies] = dynamic["momentum"][:, :bodies] * inverse_mass
    inverse_mass = simulation.base.dynamic["inverse_mass"][bodies:, None]
    velocity[:, bodies:] = dynamic["momentum"][:, bodies:] * inverse_mass
    omega[:, :bodies] = simulation.angular_velocity()
    columns = (dynamic["position"], dynamic["orientation"], velocity, omega)
    found = np.full((2, simulation.count, len(scene.joints)), np.nan)
    for row in free_directions(scene):
        ends = [frame_of(int(row[end]), *columns) for end in ("a", "b")]
        found[:, :, row["joint"]] = measure(row, *ends)
    return found

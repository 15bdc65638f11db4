"""Writes what a user commands: forces on bodies, and the set values of motors."""

from typing import Any

import numpy as np

from physics.model.features import NO_ROTATION
from physics.scene.validation import array
from physics.step.simulation import Simulation


def write_wrench(
    simulation: Simulation, force: Any, torque: Any, body: int | str | None, point: Any
) -> None:
    """Adds forces and torques that act during the next `advance`, see `World.apply_wrench`.

    Raises:
        TypeError, ValueError: see `World.apply_wrench`; nothing is then added.
    """
    count, bodies = simulation.count, simulation.bodies
    chosen: slice | int = slice(None) if body is None else simulation.scene.body_index(body)
    shape = (count, bodies, 3) if body is None else (count, 3)
    new = np.zeros((count, bodies, 6))
    push, turn = array("force", force, shape), array("torque", torque, shape)
    if point is not None:
        centre = simulation.state.dynamic["position"][:, :bodies][:, chosen]
        turn = turn + np.cross(array("point", point, shape) - centre, push)
    if simulation.needed.rotation == NO_ROTATION and turn.any():
        raise ValueError(
            "torque and point must leave frictionless balls at rest without a torque, because "
            "their rotation is not simulated; give a Body in the Scene friction or spin"
        )
    new[:, chosen, :3], new[:, chosen, 3:] = push, turn
    simulation.add_wrench(new)


def write_motors(simulation: Simulation, name: str, values: Any) -> None:
    """Writes the "velocity" or the "position" [count, motors] that motors drive to.

    Raises:
        ValueError: see `World.command_motors`.
    """
    motor = simulation.state.motor
    if motor.shape[1] == 0:
        method = "command_motors" if name == "velocity" else "move_motors"
        raise ValueError(f"World.{method} needs a Hinge or Slider with a Motor in Scene.joints")
    checked = array(name, values, motor.shape[:2])
    motor[..., 0] = checked if name == "velocity" else 0.0
    motor[..., 1] = checked if name == "position" else np.nan

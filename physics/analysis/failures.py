"""The error of worlds whose last steps failed."""

import numpy as np

from physics.analysis.joints import errors as joint_errors
from physics.analysis.step_limits import cause_of_divergence
from physics.constraints.projection import FAILED
from physics.errors import ContactOverflow, SimulationDiverged, StepVanished
from physics.scene.parameters import with_parameters
from physics.step.simulation import Simulation


def failure(simulation: Simulation) -> Exception:
    """The error to raise after a call in which worlds diverged or ran out of room for contacts.

    If both happened, the divergence is raised with the overflow as a note. An overflow is reported
    once.
    """
    full, diverged = simulation.failed("overflow"), simulation.failed("diverged")
    simulation.state.world["overflow"][full] = 0  # a kernel clears those of running worlds only
    overflow = ContactOverflow(
        f"worlds {full}: two bodies have more than eight pairs of particles per particle within "
        "Fidelity.skin; they overlap deeply, or the skin is too wide"
    )
    if not diverged:
        return overflow
    error = _divergence(simulation, diverged)
    if full:
        error.add_note(f"ContactOverflow as well: {overflow}")
    return error


def _divergence(simulation: Simulation, diverged: list[int]) -> SimulationDiverged:
    world, scene, features = diverged[0], simulation.scene, simulation.features
    if features.per_world_parameters:
        scene = with_parameters(scene, simulation.parameters.pick([world]))
    status, model = simulation.state.world[world], simulation.model.of_world(world)
    h = simulation.last_substep
    cause = cause_of_divergence(scene, simulation.fidelity, model, features, h)
    body = int(status["diverged"]) - 1
    name = simulation.scene.solid_names[body]
    if simulation.state.pace.size and simulation.state.pace[world]["vanished"]:
        cause = (
            "a force that jumps or a singularity, such as the centre of an attractor, or a "
            f"Fidelity.tolerance of {simulation.fidelity.tolerance:g} that is below round-off; "
            "raise the tolerance"
        )
        return StepVanished(world, body, name, float(status["time"]), cause, diverged)
    apart = joint_errors(simulation)[world]
    if apart.size and np.nanmax(apart, initial=0.0) > FAILED:
        j = int(np.nanargmax(apart))
        joint = simulation.scene.joints[j]
        cause = (
            f"{joint.name or f'joint {j}'}, a {type(joint).__name__} between {joint.a!r} and "
            f"{joint.b!r}, came apart by {apart[j]:.2g} m or rad: motion too fast for substeps of "
            f"{h:.2g} s, or a light body that carries one far heavier; take a smaller "
            "Fidelity.substep"
        )
    return SimulationDiverged(world, body, name, float(status["time"]), cause, diverged)

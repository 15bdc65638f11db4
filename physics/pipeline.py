"""A substep, stage by stage. This file computes nothing: it names what happens, in order."""

from functools import cache

from physics.features import Features
from physics.jit import stage
from physics.stages.candidates import make_candidates
from physics.stages.contacts import make_contacts
from physics.stages.drives import make_drives
from physics.stages.gravity import gravity
from physics.stages.integrator import make_drift, make_kick
from physics.stages.kinematics import make_kinematics


@cache
def make_forces(features: Features):
    """The forces at the present positions and half-step velocities, as the stages that add them."""
    drives = make_drives(features)
    contacts = make_contacts(features)

    @stage
    def forces(model, state, work, g, h, elapsed):
        gravity(model, work)
        drives(model, work, h)
        contacts(model, state, work, g, h, elapsed)

    return forces


@cache
def make_substep(features: Features):
    """One step of the simulation layer, for the worlds of group g."""
    kick = make_kick(features)
    drift = make_drift(features)
    kinematics = make_kinematics(features)
    candidates = make_candidates(features)
    forces = make_forces(features)

    @stage
    def substep(model, state, work, g, h, elapsed):
        kick(model, work, 0.5 * h)
        drift(model, work, h)
        kinematics(model, work)
        candidates(model, state, work, g)
        forces(model, state, work, g, h, elapsed)
        kick(model, work, 0.5 * h)

    return substep

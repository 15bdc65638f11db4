"""A substep, stage by stage. This file computes nothing: it names what happens, in order."""

from functools import cache

from physics.collision.broadphase import make_candidates
from physics.collision.compound_frames import make_parts
from physics.impulse.solver import make_impulses
from physics.jit import stage
from physics.model.features import Features
from physics.model.lanes import end_look
from physics.motion.drives import make_drives, make_join
from physics.motion.gravity import gravity
from physics.motion.integrator import make_drift, make_kick
from physics.motion.kinematics import make_kinematics
from physics.spring.contacts import make_contacts


@cache
def make_forces(features: Features):
    """The forces at the present positions, as the stages that add them.

    Velocities are those of the last drift, of `drifted` s, and so half of it old.
    """
    drives = make_drives(features)
    join = make_join(features)
    contacts = make_impulses(features) if features.impulse else make_contacts(features)

    @stage
    def forces(model, state, work, g, h, drifted, elapsed):
        gravity(model, work)
        drives(model, work, drifted)
        contacts(model, state, work, g, h, drifted, elapsed)
        join(model, work, drifted)

    return forces


@cache
def make_substep(features: Features):
    """One step of the simulation layer, for the worlds of group g."""
    kick = make_kick(features)
    drift = make_drift(features)
    kinematics = make_kinematics(features)
    parts = make_parts(features)
    candidates = make_candidates(features)
    forces = make_forces(features)
    # A spring's force is there at a look; impulses are those of the half kick that comes first
    glance = 0.5 if features.impulse else 0.0

    @stage
    def substep(model, state, work, g, h, elapsed, opens, look):
        """`opens` a collision step; a `look`: only forces, on states that were set from outside."""
        if not look:
            kick(model, work, 0.5 * h)
            drift(model, work, h)
        kinematics(model, work)
        parts(model, work)
        candidates(model, state, work, g, opens)
        # named once: LLVM would have all of it twice
        span, drifted = (glance * h, 0.0) if look else (h, h)
        forces(model, state, work, g, span, drifted, elapsed)
        if look:
            end_look(model, state, work, g)
        else:
            kick(model, work, 0.5 * h)

    return substep

"""A substep, stage by stage. This file computes nothing: it lists what happens, in order."""

from physics.collision.broadphase import make_broadphase
from physics.collision.compound_frames import make_compound_frames
from physics.compiler.jit import sequence
from physics.constraints.joint_drift import make_joint_drift
from physics.constraints.joint_forces import make_joint_forces
from physics.impulse.solver import make_impulses
from physics.integrators.kick import make_kick
from physics.model.features import EULER, Features, cached_by_features
from physics.model.lanes import end_refresh
from physics.model.state import QUERY
from physics.motion.drives import make_drives, make_finger_coupling
from physics.motion.fields import make_fields, make_present_velocities, make_wrenches
from physics.motion.gravity import gravity
from physics.motion.kinematics import make_kinematics
from physics.motion.servo_work import (
    make_add_servo_work,
    make_keep_servo_forces,
    make_restore_servo_forces,
)
from physics.spring.contacts import make_contacts


@cached_by_features
def make_forces(features: Features):
    """Sequence that computes the forces at the present positions.

    Velocities are those of the last drift, which took `drifted` s, so they lag positions by half of
    it; with semi-implicit Euler they count as those of its end. A substep takes `h` s; impulses act
    for `span` s.
    """
    lag = 0.0 if features.integrator == EULER else 1.0
    present_velocities, fields = make_present_velocities(features), make_fields(features)
    wrenches, drives = make_wrenches(features), make_drives(features)
    keep_servo_forces, couple_fingers = (
        make_keep_servo_forces(features),
        make_finger_coupling(features),
    )
    contacts = make_impulses(features) if features.impulse else make_contacts(features)
    joint_forces, impulse = make_joint_forces(features), features.impulse

    @sequence
    def forces(model, state, workspace, g, h, span, drifted, elapsed):
        present_velocities(model, workspace, lag * drifted)
        gravity(model, workspace)
        fields(model, workspace)
        wrenches(state, workspace)
        drives(model, workspace, drifted)
        keep_servo_forces(model, workspace)
        if impulse:  # its sweeps correct the joints' forces
            joint_forces(model, state, workspace, h, drifted)
        contacts(model, state, workspace, g, span, drifted, elapsed)
        if not impulse:
            joint_forces(model, state, workspace, h, drifted)
        couple_fingers(model, workspace, drifted)

    return forces


@cached_by_features
def make_substep(features: Features):
    """Sequence of one substep for the worlds of lane group g."""
    kick = make_kick(features)
    drift = make_joint_drift(features)
    kinematics = make_kinematics(features)
    compound_frames = make_compound_frames(features)
    broadphase = make_broadphase(features)
    forces = make_forces(features)
    add_first_work = make_add_servo_work(features, False)
    add_last_work = make_add_servo_work(features, True)
    restore_servo_forces = make_restore_servo_forces(features)
    euler = features.integrator == EULER
    # of a kick before the drift; the rest comes after the new forces
    before = 1.0 if euler else 0.5
    # Impulses belong to a time: in a refresh, to that of the kick that comes first. So do the
    # springs of contacts that begin, but the dashpot; a query has the forces at the positions
    impulse, dashpot = features.impulse, features.dashpot

    @sequence
    def substep(model, state, workspace, g, h, elapsed, starts_collision_step, refresh):
        """`refresh`: see `time_layers`; only computes the forces of states set from outside."""
        if not refresh:
            add_first_work(model, workspace, before * h)
            kick(model, workspace, before * h)
            drift(model, workspace, h)
        kinematics(model, workspace)
        compound_frames(model, workspace)
        broadphase(model, state, workspace, g, starts_collision_step)
        # a single call: two calls would be compiled twice
        span, drifted = (before * h, 0.0) if refresh else (h, h)
        if refresh and not impulse and (dashpot or refresh == QUERY):
            span = 0.0
        forces(model, state, workspace, g, h, span, drifted, elapsed)
        if refresh:
            end_refresh(model, state, workspace)
            restore_servo_forces(model, state, workspace)
        elif not euler:
            add_last_work(model, workspace, 0.5 * h)
            kick(model, workspace, 0.5 * h)

    return substep

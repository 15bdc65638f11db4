"""Work of the servos of drives: the energy that they give to a world, summed up kick by kick.

A kick changes the momentum of a drive from P to P + t F in the time t, where F is the sum of the
servo's force S and of all others: contacts, joints, the other finger of a gripper. The kinetic
energy changes by

    ((P + t F)^2 - P^2) / (2 m) = t F . (P + t F/2) / m,

which is the impulse t F times the mean of the speeds before and after. It is linear in F, so each
force has its own part, and that of the servo is

    t S . (P + t F/2) / m.

The parts of all forces add up to the change of kinetic energy, to round-off and at any step. S is
the force after its limits. Fingers of a gripper move as one along x and z: both get the mean F, and
have the same P. The work of S on one is then not what its carriage did, but the sum over both is.

The impulse law resolves an instantaneous collision between the two half kicks of a time, at the
velocities after the first of them, but changes the momenta before it. The collision gains no energy
in its own order, so the work of the half kick that ends a substep is that with the momenta before
the collision, which are kept together with S.

Kicks follow the forces in the order of the substep, so S is kept until the next forces: one half
kick ends a substep, and the next one begins with the other half, which may be in the next call.
"""

from physics.compiler.jit import LANES, at, stage
from physics.model.features import cached_by_features


@cached_by_features
def make_keep_servo_forces(features):
    """Stage that keeps servo forces and momenta, while no other force acts on the drives yet."""
    measures_work = features.measures_work

    @stage
    def keep_servo_forces(model, workspace):
        if measures_work:
            for m in range(model.dynamic.shape[0]):
                if not model.dynamic[m].is_body:
                    solid, servo = workspace.solid[m], workspace.servo[m]
                    for c in range(3):
                        for i in range(LANES):
                            servo.force[c, i] = solid.force[c, i]
                            servo.momentum[c, i] = solid.momentum[c, i]

    return keep_servo_forces


@cached_by_features
def make_add_servo_work(features, ends_substep):
    """Stage that adds the work which the servos will do in the kick that follows.

    `ends_substep`: the kick ends a substep, see above.
    """
    measures_work = features.measures_work

    @stage
    def add_servo_work(model, workspace, time):
        if measures_work:
            for m in range(model.dynamic.shape[0]):
                if not model.dynamic[m].is_body:
                    solid, servo = workspace.solid[m], workspace.servo[m]
                    P = servo.momentum if ends_substep else solid.momentum
                    S, F, work = servo.force, solid.force, servo.work
                    inverse_mass = model.dynamic[m].inverse_mass
                    for c in range(3):
                        for i in range(LANES):
                            mean = at(inverse_mass, i) * (P[c, i] + 0.5 * time * F[c, i])
                            work[i] += time * S[c, i] * mean

    return add_servo_work


@cached_by_features
def make_load_servos(features):
    """Stage that loads servo forces and work of a lane group; zeros in lanes that rest."""
    measures_work = features.measures_work

    @stage
    def load_servos(model, state, workspace):
        if measures_work:
            lane = workspace.lane[0]
            for m in range(model.dynamic.shape[0]):
                servo = workspace.servo[m]
                for i in range(LANES):
                    if lane.active[i]:
                        row = state.servo[lane.world[i], m]
                        servo.work[i] = row.work
                        for c in range(3):
                            servo.force[c, i] = row.force[c]
                    else:
                        servo.work[i] = 0.0
                        for c in range(3):
                            servo.force[c, i] = 0.0

    return load_servos


@cached_by_features
def make_store_servos(features):
    """Stage that stores lane i into its world."""
    measures_work = features.measures_work

    @stage
    def store_servos(model, state, workspace, i):
        if measures_work:
            for m in range(model.dynamic.shape[0]):
                servo, row = workspace.servo[m], state.servo[workspace.lane[0].world[i], m]
                row.work = servo.work[i]
                for c in range(3):
                    row.force[c] = servo.force[c, i]

    return store_servos


@cached_by_features
def make_restore_servo_forces(features):
    """Stage that ends a refresh: lanes that did not need it get their forces back.

    As `lanes.end_refresh` does with the sums of all forces.
    """
    measures_work = features.measures_work

    @stage
    def restore_servo_forces(model, state, workspace):
        if measures_work:
            lane = workspace.lane[0]
            for i in range(LANES):
                if lane.active[i] and lane.needs_refresh[i] == 0:
                    for m in range(model.dynamic.shape[0]):
                        row = state.servo[lane.world[i], m]
                        for c in range(3):
                            workspace.servo[m].force[c, i] = row.force[c]

    return restore_servo_forces

"""Explicit Runge-Kutta steps of (c, P, q, L): trial states, their rates, and the error of a step.

    c' = P/m,   P' = F,   q' = 1/2 omega (x) q,   L' = tau,   omega = R J0^-1 R^T L

with omega in the world frame (the lecture prints the matrix of an omega in the body frame, see
rotation.py). A trial quaternion is normalised before forces see it, and so is the one at the end of
the step. Without a torque L stays bitwise constant.

Forces are evaluated at trial states, several times a step. So they must follow from the state:
contacts and servos remember earlier steps, and World refuses them.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.integrators.tableaus import DORMAND_PRINCE, RUNGE_KUTTA_4, Tableau
from physics.model.features import ADAPTIVE, NO_ROTATION, Features, cached_by_features
from physics.model.workspace import ANGULAR_MOMENTUM, MOMENTUM, ORIENTATION, POSITION, STATE_ROWS
from physics.motion.kinematics import make_angular_velocity


def tableau_of(features: Features) -> Tableau:
    """The method of the integrators "rk4" and "adaptive"."""
    return DORMAND_PRINCE if features.integrator == ADAPTIVE else RUNGE_KUTTA_4


def rows_of(features: Features) -> int:
    """How many rows of a state the method integrates: without rotation, position and momentum."""
    return ORIENTATION if features.rotation == NO_ROTATION else STATE_ROWS


@stage
def place(c, i):
    """Where row c of a state, of its rates or of a sum of them stands in lane i."""
    return c * LANES + i


@stage
def copy_rows(rows, first, values, count):
    """Copies `count` rows of values into the rows from the first on."""
    for c in range(count):
        for i in range(LANES):
            rows[place(first + c, i)] = values[c, i]


@cached_by_features
def make_start(features):
    """Stage that saves the state at which a step begins, and takes it back."""
    rotation = features.rotation

    @stage
    def save_start(model, workspace):
        for m in range(model.dynamic.shape[0]):
            solid, start = workspace.solid[m], workspace.trial[m].start
            c, P, q, L = solid.position, solid.momentum, solid.orientation, solid.angular_momentum
            copy_rows(start, POSITION, c, 3)
            copy_rows(start, MOMENTUM, P, 3)
            if rotation != NO_ROTATION:
                copy_rows(start, ORIENTATION, q, 4)
                copy_rows(start, ANGULAR_MOMENTUM, L, 3)

    @stage
    def return_to_start(model, workspace, i):
        """Takes lane i back to the start of its step, forces included."""
        for m in range(model.dynamic.shape[0]):
            solid, trial = workspace.solid[m], workspace.trial[m]
            start, rate = trial.start, trial.rate[0]
            for axis in range(3):
                solid.position[axis, i] = start[place(POSITION + axis, i)]
                solid.momentum[axis, i] = start[place(MOMENTUM + axis, i)]
                solid.force[axis, i] = rate[place(MOMENTUM + axis, i)]
            if rotation != NO_ROTATION:
                for axis in range(4):
                    solid.orientation[axis, i] = start[place(ORIENTATION + axis, i)]
                for axis in range(3):
                    solid.angular_momentum[axis, i] = start[place(ANGULAR_MOMENTUM + axis, i)]
                    solid.torque[axis, i] = rate[place(ANGULAR_MOMENTUM + axis, i)]

    return save_start, return_to_start


@cached_by_features
def make_save_rates(features):
    """Stage that saves the rates of the present state as those of stage s."""
    rotation, angular_velocity = features.rotation, make_angular_velocity(features)

    @stage
    def save_rates(model, workspace, s):
        for m in range(model.dynamic.shape[0]):
            solid, constants = workspace.solid[m], model.dynamic[m]
            rate, inverse_mass = workspace.trial[m].rate[s], constants.inverse_mass
            P, F, T = solid.momentum, solid.force, solid.torque
            q, L, j = solid.orientation, solid.angular_momentum, constants.inverse_inertia
            for axis in range(3):
                for i in range(LANES):
                    rate[place(POSITION + axis, i)] = at(inverse_mass, i) * P[axis, i]
            copy_rows(rate, MOMENTUM, F, 3)
            if rotation != NO_ROTATION:
                for i in range(LANES):
                    ox, oy, oz = angular_velocity(False, q, j, i, L[0, i], L[1, i], L[2, i])
                    x, y, z, w = q[0, i], q[1, i], q[2, i], q[3, i]
                    rate[place(ORIENTATION, i)] = 0.5 * (w * ox + (oy * z - oz * y))
                    rate[place(ORIENTATION + 1, i)] = 0.5 * (w * oy + (oz * x - ox * z))
                    rate[place(ORIENTATION + 2, i)] = 0.5 * (w * oz + (ox * y - oy * x))
                    rate[place(ORIENTATION + 3, i)] = -0.5 * (ox * x + oy * y + oz * z)
                copy_rows(rate, ANGULAR_MOMENTUM, T, 3)

    return save_rates


@stage
def combine(total, rate, coefficients, first, count, rows):
    """The sum of `count` rates, each times its coefficient."""
    for n in range(rows * LANES):
        total[n] = 0.0
    for s in range(count):
        factor, values = coefficients[first + s], rate[s]
        for n in range(rows * LANES):
            total[n] += factor * values[n]


@stage
def move_rows(values, start, total, first, step):
    """Sets a vector to its start plus the step times the rates."""
    for axis in range(3):
        for i in range(LANES):
            n = place(first + axis, i)
            values[axis, i] = start[n] + step[i] * total[n]


@cached_by_features
def make_set_trial(features):
    """Stage that sets the trial state of stage s; the last one is the end of the step."""
    tableau, rows, rotation = tableau_of(features), rows_of(features), features.rotation
    coefficients, stages = tableau.flat, tableau.stages

    @stage
    def set_trial(model, workspace, s):
        step = workspace.pace[0].step
        for m in range(model.dynamic.shape[0]):
            solid, trial = workspace.solid[m], workspace.trial[m]
            start, total = trial.start, trial.total
            combine(total, trial.rate, coefficients, (s - 1) * stages, s, rows)
            c, P, q, L = solid.position, solid.momentum, solid.orientation, solid.angular_momentum
            move_rows(c, start, total, POSITION, step)
            move_rows(P, start, total, MOMENTUM, step)
            if rotation != NO_ROTATION:
                for i in range(LANES):
                    first = place(ORIENTATION, i)
                    x = start[first] + step[i] * total[first]
                    y = start[first + LANES] + step[i] * total[first + LANES]
                    z = start[first + 2 * LANES] + step[i] * total[first + 2 * LANES]
                    w = start[first + 3 * LANES] + step[i] * total[first + 3 * LANES]
                    scale = 1.0 / math.sqrt(x * x + y * y + z * z + w * w)
                    q[0, i] = x * scale
                    q[1, i] = y * scale
                    q[2, i] = z * scale
                    q[3, i] = w * scale
                move_rows(L, start, total, ANGULAR_MOMENTUM, step)

    return set_trial


@cached_by_features
def make_error(features):
    """Stage that computes the error of a step per second of it, by the pair's other method."""
    tableau, rows = tableau_of(features), rows_of(features)
    coefficients, stages = tableau.error, tableau.stages
    largest = make_largest(features)

    @stage
    def error(model, workspace):
        for m in range(model.dynamic.shape[0]):
            trial = workspace.trial[m]
            combine(trial.total, trial.rate, coefficients, 0, stages, rows)
        largest(model, workspace)

    return error


@cached_by_features
def make_speed(features):
    """Stage that computes how fast the state changes at the start of a step, as an error is."""
    rows, largest = rows_of(features), make_largest(features)

    @stage
    def speed(model, workspace):
        for m in range(model.dynamic.shape[0]):
            total, rate = workspace.trial[m].total, workspace.trial[m].rate[0]
            for n in range(rows * LANES):
                total[n] = rate[n]
        largest(model, workspace)

    return speed


@stage
def square_of(rows, first, i):
    """The square of the vector whose rows are the first and the next two."""
    x, y, z = rows[place(first, i)], rows[place(first + 1, i)], rows[place(first + 2, i)]
    return x * x + y * y + z * z


@cached_by_features
def make_largest(features):
    """Stage that measures a change of the state: the largest of all bodies' four quantities.

    These are the lengths of the vectors of position in m, velocity in m/s, rotation in rad (twice
    the change of a quaternion) and angular velocity in rad/s (J^-1 times the change of L).
    """
    rotation, angular_velocity = features.rotation, make_angular_velocity(features)

    @stage
    def largest(model, workspace):
        found, body = workspace.pace[0].error, workspace.pace[0].body
        for i in range(LANES):
            found[i] = 0.0
            body[i] = 0
        for m in range(model.dynamic.shape[0]):
            constants, total = model.dynamic[m], workspace.trial[m].total
            q, j = workspace.solid[m].orientation, constants.inverse_inertia
            for i in range(LANES):
                moved, pushed = square_of(total, POSITION, i), square_of(total, MOMENTUM, i)
                faster = at(constants.inverse_mass, i) * at(constants.inverse_mass, i) * pushed
                turned, spun = 0.0, 0.0
                if rotation != NO_ROTATION:
                    w = total[place(ORIENTATION + 3, i)]
                    turned = 4.0 * (square_of(total, ORIENTATION, i) + w * w)
                    lx = total[place(ANGULAR_MOMENTUM, i)]
                    ly = total[place(ANGULAR_MOMENTUM + 1, i)]
                    lz = total[place(ANGULAR_MOMENTUM + 2, i)]
                    ox, oy, oz = angular_velocity(False, q, j, i, lx, ly, lz)
                    spun = ox * ox + oy * oy + oz * oz
                value = math.sqrt(max(max(moved, faster), max(turned, spun)))
                finite = moved + faster + turned + spun < math.inf  # false for NaN
                value = value if finite else math.inf
                smaller = value <= found[i]
                body[i] = body[i] if smaller else m
                found[i] = found[i] if smaller else value

    return largest

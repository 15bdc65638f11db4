"""Inverse kinematics of the Panda's arm, as Bullet's `calculateInverseKinematics` does it."""

import math

from physics.compiler.jit import LANES, sequence, stage
from rigid_envs.twins.arms.chain import differentiate, locate
from rigid_envs.twins.arms.linear import factor, solve
from rigid_envs.twins.arms.work import JOINTS

# least squares with this damping in rad^-2, as often, or until the hand is as near in m; a hinge
# turns by at most so many rad at once
DAMPING, ITERATIONS, NEAR, LARGEST = 0.5, 20, 1e-4, math.pi / 4.0
FRESH = 2  # iterations with one Jacobian


@sequence
def solve_for_angles(chain, ahead, work):
    """Writes to `work.aim` the angles at which the hands, pointing down, are near where asked.

    Each iteration adds (J^T J + damping)^-1 J^T e, where e are the errors of position and
    orientation. Errors and J are computed again after `FRESH` iterations, and linear in between.

    Args:
        chain: the arm.
        ahead: s, how far ahead at the present speeds the angles are that it begins with.
        work: angles, speeds, and where the hands are asked to be.
    """
    J, normal, step, error = work.jacobian, work.matrix[0], work.vector[0], work.vector[1]
    going, aim = work.vector[2, 0], work.aim
    for i in range(JOINTS):
        for lane in range(LANES):
            aim[i, lane] = work.angles[i, lane] + ahead * work.speeds[i, lane]
    for lane in range(LANES):
        going[lane] = 1.0
    for iteration in range(ITERATIONS):
        if iteration % FRESH == 0:
            locate(chain, aim, work)
            differentiate(work)
            find_errors(work, error)
            for i in range(JOINTS):
                for j in range(i + 1):
                    for lane in range(LANES):
                        normal[i, j, lane] = DAMPING if i == j else 0.0
                    for k in range(6):
                        for lane in range(LANES):
                            normal[i, j, lane] += J[k, i, lane] * J[k, j, lane]
            factor(normal, JOINTS)
        for i in range(JOINTS):
            for lane in range(LANES):
                step[i, lane] = 0.0
            for k in range(6):
                for lane in range(LANES):
                    step[i, lane] += J[k, i, lane] * error[k, lane]
        solve(normal, step, JOINTS)
        _shorten(step, going)
        for lane in range(LANES):
            x, y, z = error[0, lane], error[1, lane], error[2, lane]
            going[lane] = going[lane] if x * x + y * y + z * z > NEAR * NEAR else 0.0
        for i in range(JOINTS):
            for lane in range(LANES):
                aim[i, lane] += step[i, lane]
            for k in range(6):
                for lane in range(LANES):
                    error[k, lane] -= J[k, i, lane] * step[i, lane]


@stage
def find_errors(work, error):
    """Writes how far [3] m and by which rotation vector [3] rad the hands have yet to move.

    The rotation from a hand's R to one that points down has the matrix diag(1, -1, -1) R^T.
    """
    origin, rotation = work.origin[JOINTS], work.rotation[JOINTS]
    for a in range(3):
        for lane in range(LANES):
            error[a, lane] = work.position[a, lane] + work.asked[a, lane] - origin[a, lane]
    for lane in range(LANES):
        x = rotation[2, 1, lane] - rotation[1, 2, lane]
        y = rotation[2, 0, lane] + rotation[0, 2, lane]
        z = -rotation[0, 1, lane] - rotation[1, 0, lane]
        sine = 0.5 * math.sqrt(x * x + y * y + z * z)
        cosine = 0.5 * (rotation[0, 0, lane] - rotation[1, 1, lane] - rotation[2, 2, lane] - 1.0)
        scale = 0.5 * math.atan2(sine, cosine) / sine if sine > 1e-9 else 0.5
        error[3, lane], error[4, lane], error[5, lane] = scale * x, scale * y, scale * z


@stage
def _shorten(step, going):
    """Scales steps [n, LANES] to at most `LARGEST` rad, and to nothing where it doesn't go on."""
    for lane in range(LANES):
        largest = abs(step[0, lane])
        for i in range(1, JOINTS):
            largest = max(largest, abs(step[i, lane]))
        scale = going[lane] * min(1.0, LARGEST / max(largest, 1e-9))
        for i in range(JOINTS):
            step[i, lane] *= scale

"""Inverse kinematics of the Panda's arm, as Bullet's `calculateInverseKinematics` does it."""

import math

from physics.compiler.jit import LANES, sequence, stage
from rigid_envs.twins.arms.chain import differentiate, locate
from rigid_envs.twins.arms.linear import factor, solve
from rigid_envs.twins.arms.work import JOINTS

# damped least squares, as often, or until the hand is as near in m. Bullet also shortens steps in
# which a hinge turns by more than pi/4: with this damping in rad^2 steps are at most 0.71 times as
# long as the error, so only a hand that is turned by a radian would have such
DAMPING, NEAR = 0.5, 1e-4
# iterations with each Jacobian, together 20: hands get within 0.03 mm (median; at most 0.2) of
# where 20 Jacobians lead them, with six
ITERATIONS = (2, 2, 3, 4, 4, 5)


@sequence
def solve_for_angles(chain, ahead, work):
    """Writes to `work.aim` the angles at which the hands, pointing down, are near where asked.

    Each iteration adds J^T y to the angles, with (J J^T + damping) y = e, where e are the errors of
    position and orientation. Errors and J are computed again after some iterations, and linear in
    between: e - J J^T y = damping y is left.

    Args:
        chain: the arm.
        ahead: s, how far ahead at the present speeds the angles are that it begins with.
        work: angles, speeds, and where the hands are asked to be.
    """
    J, normal, y, steps = work.jacobian, work.matrix[0], work.vector[0], work.vector[1]
    going, aim = work.vector[2, 0], work.aim
    for i in range(JOINTS):
        for lane in range(LANES):
            aim[i, lane] = work.angles[i, lane] + ahead * work.speeds[i, lane]
    for lane in range(LANES):
        going[lane] = 1.0
    for count in ITERATIONS:
        locate(chain, aim, work)
        differentiate(work)
        for a in range(6):
            for b in range(a + 1):
                for lane in range(LANES):
                    total = DAMPING if a == b else 0.0
                    for i in range(JOINTS):
                        total += J[a, i, lane] * J[b, i, lane]
                    normal[a, b, lane] = total
            for lane in range(LANES):
                steps[a, lane] = 0.0
        factor(normal, 6)
        find_errors(work, y)
        for iteration in range(count):
            if iteration > 0:
                for a in range(6):
                    for lane in range(LANES):
                        y[a, lane] *= DAMPING
            for lane in range(LANES):  # a hand that is near takes one more step
                near = y[0, lane] ** 2 + y[1, lane] ** 2 + y[2, lane] ** 2 <= NEAR**2
                work.vector[2, 1, lane] = 0.0 if near else going[lane]
            solve(normal, y, 6)
            for a in range(6):
                for lane in range(LANES):
                    steps[a, lane] += going[lane] * y[a, lane]
            for lane in range(LANES):
                going[lane] = work.vector[2, 1, lane]
        for i in range(JOINTS):
            for lane in range(LANES):
                for a in range(6):
                    aim[i, lane] += J[a, i, lane] * steps[a, lane]


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
        # angle / sine / 2, by the series of a quarter angle's tangent: within 1e-9 up to 1 rad
        cosine = 0.5 * (rotation[0, 0, lane] - rotation[1, 1, lane] - rotation[2, 2, lane] - 1.0)
        half = math.sqrt(x * x + y * y + z * z) / (2.0 + 2.0 * max(cosine, -0.99))
        t = half / (1.0 + math.sqrt(1.0 + half * half))
        s = t * t
        angle = 1.0 - s * (1.0 / 3.0 - s * (1.0 / 5.0 - s * (1.0 / 7.0 - s / 9.0)))
        scale = angle * (1.0 + half * half) / (1.0 + math.sqrt(1.0 + half * half))
        error[3, lane], error[4, lane], error[5, lane] = scale * x, scale * y, scale * z

"""The weld that pulls the Fetch hand towards a mocap body.

It is soft: a constraint of MuJoCo, whose force F follows from the acceleration that it wants,

    (J M^-1 J^T + R) F = a_wanted - J a_free,

with a_wanted that of a damped spring, and R from the impedance d of the constraint and an inverse
weight w, R = w (1 - d) / d. Hinges have heavy dampers, whose forces are those at a substep's end,
and rotors. Source of the laws: MuJoCo's documentation, chapters Computation and Modeling (solver
parameters); of the figures: fetch/robot.xml and shared.xml of Gymnasium-Robotics 1.4.2.
"""

import math

import numpy as np

from physics.compiler.jit import LANES, sequence, stage
from rigid_envs.twins.arms.chain import locate
from rigid_envs.twins.arms.dynamics import answer
from rigid_envs.twins.arms.linear import factor, solve
from rigid_envs.twins.arms.work import JOINTS

SUBSTEPS, SUBSTEP = 20, 0.002  # in a step; s
PIECES = 2  # of a step, for each of which the mass matrix is computed
LOCATED = 5  # substeps after which the hand is located

ROTOR = np.array([1.0, 1.0, 1.0, 1.0, 2.7538, 1.0, 1.0])  # kg m^2
FRICTION = np.array([50.0, 50.0, 50.0, 50.0, 3.5247, 50.0, 50.0])  # N m s, of the dampers
FOREARM, FOREARM_SPRING = 4, 10.0  # the hinge that a spring turns back; N m

# of the weld: time constant in s, impedance where the constraint holds and where it is violated by
# more than a width in m or half rad, and inverse weight of the hand in 1/kg and 1/(kg m^2)
TIME, IMPEDANCE, VIOLATED, WIDTH = 0.02, 0.9, 0.95, 0.001
WEIGHT = np.array([0.04588, 0.04588, 0.04588, 0.75854, 0.75854, 0.75854])
SPRING, DAMPER = 1.0 / (VIOLATED * TIME) ** 2, 2.0 / (VIOLATED * TIME)

# the weld holds the hand's frame, whose x axis points down; the observed grip site is ahead of it
AHEAD = 0.02  # m
RISE = 0.00306  # m/s


@sequence
def prepare(work):
    """Factors the mass matrices, and writes how the weld's point answers forces on it."""
    weld, along, compliance = work.matrix[1], work.matrix[2], work.matrix[3]
    for kind in range(2):  # without dampers, and with them
        factored = work.factored[kind]
        for i in range(JOINTS):
            more = ROTOR[i] + (SUBSTEP * FRICTION[i] if kind == 1 else 0.0)
            for j in range(i + 1):
                for lane in range(LANES):
                    factored[i, j, lane] = work.mass_matrix[i, j, lane] + (more if i == j else 0.0)
        factor(factored, JOINTS)
    J, rotation = work.jacobian, work.rotation[JOINTS]
    for i in range(JOINTS):  # the velocity of the weld's point, and half the angular velocity
        for lane in range(LANES):
            dx = AHEAD * rotation[0, 0, lane]
            dy = AHEAD * rotation[1, 0, lane]
            dz = AHEAD * rotation[2, 0, lane]
            wx, wy, wz = J[3, i, lane], J[4, i, lane], J[5, i, lane]
            weld[0, i, lane] = J[0, i, lane] + dy * wz - dz * wy
            weld[1, i, lane] = J[1, i, lane] + dz * wx - dx * wz
            weld[2, i, lane] = J[2, i, lane] + dx * wy - dy * wx
            weld[3, i, lane], weld[4, i, lane], weld[5, i, lane] = 0.5 * wx, 0.5 * wy, 0.5 * wz
    answer(weld, 6, work.factored[0], along, compliance)


@stage
def aim(work):
    """Writes where the mocap body goes: `work.target` and, as a matrix, `work.matrix[4]`.

    It is put where asked. Its quaternion is the mean of the hand's and that of a hand which points
    down.
    """
    rotation, turn = work.rotation[JOINTS], work.matrix[4]
    for a in range(3):
        for lane in range(LANES):
            work.target[a, lane] = (
                work.position[a, lane] + work.asked[a, lane] - AHEAD * rotation[a, 0, lane]
            )
    for lane in range(LANES):
        trace = rotation[0, 0, lane] + rotation[1, 1, lane] + rotation[2, 2, lane]
        w = 0.5 * math.sqrt(1.0 + trace)
        x = (rotation[2, 1, lane] - rotation[1, 2, lane]) / (4.0 * w)
        y = (rotation[0, 2, lane] - rotation[2, 0, lane]) / (4.0 * w) + 1.0
        z = (rotation[1, 0, lane] - rotation[0, 1, lane]) / (4.0 * w)
        w += 1.0
        s = 2.0 / (w * w + x * x + y * y + z * z)
        turn[0, 0, lane], turn[0, 1, lane] = 1.0 - s * (y * y + z * z), s * (x * y - w * z)
        turn[0, 2, lane], turn[1, 0, lane] = s * (x * z + w * y), s * (x * y + w * z)
        turn[1, 1, lane], turn[1, 2, lane] = 1.0 - s * (x * x + z * z), s * (y * z - w * x)
        turn[2, 0, lane], turn[2, 1, lane] = s * (x * z - w * y), s * (y * z + w * x)
        turn[2, 2, lane] = 1.0 - s * (x * x + y * y)


@sequence
def pull(chain, work):
    """The weld pulls the hand for a piece of a step.

    Between substeps that locate the hand, errors follow from the Jacobian in the piece's middle.
    """
    weld, along, compliance = work.matrix[1], work.matrix[2], work.matrix[3]
    damped = work.factored[1]
    error, force, torque, rate = work.vector[0], work.vector[1], work.vector[2], work.vector[3]
    angles, speeds, impedance, system = work.angles, work.speeds, work.vector[4, 0], work.matrix[0]
    for substep in range(SUBSTEPS // PIECES):
        for lane in range(LANES):
            work.target[2, lane] -= SUBSTEP * RISE  # as seen from the torso
        for a in range(6):
            for lane in range(LANES):
                total = RISE if a == 2 else 0.0
                for i in range(JOINTS):
                    total += weld[a, i, lane] * speeds[i, lane]
                rate[a, lane] = total
                error[a, lane] += SUBSTEP * total
        if substep % LOCATED == 0:
            locate(chain, angles, work)
            find_errors(work, error)
        for i in range(JOINTS):
            spring = FOREARM_SPRING if i == FOREARM else 0.0
            for lane in range(LANES):
                torque[i, lane] = (
                    -work.bias[i, lane] - FRICTION[i] * speeds[i, lane] - spring * angles[i, lane]
                )
        for lane in range(LANES):
            square = 0.0
            for a in range(6):
                square += error[a, lane] * error[a, lane]
            x = min(math.sqrt(square) / WIDTH, 1.0)
            part = 2.0 * x * x if x < 0.5 else 1.0 - 2.0 * (1.0 - x) * (1.0 - x)
            impedance[lane] = IMPEDANCE + (VIOLATED - IMPEDANCE) * part
        for a in range(6):
            for lane in range(LANES):
                force[a, lane] = -SPRING * impedance[lane] * error[a, lane] - DAMPER * rate[a, lane]
                system[a, a, lane] = (
                    compliance[a, a, lane] + (1.0 / impedance[lane] - 1.0) * WEIGHT[a]
                )
                for i in range(JOINTS):
                    force[a, lane] -= along[a, i, lane] * torque[i, lane]
            for b in range(a):
                for lane in range(LANES):
                    system[a, b, lane] = compliance[a, b, lane]
        factor(system, 6)
        solve(system, force, 6)
        for i in range(JOINTS):
            for lane in range(LANES):
                for a in range(6):
                    torque[i, lane] += weld[a, i, lane] * force[a, lane]
        solve(damped, torque, JOINTS)
        for i in range(JOINTS):
            for lane in range(LANES):
                speeds[i, lane] += SUBSTEP * torque[i, lane]
            for lane in range(LANES):
                angles[i, lane] += SUBSTEP * speeds[i, lane]


@stage
def find_errors(work, error):
    """Writes how far [3] m hands are from their mocap bodies, and turned: vectors of quaternions.

    With D = R T^T, of the hand's and the body's rotations, the vector is half that of D - D^T over
    the root of 1 + tr D.
    """
    origin, rotation, turn = work.origin[JOINTS], work.rotation[JOINTS], work.matrix[4]
    for a in range(3):
        for lane in range(LANES):
            weld = origin[a, lane] - AHEAD * rotation[a, 0, lane]
            error[a, lane] = weld - work.target[a, lane]
    for lane in range(LANES):
        xx, xy, xz, yx, yy, yz, zx, zy, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            x, y, z = rotation[0, k, lane], rotation[1, k, lane], rotation[2, k, lane]
            tx, ty, tz = turn[0, k, lane], turn[1, k, lane], turn[2, k, lane]
            xx, yy, zz = xx + x * tx, yy + y * ty, zz + z * tz
            xy, xz, yx = xy + x * ty, xz + x * tz, yx + y * tx
            yz, zx, zy = yz + y * tz, zx + z * tx, zy + z * ty
        scale = 0.5 / math.sqrt(1.0 + xx + yy + zz)
        error[3, lane] = scale * (zy - yz)
        error[4, lane] = scale * (xz - zx)
        error[5, lane] = scale * (yx - xy)

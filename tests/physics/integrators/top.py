"""A torque-free top, its exact spin and orientation, and worlds whose integrator is tested.

All of these worlds have a field, if only a drag of zero, and can have wrenches; those of the
adaptive pair can differ in parameters. So there is one kernel per integrator.
"""

import math
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipkinc

from physics import Body, Box, Drag, Fidelity, Scene, World
from physics.rotation import quaternion_rate, rotate, rotate_back

# moments of inertia 1, 2 and 3 kg m^2 but for a millionth, which a plate without thickness has
TOP = Body(Box((math.sqrt(2.0), 1.0, 1e-3)), mass=3.0, angular_velocity=(1.0, 2.0, 2.0))
MOMENTS = TOP.shape.inertia(TOP.mass)
SPIN = np.array(TOP.angular_velocity)


def world_of(body, integrator, substep, field=None, count=1, tolerance=None, threads=1):
    """One body without gravity; `tolerance` is for "adaptive" alone."""
    scene = Scene([body], gravity=(0.0, 0.0, 0.0), fields=[Drag() if field is None else field])
    adaptive = integrator == "adaptive"
    fidelity = Fidelity(
        substep=substep, integrator=integrator, tolerance=tolerance if adaptive else None
    )
    world = World(scene, fidelity, count, threads, per_world_parameters=adaptive)
    world.apply_wrench()
    return world


def jacobi_spin(moments, spin, times):
    """Body-frame spin [n, 3] of a torque-free body with rising moments, `spin` at time 0.

    Landau and Lifshitz, Mechanics, section 37, for L^2 > 2 E J_y: the spin circles the z axis. All
    components of `spin` must be at least zero.
    """
    a, b, c = moments
    energy = np.sum(moments * spin**2)  # twice the kinetic energy
    square = np.sum((moments * spin) ** 2)
    assert square > energy * b
    rate = np.sqrt((c - b) * (square - energy * a) / (a * b * c))
    parameter = (b - a) * (energy * c - square) / ((c - b) * (square - energy * a))
    most = np.sqrt(
        np.array([energy * c - square, energy * c - square, square - energy * a])
        / (moments * np.array([c - a, c - b, c - a]))
    )
    start = ellipkinc(np.arcsin(spin[1] / most[1]), parameter)
    sn, cn, dn, _ = ellipj(start + times * rate, parameter)
    return np.stack([most[0] * cn, most[1] * sn, most[2] * dn], axis=-1)


def exact_orientation(moments, spin, time):
    """Quaternion of a torque-free body after `time` s, from the identity."""
    return _exact_orientation(tuple(moments), tuple(spin), time)


@cache
def _exact_orientation(moments, spin, time):
    moments = np.array(moments)
    L = moments * np.array(spin)

    def rate(_, q):
        q = q / np.linalg.norm(q)
        return quaternion_rate(q, rotate(q, rotate_back(q, L) / moments))

    return solve_ivp(rate, (0.0, time), (0, 0, 0, 1), "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


def spin_in_body(world):
    return rotate_back(world.orientation, world.angular_velocity)[0, 0]


def angle_between(p, q):
    """Angle in rad of the rotation between two quaternions."""
    return 2.0 * min(np.linalg.norm(p - q), np.linalg.norm(p + q))

"""Impulses at contact points: effective masses, relative velocities, effects of an impulse."""

import math
from typing import Any, NamedTuple

from physics.compiler.jit import LANES, at, stage
from physics.motion.vectors import cross, tensor_times


class Operands(NamedTuple):
    """What impulses of a half-pair act on.

    Attributes:
        points: rows of Workspace.contact_row, one per slot.
        owner: [1] row of Workspace.solid. (Numba can't return a row by itself.)
        surface: likewise.
        A: the owner's inverse inertia tensor in the world frame, 1/(kg m^2).
        B: the surface's.
        ma: the owner's inverse mass, 1/kg.
        mb: the surface's.
    """

    points: Any
    owner: Any
    surface: Any
    A: Any
    B: Any
    ma: Any
    mb: Any


@stage
def operands_of(model, workspace, k):
    """The operands of half-pair k."""
    half_pair, live = model.half_pair[k], workspace.half_pair[k]
    o, s, first, slots = half_pair.owner, half_pair.surface, live.first_row, live.slots
    return Operands(
        workspace.contact_row[first : first + slots],
        workspace.solid[o : o + 1],
        workspace.solid[s : s + 1],
        workspace.tensor[o].component,
        workspace.tensor[s].component,
        half_pair.owner_inverse_mass,
        half_pair.surface_inverse_mass,
    )


@stage
def world_tensor(R, i, jx, jy, jz):
    """R J0^-1 R^T in lane i as xx yy zz xy xz yz, of inverse principal moments."""
    ax, ay, az = jx * R[0, i], jy * R[1, i], jz * R[2, i]
    bx, by, bz = jx * R[3, i], jy * R[4, i], jz * R[5, i]
    return (
        ax * R[0, i] + ay * R[1, i] + az * R[2, i],
        bx * R[3, i] + by * R[4, i] + bz * R[5, i],
        jx * R[6, i] * R[6, i] + jy * R[7, i] * R[7, i] + jz * R[8, i] * R[8, i],
        ax * R[3, i] + ay * R[4, i] + az * R[5, i],
        ax * R[6, i] + ay * R[7, i] + az * R[8, i],
        bx * R[6, i] + by * R[7, i] + bz * R[8, i],
    )


@stage
def rotate_inertia(model, workspace):
    """Writes the inverse inertia of all bodies in the world frame; that of other solids stays 0."""
    for m in range(model.dynamic.shape[0]):
        if model.dynamic[m].is_body:
            R, inverse = workspace.solid[m].rotation, workspace.tensor[m].component
            j = model.dynamic[m].inverse_inertia
            for i in range(LANES):
                xx, yy, zz, xy, xz, yz = world_tensor(R, i, at(j[0], i), at(j[1], i), at(j[2], i))
                inverse[0, i] = xx
                inverse[1, i] = yy
                inverse[2, i] = zz
                inverse[3, i] = xy
                inverse[4, i] = xz
                inverse[5, i] = yz


@stage
def mobility(inverse, i, ax, ay, az, ux, uy, uz, vx, vy, vz):
    """1/kg: velocity along v, at arm a, that a unit impulse along u there causes by rotation."""
    px, py, pz = cross(ax, ay, az, ux, uy, uz)
    qx, qy, qz = cross(ax, ay, az, vx, vy, vz)
    tx, ty, tz = tensor_times(inverse, i, px, py, pz)
    return qx * tx + qy * ty + qz * tz


@stage
def effective_masses(point, i, A, B, inverse_mass):
    """Writes the effective masses of a point; A and B are the solids' inverse inertia tensors."""
    nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
    ax, ay, az = point.arm[0, i], point.arm[1, i], point.arm[2, i]
    bx, by, bz = point.surface_arm[0, i], point.surface_arm[1, i], point.surface_arm[2, i]
    # two axes across the normal, without a branch (Duff et al. 2017)
    sign = math.copysign(1.0, nz)
    p = -1.0 / (sign + nz)
    q = nx * ny * p
    sx, sy, sz = 1.0 + sign * nx * nx * p, sign * q, -sign * nx
    tx, ty, tz = q, sign + ny * ny * p, -ny
    along = inverse_mass
    along += mobility(A, i, ax, ay, az, nx, ny, nz, nx, ny, nz)
    along += mobility(B, i, bx, by, bz, nx, ny, nz, nx, ny, nz)
    ss = inverse_mass
    ss += mobility(A, i, ax, ay, az, sx, sy, sz, sx, sy, sz)
    ss += mobility(B, i, bx, by, bz, sx, sy, sz, sx, sy, sz)
    tt = inverse_mass
    tt += mobility(A, i, ax, ay, az, tx, ty, tz, tx, ty, tz)
    tt += mobility(B, i, bx, by, bz, tx, ty, tz, tx, ty, tz)
    st = mobility(A, i, ax, ay, az, sx, sy, sz, tx, ty, tz)
    st += mobility(B, i, bx, by, bz, sx, sy, sz, tx, ty, tz)
    point.mass[i] = 1.0 / along
    half = 0.5 * (ss - tt)
    point.shear_mass[i] = 1.0 / (0.5 * (ss + tt) + math.sqrt(half * half + st * st))


@stage
def apply_impulse(pair, point, i, px, py, pz):
    """Applies the impulse p in N s to the owner at a point, and -p to the surface."""
    owner, surface = pair.owner[0], pair.surface[0]
    A, B, ma, mb = pair.A, pair.B, pair.ma, pair.mb
    v, u = owner.velocity, surface.velocity
    omega, spin = owner.angular_velocity, surface.angular_velocity
    v[0, i] += at(ma, i) * px
    v[1, i] += at(ma, i) * py
    v[2, i] += at(ma, i) * pz
    u[0, i] -= at(mb, i) * px
    u[1, i] -= at(mb, i) * py
    u[2, i] -= at(mb, i) * pz
    tx, ty, tz = cross(point.arm[0, i], point.arm[1, i], point.arm[2, i], px, py, pz)
    sx, sy, sz = tensor_times(A, i, tx, ty, tz)
    omega[0, i] += sx
    omega[1, i] += sy
    omega[2, i] += sz
    bx, by, bz = point.surface_arm[0, i], point.surface_arm[1, i], point.surface_arm[2, i]
    tx, ty, tz = cross(bx, by, bz, px, py, pz)
    sx, sy, sz = tensor_times(B, i, tx, ty, tz)
    spin[0, i] -= sx
    spin[1, i] -= sy
    spin[2, i] -= sz


@stage
def add_opposite(point, i, P, L, Q, M, x, y, z):
    """Adds a vector at a point and its moment to P and L of the owner; subtracts both from Q and M.

    The vector is an impulse in N s (P, Q: momenta) or a force in N (P, Q: forces).
    """
    P[0, i] += x
    P[1, i] += y
    P[2, i] += z
    Q[0, i] -= x
    Q[1, i] -= y
    Q[2, i] -= z
    tx, ty, tz = cross(point.arm[0, i], point.arm[1, i], point.arm[2, i], x, y, z)
    L[0, i] += tx
    L[1, i] += ty
    L[2, i] += tz
    bx, by, bz = point.surface_arm[0, i], point.surface_arm[1, i], point.surface_arm[2, i]
    tx, ty, tz = cross(bx, by, bz, x, y, z)
    M[0, i] -= tx
    M[1, i] -= ty
    M[2, i] -= tz


@stage
def relative_velocity(owner, surface, point, i):
    """Velocity in m/s of the owner at a point relative to the surface."""
    v, u = owner.velocity, surface.velocity
    omega, spin = owner.angular_velocity, surface.angular_velocity
    ax, ay, az = point.arm[0, i], point.arm[1, i], point.arm[2, i]
    bx, by, bz = point.surface_arm[0, i], point.surface_arm[1, i], point.surface_arm[2, i]
    ox, oy, oz = cross(omega[0, i], omega[1, i], omega[2, i], ax, ay, az)
    wx, wy, wz = cross(spin[0, i], spin[1, i], spin[2, i], bx, by, bz)
    return v[0, i] + ox - u[0, i] - wx, v[1, i] + oy - u[1, i] - wy, v[2, i] + oz - u[2, i] - wz


@stage
def apply_angular_impulse(pair, i, tx, ty, tz):
    """Applies the angular impulse t in N m s to the owner, and -t to the surface."""
    owner, surface, A, B = pair.owner[0], pair.surface[0], pair.A, pair.B
    sx, sy, sz = tensor_times(A, i, tx, ty, tz)
    owner.angular_velocity[0, i] += sx
    owner.angular_velocity[1, i] += sy
    owner.angular_velocity[2, i] += sz
    sx, sy, sz = tensor_times(B, i, tx, ty, tz)
    surface.angular_velocity[0, i] -= sx
    surface.angular_velocity[1, i] -= sy
    surface.angular_velocity[2, i] -= sz

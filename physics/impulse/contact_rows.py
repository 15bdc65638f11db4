"""Contact points of the impulse law: arms, normals and masses in the world frame.

All sides' points stand side by side while impulses go round, so that a push at one is felt by the
next. Unlike the spring law, which needs a point once, they are worked out before the sweeps.
"""

import math
from functools import cache

from physics.collision.compound_frames import hide
from physics.collision.contact_point import HIDDEN, make_touch
from physics.collision.relative_frame import relative_pose
from physics.jit import LANES, at, kernel, stage
from physics.motion.vectors import cross, times, turned
from physics.scene.shapes import BOX, CAPSULE, PARTICLES, PLANE, SPHERE


@stage
def place_tensors(model, work):
    """Brings the inverse inertia of what turns into the world frame; the others' stays zero."""
    for m in range(model.mover.shape[0]):
        if model.mover[m].turns:
            R, entry, j = (
                work.solid[m].rotation,
                work.tensor[m].entry,
                model.mover[m].inverse_inertia,
            )
            for i in range(LANES):
                jx, jy, jz = at(j[0], i), at(j[1], i), at(j[2], i)
                ax, ay, az = jx * R[0, i], jy * R[1, i], jz * R[2, i]
                bx, by, bz = jx * R[3, i], jy * R[4, i], jz * R[5, i]
                entry[0, i] = ax * R[0, i] + ay * R[1, i] + az * R[2, i]
                entry[1, i] = bx * R[3, i] + by * R[4, i] + bz * R[5, i]
                entry[2, i] = (
                    jx * R[6, i] * R[6, i] + jy * R[7, i] * R[7, i] + jz * R[8, i] * R[8, i]
                )
                entry[3, i] = ax * R[3, i] + ay * R[4, i] + az * R[5, i]
                entry[4, i] = ax * R[6, i] + ay * R[7, i] + az * R[8, i]
                entry[5, i] = bx * R[6, i] + by * R[7, i] + bz * R[8, i]


@stage
def mobility(entry, i, ax, ay, az, ux, uy, uz, vx, vy, vz):
    """1/kg: what an impulse along u at arm a turns, seen along v."""
    px, py, pz = cross(ax, ay, az, ux, uy, uz)
    qx, qy, qz = cross(ax, ay, az, vx, vy, vz)
    tx, ty, tz = times(entry, i, px, py, pz)
    return qx * tx + qy * ty + qz * tz


@stage
def place_masses(point, i, A, B, inverse_mass):
    """Writes the masses that impulses at a point feel; A and B are the solids' tensors."""
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
def give(owner, surface, A, B, ma, mb, point, i, px, py, pz):
    """Gives the owner the impulse p [N s] at a point, and the surface -p.

    A and B are their tensors, ma and mb their inverse masses, 1/kg.
    """
    v, u, omega, spin = owner.velocity, surface.velocity, owner.spin, surface.spin
    v[0, i] += at(ma, i) * px
    v[1, i] += at(ma, i) * py
    v[2, i] += at(ma, i) * pz
    u[0, i] -= at(mb, i) * px
    u[1, i] -= at(mb, i) * py
    u[2, i] -= at(mb, i) * pz
    tx, ty, tz = cross(point.arm[0, i], point.arm[1, i], point.arm[2, i], px, py, pz)
    sx, sy, sz = times(A, i, tx, ty, tz)
    omega[0, i] += sx
    omega[1, i] += sy
    omega[2, i] += sz
    bx, by, bz = point.surface_arm[0, i], point.surface_arm[1, i], point.surface_arm[2, i]
    tx, ty, tz = cross(bx, by, bz, px, py, pz)
    sx, sy, sz = times(B, i, tx, ty, tz)
    spin[0, i] -= sx
    spin[1, i] -= sy
    spin[2, i] -= sz


@stage
def slip(owner, surface, point, i):
    """Velocity [m/s] of the owner at a point as seen from the surface."""
    v, u, omega, spin = owner.velocity, surface.velocity, owner.spin, surface.spin
    ax, ay, az = point.arm[0, i], point.arm[1, i], point.arm[2, i]
    bx, by, bz = point.surface_arm[0, i], point.surface_arm[1, i], point.surface_arm[2, i]
    ox, oy, oz = cross(omega[0, i], omega[1, i], omega[2, i], ax, ay, az)
    wx, wy, wz = cross(spin[0, i], spin[1, i], spin[2, i], bx, by, bz)
    return v[0, i] + ox - u[0, i] - wx, v[1, i] + oy - u[1, i] - wy, v[2, i] + oz - u[2, i] - wz


@stage
def turn(owner, surface, A, B, i, tx, ty, tz):
    """Gives the owner the angular impulse t [N m s], and the surface -t."""
    sx, sy, sz = times(A, i, tx, ty, tz)
    owner.spin[0, i] += sx
    owner.spin[1, i] += sy
    owner.spin[2, i] += sz
    sx, sy, sz = times(B, i, tx, ty, tz)
    surface.spin[0, i] -= sx
    surface.spin[1, i] -= sy
    surface.spin[2, i] -= sz


@stage
def ends(model, work, k):
    """What impulses at a side's points need: the points, its solids' tensors and inverse masses."""
    side, slots = model.side[k], work.side[k].slots
    o, s, first = side.owner, side.surface, side.first_slot
    return (
        work.point[first : first + slots],
        work.tensor[o].entry,
        work.tensor[s].entry,
        side.owner_inverse_mass,
        side.surface_inverse_mass,
    )


@cache
def make_place(features, kind):
    """Kernel that writes the points of a side against one kind of surface."""
    friction, resistance = features.friction, features.resistance
    box, compound = kind == BOX, features.compound
    touch = make_touch(kind, compound)

    @kernel
    def place(slots, candidate, seen, owner, surface, frame, A, B, constants, keeps, h, points):
        """`h` is the time in s in which last step's impulses were given and this one's will be.

        `frame` is that of the surface's geometry; what a contact remembers is seen from its solid.
        """
        R, c = seen.rotation, seen.position
        G = frame.rotation if compound else surface.rotation
        Q, a, b = surface.rotation, owner.position, surface.position
        radii, owner_radii, core = constants.radius, constants.owner_radius, constants.core
        sharp, pair_mass = constants.sharp != 0, constants.pair_mass
        for n in range(slots):
            row, point = candidate[n], points[n]
            for i in range(LANES):
                radius, owner_radius = at(radii, i), at(owner_radii, i)
                ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                x, y, z, nx, ny, nz, overlap, face = touch(
                    row, i, R, c, ca, cb, cc, radius, owner_radius, sharp
                )
                weight = row.weight[i]
                if box and compound:
                    weight = 0.0 if face == HIDDEN else weight
                ax, ay, az = turned(G, i, x, y, z)
                nx, ny, nz = turned(G, i, nx, ny, nz)
                bx, by, bz = (
                    ax + (a[0, i] - b[0, i]),
                    ay + (a[1, i] - b[1, i]),
                    az + (a[2, i] - b[2, i]),
                )
                if box:
                    face = face if weight > 0.0 else 0.0
                    row.face[i] = face if keeps[i] != 0 else row.face[i]
                point.normal[0, i] = nx
                point.normal[1, i] = ny
                point.normal[2, i] = nz
                point.arm[0, i] = ax
                point.arm[1, i] = ay
                point.arm[2, i] = az
                point.surface_arm[0, i] = bx
                point.surface_arm[1, i] = by
                point.surface_arm[2, i] = bz
                point.gap[i] = -overlap
                point.weight[i] = weight
                push = h * row.load[i]
                point.push[i] = push
                point.hit[i] = 0.0
                gx, gy, gz = push * nx, push * ny, push * nz
                if friction:
                    px, py, pz = turned(Q, i, row.pull[0, i], row.pull[1, i], row.pull[2, i])
                    # what turned with the surface may have left the tangent plane
                    along = px * nx + py * ny + pz * nz
                    px, py, pz = h * (px - along * nx), h * (py - along * ny), h * (pz - along * nz)
                    point.pull[0, i] = px
                    point.pull[1, i] = py
                    point.pull[2, i] = pz
                    gx, gy, gz = gx + px, gy + py, gz + pz
                    ux, uy, uz = slip(owner, surface, point, i)
                    sx, sy, sz = turned(Q, i, row.shear[0, i], row.shear[1, i], row.shear[2, i])
                    sx += h * ux
                    sy += h * uy
                    sz += h * uz
                    along = sx * nx + sy * ny + sz * nz
                    held = push > 0.0
                    point.anchor[0, i] = sx - along * nx if held else 0.0
                    point.anchor[1, i] = sy - along * ny if held else 0.0
                    point.anchor[2, i] = sz - along * nz if held else 0.0
                if resistance:
                    px, py, pz = turned(Q, i, row.twist[0, i], row.twist[1, i], row.twist[2, i])
                    point.twist[0, i] = h * px
                    point.twist[1, i] = h * py
                    point.twist[2, i] = h * pz
                    point.turned[0, i] = -h * px
                    point.turned[1, i] = -h * py
                    point.turned[2, i] = -h * pz
                # this step gives what it ends with, less what the last one did
                point.spent[0, i] = -gx
                point.spent[1, i] = -gy
                point.spent[2, i] = -gz
            for i in range(LANES):
                place_masses(point, i, A, B, 1.0 / at(pair_mass, i))

    return place


@cache
def make_points(features):
    """Stage that writes the contact points of a side."""
    plane, sphere, box = features.plane, features.sphere, features.box
    capsule, particles = features.capsule, features.particles
    place_plane, place_sphere = make_place(features, PLANE), make_place(features, SPHERE)
    place_box, place_capsule = make_place(features, BOX), make_place(features, CAPSULE)
    place_particles = make_place(features, PARTICLES)
    compound = features.compound

    @stage
    def points(model, state, work, g, k, keeps, h):
        constants, slots = model.side[k], work.side[k].slots
        owner, surface = work.solid[constants.owner], work.solid[constants.surface]
        frame = work.solid[constants.frame] if compound else surface
        A, B = work.tensor[constants.owner].entry, work.tensor[constants.surface].entry
        first, kind = constants.first_slot, constants.kind
        candidate = state.candidate[g, first : first + slots]
        out = work.point[first : first + slots]
        seen = owner if kind == PLANE else work.relative[0]
        if kind != PLANE:
            relative_pose(owner, frame, seen)
        if plane and kind == PLANE:
            place_plane(
                slots, candidate, seen, owner, surface, frame, A, B, constants, keeps, h, out
            )
        if sphere and kind == SPHERE:
            place_sphere(
                slots, candidate, seen, owner, surface, frame, A, B, constants, keeps, h, out
            )
        if compound and box and kind == BOX:
            hide(model, k, candidate, seen)
        if box and kind == BOX:
            place_box(slots, candidate, seen, owner, surface, frame, A, B, constants, keeps, h, out)
        if capsule and kind == CAPSULE:
            place_capsule(
                slots, candidate, seen, owner, surface, frame, A, B, constants, keeps, h, out
            )
        if particles and kind == PARTICLES:
            place_particles(
                slots, candidate, seen, owner, surface, frame, A, B, constants, keeps, h, out
            )

    return points

"""Forces between particles of two bodies: filter, pack, compute, unpack.

The neighbours that touch are a minority, and which of them do is not predictable. So a filter
without a branch collects their indices. Blocks of BLOCK of them are packed into rows, on which the
laws run in vector instructions, and the results are added body by body. All rows are in one array
with constant offsets: with several, LLVM would have to check that they don't overlap.
"""

import numpy as np

from physics.collision.distances import sphere_distance
from physics.compiler.jit import stage
from physics.granular.coefficients import contact_coefficients, shear_loads
from physics.granular.tables import (
    CENTER,
    CLASS,
    INVERSE_MASS,
    MOTION,
    PARITY,
    SHEAR_LOAD,
    SPIN,
    TURN,
    VELOCITY,
    WEIGHT,
)
from physics.model.features import cached_by_features
from physics.model.tangential import grip_of
from physics.motion.vectors import cross
from physics.rotation import rotation_entries
from physics.spring.coulomb import friction_force, viscous_force
from physics.spring.hunt_crossley import dashpot_force

# contacts in a block: its rows stay in the first-level cache
BLOCK = 128
# rows of a block, in units of BLOCK. In: distance of the particles, their arms from the centres of
# their bodies, the bodies' relative velocity, their spins, the spring and the surface's quaternion
_BETWEEN, _ARM, _OTHER_ARM, _RELATIVE, _SPIN, _OTHER_SPIN, _SHEAR, _TURN = range(0, 22, 3)
# of bodies that differ: radii, inverse masses, weight, coefficients (in the order of CONTACT)
_RADIUS, _OTHER_RADIUS, _INVERSE, _OTHER_INVERSE, _WEIGHT, _CONTACT = range(25, 31)
# out: force and torque on the owner, torque on the surface; what a report needs
_FORCE, _TORQUE, _OTHER_TORQUE, NORMAL, POINT_ARM, PENETRATION = range(38, 54, 3)
# in: the larger `SHEAR_LOAD` of both bodies; out: what the contact adds to them
_LARGEST, _LOAD, _OTHER_LOAD, ROWS = range(PENETRATION + 1, PENETRATION + 5)
FORCE = _FORCE


# rows of Heap.particle and Heap.motion, as unsigned numbers: for signed ones numba checks the sign
_FOUR, _MOTION = np.uint64(4), np.uint64(MOTION)
_1, _2, _3 = np.uint64(1), np.uint64(2), np.uint64(3)
_CENTER, _VELOCITY, _SPIN_COLUMN = np.uint64(CENTER), np.uint64(VELOCITY), np.uint64(SPIN)
_TURN_COLUMN, _INVERSE_COLUMN = np.uint64(TURN), np.uint64(INVERSE_MASS)
_CLASS_COLUMN, _WEIGHT_COLUMN = np.uint64(CLASS), np.uint64(WEIGHT)
_LOAD_COLUMN = np.uint64(SHEAR_LOAD)
_EIGHT, _4, _5, _6 = np.uint64(8), np.uint64(4), np.uint64(5), np.uint64(6)


@stage
def filter_touching(particle, pair, count, touching):
    """Writes the indices of the pairs that touch; returns how many do.

    `particle` and `pair` are flat.
    """
    found = 0
    for k in range(count):
        i, j = pair[2 * k] * _FOUR, pair[2 * k + 1] * _FOUR
        x = particle[i] - particle[j]
        y = particle[i + _1] - particle[j + _1]
        z = particle[i + _2] - particle[j + _2]
        reach = particle[i + _3] + particle[j + _3]
        touching[found] = k
        found += 1 if x * x + y * y + z * z < reach * reach else 0
    return found


@stage
def three(rows, first):
    """Three numbers that follow each other."""
    return rows[first], rows[first + _1], rows[first + _2]


@stage
def put_three(block, row, n, x, y, z):
    """Writes three rows of contact n."""
    block[row * BLOCK + n] = x
    block[(row + 1) * BLOCK + n] = y
    block[(row + 2) * BLOCK + n] = z


@cached_by_features
def make_pack(features):
    """Stage that packs contacts first <= n < first + count of those that touch into a block.

    `particle`, `motion` and `pair` are flat.
    """
    history, equal, friction = features.history, features.equal, features.friction

    @stage
    def pack(
        particle, motion, body_of, constants, block, touching, pair, shear, first, count, evaluation
    ):
        for n in range(count):
            k = np.uint64(touching[first + n])
            i, j = np.uint64(pair[k * _2]), np.uint64(pair[k * _2 + _1])
            a, b = np.uint64(body_of[i]) * _MOTION, np.uint64(body_of[j]) * _MOTION
            i4, j4 = i * _FOUR, j * _FOUR
            ix, iy, iz = three(particle, i4)
            jx, jy, jz = three(particle, j4)
            ax, ay, az = three(motion, a + _CENTER)
            bx, by, bz = three(motion, b + _CENTER)
            put_three(block, _BETWEEN, n, ix - jx, iy - jy, iz - jz)
            put_three(block, _ARM, n, ix - ax, iy - ay, iz - az)
            put_three(block, _OTHER_ARM, n, jx - bx, jy - by, jz - bz)
            ax, ay, az = three(motion, a + _VELOCITY)
            bx, by, bz = three(motion, b + _VELOCITY)
            put_three(block, _RELATIVE, n, ax - bx, ay - by, az - bz)
            ax, ay, az = three(motion, a + _SPIN_COLUMN)
            put_three(block, _SPIN, n, ax, ay, az)
            bx, by, bz = three(motion, b + _SPIN_COLUMN)
            put_three(block, _OTHER_SPIN, n, bx, by, bz)
            if friction:
                block[_LARGEST * BLOCK + n] = max(
                    motion[a + _LOAD_COLUMN], motion[b + _LOAD_COLUMN]
                )
            if history:
                k4 = k * _FOUR
                lasts = shear[k4 + _3] == evaluation
                x, y, z = three(shear, k4)
                put_three(
                    block, _SHEAR, n, x if lasts else 0.0, y if lasts else 0.0, z if lasts else 0.0
                )
                x, y, z = three(motion, b + _TURN_COLUMN)
                put_three(block, _TURN, n, x, y, z)
                block[(_TURN + 3) * BLOCK + n] = motion[b + _TURN_COLUMN + _3]
            if not equal:
                block[_RADIUS * BLOCK + n] = particle[i4 + _3]
                block[_OTHER_RADIUS * BLOCK + n] = particle[j4 + _3]
                block[_INVERSE * BLOCK + n] = motion[a + _INVERSE_COLUMN]
                block[_OTHER_INVERSE * BLOCK + n] = motion[b + _INVERSE_COLUMN]
                block[_WEIGHT * BLOCK + n] = motion[a + _WEIGHT_COLUMN]
                row = constants.contact[
                    int(motion[a + _CLASS_COLUMN]), int(motion[b + _CLASS_COLUMN])
                ]
                block[_CONTACT * BLOCK + n] = row.unit_stiffness
                block[(_CONTACT + 1) * BLOCK + n] = row.stiffness
                block[(_CONTACT + 2) * BLOCK + n] = row.damping
                block[(_CONTACT + 3) * BLOCK + n] = row.friction
                block[(_CONTACT + 4) * BLOCK + n] = row.shear_ratio
                block[(_CONTACT + 5) * BLOCK + n] = row.leverage
                block[(_CONTACT + 6) * BLOCK + n] = row.first_compliance
                block[(_CONTACT + 7) * BLOCK + n] = row.second_compliance

    return pack


@cached_by_features
def make_law(features):
    """Formula of a contact's force, normal part and tangential part in full stiffness."""
    friction, viscous, history = features.friction, features.viscous, features.history

    @stage
    def law(
        penetration, nx, ny, nz, ux, uy, uz, k, damping, inverse_mass, shear_k, shear_c, mu, h,
        sx, sy, sz,
    ):  # fmt: skip
        """Force x y z and spring x y z to remember, N; u is the velocity relative to the surface.

        A dashpot without a lever needs only a few of the arguments of the normal law.
        """
        approach = -(ux * nx + uy * ny + uz * nz)
        normal = dashpot_force(
            penetration, approach, k, damping, 0.0, inverse_mass, 0.0, h,
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, True,
        )[0]  # fmt: skip
        fx, fy, fz = normal * nx, normal * ny, normal * nz
        ux, uy, uz = ux + approach * nx, uy + approach * ny, uz + approach * nz
        if history:
            along = sx * nx + sy * ny + sz * nz
            gx, gy, gz, sx, sy, sz = friction_force(
                normal, ux, uy, uz, shear_k, shear_c, mu, h,
                sx - along * nx, sy - along * ny, sz - along * nz, 1.0, None,
            )  # fmt: skip
            fx, fy, fz = fx + gx, fy + gy, fz + gz
        elif friction and viscous:
            gx, gy, gz = viscous_force(normal, ux, uy, uz, shear_c, mu)
            fx, fy, fz = fx + gx, fy + gy, fz + gz
        return fx, fy, fz, sx, sy, sz

    return law


@cached_by_features
def make_compute(features):
    """Stage that computes the contacts of a block."""
    history, equal, friction = features.history, features.equal, features.friction
    law = make_law(features)

    @stage
    def compute(constants, sample, block, count, h):
        """`sample`: (radius, inverse mass, weight) of all particles and bodies if all are equal."""
        row = constants.contact[0, 0]
        radius, inverse, weight = sample
        other_radius, other_inverse = radius, inverse
        damping, mu, step = row.damping, row.friction, constants.step
        k, inverse_mass, shear_k, shear_c = contact_coefficients(
            row.unit_stiffness, row.stiffness, row.shear_ratio, row.leverage,
            row.first_compliance, row.second_compliance, inverse, inverse, step,
        )  # fmt: skip
        first, second = row.first_compliance, row.second_compliance
        load, other_load, part = shear_loads(
            shear_k if history else 0.0, shear_c, first * inverse, second * inverse, weight, step
        )
        for n in range(count):
            if not equal:
                radius, other_radius = block[_RADIUS * BLOCK + n], block[_OTHER_RADIUS * BLOCK + n]
                inverse = block[_INVERSE * BLOCK + n]
                other_inverse = block[_OTHER_INVERSE * BLOCK + n]
                weight = block[_WEIGHT * BLOCK + n]
                damping = block[(_CONTACT + 2) * BLOCK + n]
                mu = block[(_CONTACT + 3) * BLOCK + n]
                k, inverse_mass, shear_k, shear_c = contact_coefficients(
                    block[_CONTACT * BLOCK + n],
                    block[(_CONTACT + 1) * BLOCK + n],
                    block[(_CONTACT + 4) * BLOCK + n],
                    block[(_CONTACT + 5) * BLOCK + n],
                    block[(_CONTACT + 6) * BLOCK + n],
                    block[(_CONTACT + 7) * BLOCK + n],
                    inverse,
                    other_inverse,
                    step,
                )
                load, other_load, part = shear_loads(
                    shear_k if history else 0.0,
                    shear_c,
                    block[(_CONTACT + 6) * BLOCK + n] * inverse,
                    block[(_CONTACT + 7) * BLOCK + n] * other_inverse,
                    weight,
                    step,
                )
            distance, nx, ny, nz = sphere_distance(
                block[_BETWEEN * BLOCK + n],
                block[(_BETWEEN + 1) * BLOCK + n],
                block[(_BETWEEN + 2) * BLOCK + n],
                0.0, 0.0, 0.0,
            )  # fmt: skip
            penetration = radius + other_radius - distance
            # each surface yields by a part of the overlap, see contact_point.py
            share = 0.5 if equal else other_inverse / inverse_mass
            out = radius - share * penetration
            into = other_radius - (1.0 - share) * penetration
            ax = block[_ARM * BLOCK + n] - out * nx
            ay = block[(_ARM + 1) * BLOCK + n] - out * ny
            az = block[(_ARM + 2) * BLOCK + n] - out * nz
            bx = block[_OTHER_ARM * BLOCK + n] + into * nx
            by = block[(_OTHER_ARM + 1) * BLOCK + n] + into * ny
            bz = block[(_OTHER_ARM + 2) * BLOCK + n] + into * nz
            px, py, pz = cross(
                block[_SPIN * BLOCK + n],
                block[(_SPIN + 1) * BLOCK + n],
                block[(_SPIN + 2) * BLOCK + n],
                ax, ay, az,
            )  # fmt: skip
            qx, qy, qz = cross(
                block[_OTHER_SPIN * BLOCK + n],
                block[(_OTHER_SPIN + 1) * BLOCK + n],
                block[(_OTHER_SPIN + 2) * BLOCK + n],
                bx, by, bz,
            )  # fmt: skip
            ux = block[_RELATIVE * BLOCK + n] + (px - qx)
            uy = block[(_RELATIVE + 1) * BLOCK + n] + (py - qy)
            uz = block[(_RELATIVE + 2) * BLOCK + n] + (pz - qz)
            sx = sy = sz = 0.0
            if history:
                r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation_entries(
                    block[_TURN * BLOCK + n],
                    block[(_TURN + 1) * BLOCK + n],
                    block[(_TURN + 2) * BLOCK + n],
                    block[(_TURN + 3) * BLOCK + n],
                )
                tx, ty, tz = (
                    block[_SHEAR * BLOCK + n],
                    block[(_SHEAR + 1) * BLOCK + n],
                    block[(_SHEAR + 2) * BLOCK + n],
                )
                sx = r00 * tx + r01 * ty + r02 * tz
                sy = r10 * tx + r11 * ty + r12 * tz
                sz = r20 * tx + r21 * ty + r22 * tz
            reduced = shear_c
            if friction:
                reduced = grip_of(block[_LARGEST * BLOCK + n], part) * shear_c
                rubs = mu > 0.0
                block[_LOAD * BLOCK + n] = load if rubs else 0.0
                block[_OTHER_LOAD * BLOCK + n] = other_load if rubs else 0.0
            fx, fy, fz, sx, sy, sz = law(
                penetration, nx, ny, nz, ux, uy, uz, k, damping, inverse_mass, shear_k, reduced,
                mu, h, sx, sy, sz,
            )  # fmt: skip
            if history:
                block[_SHEAR * BLOCK + n] = r00 * sx + r10 * sy + r20 * sz
                block[(_SHEAR + 1) * BLOCK + n] = r01 * sx + r11 * sy + r21 * sz
                block[(_SHEAR + 2) * BLOCK + n] = r02 * sx + r12 * sy + r22 * sz
            fx, fy, fz = weight * fx, weight * fy, weight * fz
            tx, ty, tz = cross(ax, ay, az, fx, fy, fz)
            qx, qy, qz = cross(bx, by, bz, fx, fy, fz)
            block[_FORCE * BLOCK + n] = fx
            block[(_FORCE + 1) * BLOCK + n] = fy
            block[(_FORCE + 2) * BLOCK + n] = fz
            block[_TORQUE * BLOCK + n] = tx
            block[(_TORQUE + 1) * BLOCK + n] = ty
            block[(_TORQUE + 2) * BLOCK + n] = tz
            block[_OTHER_TORQUE * BLOCK + n] = qx
            block[(_OTHER_TORQUE + 1) * BLOCK + n] = qy
            block[(_OTHER_TORQUE + 2) * BLOCK + n] = qz
            block[NORMAL * BLOCK + n] = nx
            block[(NORMAL + 1) * BLOCK + n] = ny
            block[(NORMAL + 2) * BLOCK + n] = nz
            block[POINT_ARM * BLOCK + n] = ax
            block[(POINT_ARM + 1) * BLOCK + n] = ay
            block[(POINT_ARM + 2) * BLOCK + n] = az
            block[PENETRATION * BLOCK + n] = penetration

    return compute


@stage
def unpack(body_of, pair, touching, block, force, shift, first, count, friction):
    """Adds forces and torques of a block to the rows of the bodies, `shift` before their place.

    And the shear loads. `pair` and `force` are flat.
    """
    before = np.uint64(shift)
    for n in range(count):
        k = np.uint64(touching[first + n]) * _2
        a = (np.uint64(body_of[np.uint64(pair[k])]) - before) * _EIGHT
        b = (np.uint64(body_of[np.uint64(pair[k + _1])]) - before) * _EIGHT
        fx = block[_FORCE * BLOCK + n]
        fy = block[(_FORCE + 1) * BLOCK + n]
        fz = block[(_FORCE + 2) * BLOCK + n]
        force[a] += fx
        force[a + _1] += fy
        force[a + _2] += fz
        force[a + _3] += block[_TORQUE * BLOCK + n]
        force[a + _4] += block[(_TORQUE + 1) * BLOCK + n]
        force[a + _5] += block[(_TORQUE + 2) * BLOCK + n]
        force[b] -= fx
        force[b + _1] -= fy
        force[b + _2] -= fz
        force[b + _3] -= block[_OTHER_TORQUE * BLOCK + n]
        force[b + _4] -= block[(_OTHER_TORQUE + 1) * BLOCK + n]
        force[b + _5] -= block[(_OTHER_TORQUE + 2) * BLOCK + n]
        if friction:
            force[a + _6] += block[_LOAD * BLOCK + n]
            force[b + _6] += block[_OTHER_LOAD * BLOCK + n]


@stage
def keep_springs(shear, touching, block, first, count, evaluation):
    """Writes the springs of a block back, flat, with the number of this evaluation."""
    for n in range(count):
        k = np.uint64(touching[first + n]) * _FOUR
        shear[k] = block[_SHEAR * BLOCK + n]
        shear[k + _1] = block[(_SHEAR + 1) * BLOCK + n]
        shear[k + _2] = block[(_SHEAR + 2) * BLOCK + n]
        shear[k + _3] = evaluation


@cached_by_features
def make_pair_forces(features):
    """Stage that computes the forces of a slab's pairs.

    `h`: s; 0 in a refresh, which changes no spring.
    """
    history, friction = features.history, features.friction
    pack, compute = make_pack(features), make_compute(features)

    @stage
    def pair_forces(heap, constants, scratch, thread, slab, h, evaluation):
        current = heap.counts[PARITY] % heap.pair.shape[0]
        room, n = heap.pair.shape[2], heap.particle.shape[0]
        pair, particle = heap.pair[current, slab].reshape(2 * room), heap.particle.reshape(4 * n)
        motion = heap.motion.reshape(MOTION * heap.motion.shape[0])
        shear = particle  # not read
        if history:
            shear = heap.shear[current, slab * room : (slab + 1) * room].reshape(4 * room)
        touching, block = scratch.touching[thread], scratch.block[thread]
        low, high = heap.force_range[slab, 0], heap.force_range[slab, 1]
        begin = heap.force_range[slab, 2]
        size = (high - low) * 8
        force = scratch.force[begin : begin + high - low].reshape(size)
        for b in range(size):
            force[b] = 0.0
        sample = heap.particle[0, 3], heap.motion[0, INVERSE_MASS], heap.motion[0, WEIGHT]
        count = filter_touching(particle, pair, heap.pair_count[current, slab], touching)
        for first in range(0, count, BLOCK):
            here = min(BLOCK, count - first)
            pack(
                particle, motion, heap.body_of, constants, block, touching, pair, shear, first,
                here, evaluation,
            )  # fmt: skip
            compute(constants, sample, block, here, h)
            unpack(heap.body_of, pair, touching, block, force, low, first, here, friction)
            if history and h > 0.0:
                keep_springs(shear, touching, block, first, here, evaluation + 1)

    return pair_forces

"""Forces between particles of two bodies: filter, pack, compute, unpack.

The neighbours that touch are a minority, and which of them do is not predictable. So a filter
without a branch collects their indices. Blocks of BLOCK of them are packed into rows, on which the
laws run in vector instructions, and the results are added body by body. All rows are in one array
with constant offsets: with several, LLVM would have to check that they don't overlap.
"""

from physics.collision.distances import sphere_distance
from physics.compiler.jit import stage
from physics.granular.coefficients import contact_coefficients
from physics.granular.tables import (
    CENTER,
    CLASS,
    INVERSE_MASS,
    PARITY,
    SPIN,
    TURN,
    VELOCITY,
    WEIGHT,
)
from physics.model.features import cached_by_features
from physics.motion.vectors import cross
from physics.rotation import rotation_entries
from physics.spring.coulomb import friction_force, viscous_force
from physics.spring.hunt_crossley import dashpot_force

# contacts in a block: its rows stay in the first-level cache
BLOCK = 128
# rows of a block, in units of BLOCK. In: distance of the particles, their arms from the centres of
# their bodies, the bodies' relative velocity, their spins, the spring and the surface's quaternion
_BETWEEN, _ARM, _OTHER_ARM, _RELATIVE, _SPIN, _OTHER_SPIN = 0, 3, 6, 9, 12, 15
_SHEAR, _TURN = 18, 21
# of bodies that differ: radii, inverse masses, weight, coefficients (in the order of CONTACT)
_RADIUS, _OTHER_RADIUS, _INVERSE, _OTHER_INVERSE, _WEIGHT, _CONTACT = 25, 26, 27, 28, 29, 30
# out: force and torque on the owner, torque on the surface; what a report needs
_FORCE, _TORQUE, _OTHER_TORQUE, NORMAL, POINT_ARM, PENETRATION = 38, 41, 44, 47, 50, 53
ROWS = 54
FORCE = _FORCE


@stage
def filter_touching(particle, pair, count, touching):
    """Writes the indices of the pairs that touch; returns how many do."""
    found = 0
    for k in range(count):
        i, j = pair[k, 0], pair[k, 1]
        x = particle[i, 0] - particle[j, 0]
        y = particle[i, 1] - particle[j, 1]
        z = particle[i, 2] - particle[j, 2]
        reach = particle[i, 3] + particle[j, 3]
        touching[found] = k
        found += 1 if x * x + y * y + z * z < reach * reach else 0
    return found


@cached_by_features
def make_pack(features):
    """Stage that packs contacts first <= n < first + count of those that touch into a block."""
    history, equal = features.history, features.equal

    @stage
    def pack(heap, constants, block, touching, pair, shear, first, count, evaluation):
        particle, motion, body_of = heap.particle, heap.motion, heap.body_of
        for n in range(count):
            k = touching[first + n]
            i, j = pair[k, 0], pair[k, 1]
            a, b = body_of[i], body_of[j]
            for axis in range(3):
                x, y = particle[i, axis], particle[j, axis]
                block[(_BETWEEN + axis) * BLOCK + n] = x - y
                block[(_ARM + axis) * BLOCK + n] = x - motion[a, CENTER + axis]
                block[(_OTHER_ARM + axis) * BLOCK + n] = y - motion[b, CENTER + axis]
            for axis in range(3):
                block[(_RELATIVE + axis) * BLOCK + n] = (
                    motion[a, VELOCITY + axis] - motion[b, VELOCITY + axis]
                )
                block[(_SPIN + axis) * BLOCK + n] = motion[a, SPIN + axis]
                block[(_OTHER_SPIN + axis) * BLOCK + n] = motion[b, SPIN + axis]
            if history:
                lasts = shear[k, 3] == evaluation
                for axis in range(3):
                    block[(_SHEAR + axis) * BLOCK + n] = shear[k, axis] if lasts else 0.0
                for axis in range(4):
                    block[(_TURN + axis) * BLOCK + n] = motion[b, TURN + axis]
            if not equal:
                block[_RADIUS * BLOCK + n] = particle[i, 3]
                block[_OTHER_RADIUS * BLOCK + n] = particle[j, 3]
                block[_INVERSE * BLOCK + n] = motion[a, INVERSE_MASS]
                block[_OTHER_INVERSE * BLOCK + n] = motion[b, INVERSE_MASS]
                block[_WEIGHT * BLOCK + n] = motion[a, WEIGHT]
                row = constants.contact[int(motion[a, CLASS]), int(motion[b, CLASS])]
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
    history, equal = features.history, features.equal
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
            fx, fy, fz, sx, sy, sz = law(
                penetration, nx, ny, nz, ux, uy, uz, k, damping, inverse_mass, shear_k, shear_c,
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
def unpack(body_of, pair, touching, block, force, shift, first, count):
    """Adds forces and torques of a block to the rows of the bodies, `shift` before their place."""
    for n in range(count):
        k = touching[first + n]
        a, b = body_of[pair[k, 0]] - shift, body_of[pair[k, 1]] - shift
        for axis in range(3):
            f = block[(_FORCE + axis) * BLOCK + n]
            force[a, axis] += f
            force[b, axis] -= f
        for axis in range(3):
            force[a, 3 + axis] += block[(_TORQUE + axis) * BLOCK + n]
            force[b, 3 + axis] -= block[(_OTHER_TORQUE + axis) * BLOCK + n]


@stage
def keep_springs(shear, touching, block, first, count, evaluation):
    """Writes the springs of a block back, with the number of this evaluation."""
    for n in range(count):
        k = touching[first + n]
        for axis in range(3):
            shear[k, axis] = block[(_SHEAR + axis) * BLOCK + n]
        shear[k, 3] = evaluation


@cached_by_features
def make_pair_forces(features):
    """Stage that computes the forces of a slab's pairs.

    `h`: s; 0 in a refresh, which changes no spring.
    """
    history = features.history
    pack, compute = make_pack(features), make_compute(features)

    @stage
    def pair_forces(heap, constants, scratch, thread, slab, h, evaluation):
        current = heap.count[PARITY] % heap.pair.shape[0]
        pair, room = heap.pair[current, slab], heap.pair.shape[2]
        shear = heap.shear[current, slab * room : (slab + 1) * room] if history else heap.particle
        touching, block = scratch.touching[thread], scratch.block[thread]
        low, high = heap.force_range[slab, 0], heap.force_range[slab, 1]
        begin = heap.force_range[slab, 2]
        for b in range(begin, begin + high - low):
            for axis in range(8):
                scratch.force[b, axis] = 0.0
        sample = heap.particle[0, 3], heap.motion[0, INVERSE_MASS], heap.motion[0, WEIGHT]
        count = filter_touching(heap.particle, pair, heap.pair_count[current, slab], touching)
        for first in range(0, count, BLOCK):
            here = min(BLOCK, count - first)
            pack(heap, constants, block, touching, pair, shear, first, here, evaluation)
            compute(constants, sample, block, here, h)
            unpack(heap.body_of, pair, touching, block, scratch.force, low - begin, first, here)
            if history and h > 0.0:
                keep_springs(shear, touching, block, first, here, evaluation + 1)

    return pair_forces

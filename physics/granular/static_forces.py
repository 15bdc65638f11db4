"""Forces between particles and statics: Ground, Box, Sphere, Capsule, Cylinder or Torus.

Few particles touch a static, so they are computed one by one, when the forces on their body are
summed. Springs of contacts with statics are stored in the world frame.
"""

from typing import Any

from physics.collision.distances import core_distance
from physics.compiler.jit import LANES, stage
from physics.granular.coefficients import contact_coefficients, shear_loads
from physics.granular.neighbors import find_old, keep_shear
from physics.granular.pair_forces import make_law
from physics.granular.tables import (
    CENTER,
    CLASS,
    INVERSE_MASS,
    PARITY,
    SHEAR_LOAD,
    SKIN,
    SLABS,
    SPIN,
    VELOCITY,
    WEIGHT,
)
from physics.model.features import cached_by_features
from physics.model.tangential import grip_of
from physics.model.workspace import SHEAR_SUM
from physics.motion.vectors import cross


def make_distance_of(kinds):
    """Formula for the distance from a surface of one of several kinds."""
    kind, distance = kinds[0], core_distance(kinds[0])
    others: Any = make_distance_of(kinds[1:]) if len(kinds) > 1 else None
    if others is None:

        @stage
        def only(of, x, y, z, a, b, c, radius):
            return distance(x, y, z, a, b, c, radius, False)

        return only

    @stage
    def one_of(of, x, y, z, a, b, c, radius):
        if of == kind:
            d, nx, ny, nz = distance(x, y, z, a, b, c, radius, False)
        else:
            d, nx, ny, nz = others(of, x, y, z, a, b, c, radius)
        return d, nx, ny, nz

    return one_of


@cached_by_features
def make_static_distance(features):
    """Formula for the distance of a point from a static's core, and the normal in the world."""
    distance_of = make_distance_of(features.kinds)

    @stage
    def static_distance(static, x, y, z, radius):
        R, c, core = static.rotation, static.position, static.core
        dx, dy, dz = x - c[0], y - c[1], z - c[2]
        px = R[0] * dx + R[3] * dy + R[6] * dz
        py = R[1] * dx + R[4] * dy + R[7] * dz
        pz = R[2] * dx + R[5] * dy + R[8] * dz
        d, mx, my, mz = distance_of(
            static.kind, px, py, pz, core[0], core[1], core[2], radius + static.radius
        )
        return (
            d - static.radius,
            R[0] * mx + R[1] * my + R[2] * mz,
            R[3] * mx + R[4] * my + R[5] * mz,
            R[6] * mx + R[7] * my + R[8] * mz,
        )

    return static_distance


@cached_by_features
def make_find_statics(features):
    """Stage that lists the particles of a slab of bodies that are near a static."""
    history, some = features.history, len(features.kinds) > 0
    static_distance: Any = make_static_distance(features) if some else None

    @stage
    def find_statics(heap, constants, scratch, thread, slab, first_body, last_body, evaluation):
        lists, room = heap.wall.shape[0], heap.wall.shape[2]
        old, new = heap.counts[PARITY] % lists, (heap.counts[PARITY] + 1) % lists
        total = 0
        if some:
            skin = heap.scale[SKIN]
            flat = heap.wall[old].reshape(SLABS * room, 2)
            motion, particle = heap.motion, heap.particle
            # a lane group at a time, for vector instructions
            center, bound, near = (
                scratch.solid[thread].position,
                scratch.solid[thread].weight[0],
                (scratch.solid[thread].weight[1]),
            )
            for body in range(first_body, last_body):
                lane = body % LANES
                if lane == 0:
                    for i in range(LANES):
                        for axis in range(3):
                            center[axis, i] = motion[body + i, CENTER + axis]
                        bound[i], near[i] = heap.reach[body + i], 0.0
                    for s in range(constants.static.shape[0]):
                        static = constants.static[s]
                        for i in range(LANES):
                            d, _, _, _ = static_distance(
                                static, center[0, i], center[1, i], center[2, i], bound[i]
                            )
                            near[i] += 1.0 if d < bound[i] + skin else 0.0
                first, last = heap.first[body], heap.first[body + 1]
                for n in range(first, last):
                    begin = total
                    if near[lane] > 0.0:
                        for s in range(constants.static.shape[0]):
                            r = particle[n, 3]
                            d, _, _, _ = static_distance(
                                constants.static[s], particle[n, 0], particle[n, 1],
                                particle[n, 2], r,
                            )  # fmt: skip
                            if d < r + skin:
                                if total < room:
                                    heap.wall[new, slab, total, 0] = n
                                    heap.wall[new, slab, total, 1] = s
                                    if history:
                                        k = slab * room + total
                                        heap.wall_shear[new, k, 3] = -1.0
                                        at = find_old(flat, heap.wall_range[old], n, n, s)
                                        keep_shear(
                                            heap.wall_shear[old], heap.wall_shear[new, k], at,
                                            evaluation,
                                        )  # fmt: skip
                                total += 1
                    if history:
                        heap.wall_range[new, n, 0] = slab * room + begin
                        heap.wall_range[new, n, 1] = total - begin
        heap.wall_count[new, slab] = min(total, room)
        scratch.wall_total[slab] = total

    return find_statics


@cached_by_features
def make_static_force(features):
    """Formula for the contact of a particle and a static."""
    law, static_distance = make_law(features), make_static_distance(features)
    history = features.history

    @stage
    def static_force(heap, constants, n, s, h, sx, sy, sz):
        """Penetration; normal, arm, force on the body and spring to remember, x y z each.

        And what it adds to `SHEAR_LOAD`.
        """
        body, particle, motion = heap.body_of[n], heap.particle, heap.motion
        x, y, z, radius = particle[n, 0], particle[n, 1], particle[n, 2], particle[n, 3]
        d, nx, ny, nz = static_distance(constants.static[s], x, y, z, radius)
        # only the static yields: its arm doesn't matter
        ax = x - motion[body, CENTER] - radius * nx
        ay = y - motion[body, CENTER + 1] - radius * ny
        az = z - motion[body, CENTER + 2] - radius * nz
        px, py, pz = cross(
            motion[body, SPIN], motion[body, SPIN + 1], motion[body, SPIN + 2], ax, ay, az
        )
        row = constants.static_contact[int(motion[body, CLASS]), s]
        k, inverse_mass, shear_k, shear_c = contact_coefficients(
            row.unit_stiffness, row.stiffness, row.shear_ratio, row.leverage, row.first_compliance,
            0.0, motion[body, INVERSE_MASS], 0.0, constants.step,
        )  # fmt: skip
        weight, load = motion[body, WEIGHT], motion[body, SHEAR_LOAD]
        compliance = row.first_compliance * motion[body, INVERSE_MASS]
        spring = shear_k if history else 0.0
        adds, _, part = shear_loads(spring, shear_c, compliance, 0.0, weight, constants.step)
        adds = adds if row.friction > 0.0 else 0.0
        shear_c *= grip_of(load, part)
        fx, fy, fz, sx, sy, sz = law(
            radius - d, nx, ny, nz,
            motion[body, VELOCITY] + px, motion[body, VELOCITY + 1] + py,
            motion[body, VELOCITY + 2] + pz,
            k, row.damping, inverse_mass, shear_k, shear_c, row.friction, h, sx, sy, sz,
        )  # fmt: skip
        return (
            radius - d, nx, ny, nz, ax, ay, az,
            weight * fx, weight * fy, weight * fz, sx, sy, sz, adds,
        )  # fmt: skip

    return static_force


@cached_by_features
def make_static_forces(features):
    """Stage that adds the forces of statics on a lane group to its row of SOLID.

    It continues in the slab's list at `next`, and returns where the next group's entries begin.
    """
    history, some = features.history, len(features.kinds) > 0
    static_force: Any = make_static_force(features) if some else None
    static_distance: Any = make_static_distance(features) if some else None

    @stage
    def static_forces(heap, constants, slab, next_entry, first_body, lanes, solid, h, evaluation):
        if some:
            current, room = heap.counts[PARITY] % heap.wall.shape[0], heap.wall.shape[2]
            count = heap.wall_count[current, slab]
            wall = heap.wall[current, slab]
            while next_entry < count:
                n, s = wall[next_entry, 0], wall[next_entry, 1]
                lane = heap.body_of[n] - first_body
                if lane >= lanes:
                    break
                next_entry += 1
                radius, static = heap.particle[n, 3], constants.static[s]
                d, _, _, _ = static_distance(
                    static, heap.particle[n, 0], heap.particle[n, 1], heap.particle[n, 2], radius
                )
                if d >= radius:
                    continue
                k = slab * room + next_entry - 1
                sx = sy = sz = 0.0
                if history:
                    shear = heap.wall_shear[current, k]
                    if shear[3] == evaluation:
                        sx, sy, sz = shear[0], shear[1], shear[2]
                _, _, _, _, ax, ay, az, fx, fy, fz, sx, sy, sz, adds = static_force(
                    heap, constants, n, s, h, sx, sy, sz
                )
                tx, ty, tz = cross(ax, ay, az, fx, fy, fz)
                solid.force[0, lane] += fx
                solid.force[1, lane] += fy
                solid.force[2, lane] += fz
                solid.torque[0, lane] += tx
                solid.torque[1, lane] += ty
                solid.torque[2, lane] += tz
                solid.normals[SHEAR_SUM, lane] += adds
                if history and h > 0.0:
                    shear[0], shear[1], shear[2] = sx, sy, sz
                    shear[3] = evaluation + 1
        return next_entry

    return static_forces

"""Contact forces: every side's candidates against its surface, and the wrenches on both solids.

All of a side is worked out in the frame of its surface, where the surface is at rest. The contact
point lies in the middle of the overlap and both solids feel opposite forces at it, so momentum and
angular momentum are kept. Loops run over chunks of LANES candidates without a branch; one or two
candidates run alone, more are padded to whole chunks with weightless ones.
"""

from functools import cache

from physics.jit import LANES, lane_kernel, stage
from physics.shapes import BOX, CAPSULE, PARTICLES, PLANE, SPHERE
from physics.stages.friction import friction_force
from physics.stages.kinematics import CENTER, turned
from physics.stages.normal_force import dashpot_force, overlap_force
from physics.stages.relative import (
    FORCE,
    NORMAL_SUM,
    OFFSET,
    SPEED,
    TORQUE,
    TURNING,
    relative_motion,
    relative_pose,
)
from physics.stages.surfaces import box_distance, capsule_distance, sphere_distance

# columns of a report's row, one a candidate
REPORT_OVERLAP, REPORT_POINT, REPORT_NORMAL, REPORT_FORCE, REPORT_WEIGHT, REPORT = (
    0,
    1,
    4,
    7,
    10,
    11,
)


@cache
def make_loop(features, kind, report):
    """Loop over one chunk of candidates against one kind of surface.

    With `report` it also writes a row for each candidate, in the surface's frame.
    """
    friction = features.friction
    history, partner = features.history_field * LANES, features.partner_field * LANES
    normal_force = dashpot_force if features.dashpot else overlap_force
    plane, particles = kind == PLANE, kind == PARTICLES
    surface_distance = {BOX: box_distance, CAPSULE: capsule_distance}.get(kind, sphere_distance)

    @lane_kernel
    def loop(n, lanes, rel, constants, h, rows):
        q00, q01, q02, q10, q11, q12, q20, q21, q22 = (
            rel[0], rel[1], rel[2], rel[3], rel[4], rel[5], rel[6], rel[7], rel[8],
        )  # fmt: skip
        tx, ty, tz = rel[OFFSET], rel[OFFSET + 1], rel[OFFSET + 2]
        vx, vy, vz = rel[SPEED], rel[SPEED + 1], rel[SPEED + 2]
        ox, oy, oz = rel[TURNING], rel[TURNING + 1], rel[TURNING + 2]
        radius, owner_radius = constants.radius, constants.owner_radius
        ca, cb, cc = constants.core[0], constants.core[1], constants.core[2]
        k, a, floor = constants.stiffness, constants.damping, constants.rest_speed
        shear_k, shear_c = constants.shear_stiffness, constants.shear_damping
        mu, inverse_mass = constants.friction, 1.0 / constants.pair_mass
        mass_rate = constants.pair_mass / h if h > 0.0 else 0.0
        sum_fx = 0.0
        sum_fy = 0.0
        sum_fz = 0.0
        sum_tx = 0.0
        sum_ty = 0.0
        sum_tz = 0.0
        sum_normal = 0.0
        for i in range(n):
            x, y, z = lanes[i], lanes[LANES + i], lanes[2 * LANES + i]
            weight = lanes[3 * LANES + i]
            rx = q00 * x + q01 * y + q02 * z
            ry = q10 * x + q11 * y + q12 * z
            rz = q20 * x + q21 * y + q22 * z
            if plane:
                overlap = radius - (rz + tz)
                rz -= owner_radius - 0.5 * overlap
            else:
                px, py, pz = rx + tx, ry + ty, rz + tz
                if particles:
                    px -= lanes[partner + i]
                    py -= lanes[partner + LANES + i]
                    pz -= lanes[partner + 2 * LANES + i]
                distance, nx, ny, nz = surface_distance(px, py, pz, ca, cb, cc)
                overlap = radius - distance
                arm = owner_radius - 0.5 * overlap
                rx -= arm * nx
                ry -= arm * ny
                rz -= arm * nz
            ux = vx + oy * rz - oz * ry
            uy = vy + oz * rx - ox * rz
            uz = vz + ox * ry - oy * rx
            approach = -uz if plane else -(ux * nx + uy * ny + uz * nz)
            normal, memory, load = normal_force(
                overlap,
                approach,
                k,
                a,
                floor,
                inverse_mass,
                h,
                mass_rate,
                lanes[4 * LANES + i],
                lanes[5 * LANES + i],
            )
            lanes[4 * LANES + i] = memory
            lanes[5 * LANES + i] = load
            if plane:
                fx, fy, fz = 0.0, 0.0, normal
            else:
                fx, fy, fz = normal * nx, normal * ny, normal * nz
            if friction:
                sx, sy, sz = (
                    lanes[history + i],
                    lanes[history + LANES + i],
                    lanes[history + 2 * LANES + i],
                )
                if plane:
                    gx, gy, gz, sx, sy, sz = friction_force(
                        normal, ux, uy, 0.0, shear_k, shear_c, mu, h, sx, sy, 0.0
                    )
                    fx += gx
                    fy += gy
                else:
                    along = sx * nx + sy * ny + sz * nz
                    gx, gy, gz, sx, sy, sz = friction_force(
                        normal,
                        ux + approach * nx,
                        uy + approach * ny,
                        uz + approach * nz,
                        shear_k,
                        shear_c,
                        mu,
                        h,
                        sx - along * nx,
                        sy - along * ny,
                        sz - along * nz,
                    )
                    fx += gx
                    fy += gy
                    fz += gz
                    lanes[history + 2 * LANES + i] = sz
                lanes[history + i] = sx
                lanes[history + LANES + i] = sy
            fx *= weight
            fy *= weight
            fz *= weight
            sum_fx += fx
            sum_fy += fy
            sum_fz += fz
            sum_tx += ry * fz - rz * fy
            sum_ty += rz * fx - rx * fz
            sum_tz += rx * fy - ry * fx
            if not plane:
                sum_normal += weight * normal
            if report:
                rows[i, REPORT_OVERLAP] = overlap
                rows[i, REPORT_POINT] = rx + tx
                rows[i, REPORT_POINT + 1] = ry + ty
                rows[i, REPORT_POINT + 2] = rz + tz
                rows[i, REPORT_NORMAL] = 0.0 if plane else nx
                rows[i, REPORT_NORMAL + 1] = 0.0 if plane else ny
                rows[i, REPORT_NORMAL + 2] = 1.0 if plane else nz
                rows[i, REPORT_FORCE] = fx
                rows[i, REPORT_FORCE + 1] = fy
                rows[i, REPORT_FORCE + 2] = fz
                rows[i, REPORT_WEIGHT] = weight
        rel[FORCE] += sum_fx
        rel[FORCE + 1] += sum_fy
        rel[FORCE + 2] += sum_fz
        rel[TORQUE] += sum_tx
        rel[TORQUE + 1] += sum_ty
        rel[TORQUE + 2] += sum_tz
        rel[NORMAL_SUM] += sum_fz if plane else sum_normal

    return loop


@cache
def make_side(features, report):
    """Kernel that works out one side: its loops, in the frame of its surface."""
    fields = features.lane_fields
    plane, sphere, box = features.plane, features.sphere, features.box
    capsule, particles = features.capsule, features.particles
    plane_loop = make_loop(features, PLANE, report)
    sphere_loop = make_loop(features, SPHERE, report)
    box_loop = make_loop(features, BOX, report)
    capsule_loop = make_loop(features, CAPSULE, report)
    particle_loop = make_loop(features, PARTICLES, report)

    @stage
    def side(model, state, frame, rel, rows, w, k, h):
        relative_pose(model, frame, rel, k)
        relative_motion(model, frame, rel, k)
        constants = model.side[k]
        kind = constants.kind
        count = state.side[w, k].count
        chunks = state.sample_id.shape[1] // LANES
        base = w * chunks + constants.first_chunk
        for c in range((count + LANES - 1) // LANES):
            o = (base + c) * fields * LANES
            lanes = state.lanes[o : o + fields * LANES]
            out = rows[c * LANES :]
            n = count if count < 3 else LANES
            if plane and kind == PLANE:
                plane_loop(n, lanes, rel, constants, h, out)
            if sphere and kind == SPHERE:
                sphere_loop(n, lanes, rel, constants, h, out)
            if box and kind == BOX:
                box_loop(n, lanes, rel, constants, h, out)
            if capsule and kind == CAPSULE:
                capsule_loop(n, lanes, rel, constants, h, out)
            if particles and kind == PARTICLES:
                particle_loop(n, lanes, rel, constants, h, out)

    return side


@cache
def make_contacts(features):
    """Stage that adds the contact forces of all sides, and notes first touches."""
    side = make_side(features, False)
    reaction = features.reaction

    @stage
    def contacts(model, state, frame, rel, rows, w, h, time):
        movers = model.mover.shape[0]
        for k in range(model.side.shape[0]):
            if state.side[w, k].count == 0:
                continue
            side(model, state, frame, rel, rows, w, k, h)
            if rel[NORMAL_SUM] > 0.0:
                found = state.side[w, k]
                if not found.first_touch <= time:
                    found.first_touch = time
                a, b = model.side[k].owner, model.side[k].surface
                fx, fy, fz = rel[FORCE], rel[FORCE + 1], rel[FORCE + 2]
                tx, ty, tz = rel[TORQUE], rel[TORQUE + 1], rel[TORQUE + 2]
                if model.side[k].kind != PLANE:
                    fx, fy, fz = turned(frame, b, fx, fy, fz)
                    tx, ty, tz = turned(frame, b, tx, ty, tz)
                if a < movers:  # a static may carry samples as well
                    m = state.mover[w, a]
                    m.force[0] += fx
                    m.force[1] += fy
                    m.force[2] += fz
                    m.torque[0] += tx
                    m.torque[1] += ty
                    m.torque[2] += tz
                if reaction and b < movers:
                    dx = frame[a, CENTER] - frame[b, CENTER]
                    dy = frame[a, CENTER + 1] - frame[b, CENTER + 1]
                    dz = frame[a, CENTER + 2] - frame[b, CENTER + 2]
                    m = state.mover[w, b]
                    m.force[0] -= fx
                    m.force[1] -= fy
                    m.force[2] -= fz
                    m.torque[0] -= tx + dy * fz - dz * fy
                    m.torque[1] -= ty + dz * fx - dx * fz
                    m.torque[2] -= tz + dx * fy - dy * fx

    return contacts

"""Contact forces: every side's candidates against its surface, and the wrenches on both solids.

All of a side is worked out in the frame of its surface, where the surface is at rest. Both solids
feel opposite forces at the contact point, so momentum and angular momentum are kept. A slot holds a
candidate of each lane, or zeros; the loop over lanes has no branch.
"""

from functools import cache

import numpy as np

from physics.collision.compound_frames import hide
from physics.collision.contact_point import HIDDEN, make_touch
from physics.collision.relative_frame import relative_motion, relative_pose
from physics.jit import LANES, at, kernel, stage
from physics.model.lanes import note_touch
from physics.motion.vectors import turned
from physics.scene.shapes import BOX, CAPSULE, PARTICLES, PLANE, SPHERE
from physics.spring.coulomb import friction_force, twist_torque, viscous_force
from physics.spring.energy_correction import make_leaps, turned_by
from physics.spring.hunt_crossley import dashpot_force, overlap_force

# N, of a pair; below it W / F could overflow
_LEAST_FORCE = 1e-200

# one row a slot: what a report tells of the candidates there
REPORT = np.dtype(
    [
        ("overlap", "f8", (LANES,)),  # m
        ("point", "f8", (3, LANES)),  # m, in the surface's frame, as the others
        ("normal", "f8", (3, LANES)),
        ("force", "f8", (3, LANES)),  # N, on the owner
        ("weight", "f8", (LANES,)),
    ],
    align=True,
)


@cache
def make_loop(features, kind, report):
    """Loop over the slots of one side against one kind of surface.

    With `report` it also writes a row for each candidate, in the surface's frame.
    """
    viscous, resistance = features.viscous, features.resistance
    friction = features.friction and not viscous
    normal_force = dashpot_force if features.dashpot else overlap_force
    plane, box = kind == PLANE, kind == BOX
    compound = features.compound
    touch = make_touch(kind, compound)

    @kernel
    def loop(slots, candidate, seen, constants, h, rows):
        R, c, v, omega = seen.rotation, seen.position, seen.velocity, seen.spin
        force, torque, pressed = seen.force, seen.torque, seen.pressed
        radii, owner_radii, core = constants.radius, constants.owner_radius, constants.core
        stiffness, damping, floors = constants.stiffness, constants.damping, constants.rest_speed
        shear_stiffness, shear_damping = constants.shear_stiffness, constants.shear_damping
        frictions, mass_rates, per_means = constants.friction, seen.mass_rate, seen.per_mean
        bearing = seen.bearing
        pair_mass, yielding = constants.pair_mass, constants.yielding
        centre = constants.surface_centre
        sharp = constants.sharp != 0
        rolling, spinning = constants.rolling, constants.spinning
        twist_stiffness, twist_damping = constants.twist_stiffness, constants.twist_damping
        for n in range(slots):
            row = candidate[n]
            weights, memories, loads = row.weight, row.impact_speed, row.load
            befores = row.approach
            for i in range(LANES):
                weight, mu = weights[i], at(frictions, i)
                radius, owner_radius = at(radii, i), at(owner_radii, i)
                ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                k, a, floor = at(stiffness, i), at(damping, i), at(floors, i)
                shear_k, shear_c = at(shear_stiffness, i), at(shear_damping, i)
                mass, mass_rate = at(pair_mass, i), mass_rates[i]
                inverse_mass = 1.0 / mass
                rx, ry, rz, nx, ny, nz, overlap, face = touch(
                    row, i, R, c, ca, cb, cc, radius, owner_radius, sharp
                )
                if box and compound:
                    weight = 0.0 if face == HIDDEN else weight
                if not plane:
                    turning = turned_by(
                        at(yielding[0], i),
                        at(yielding[1], i),
                        at(yielding[2], i),
                        rx + c[0, i] - at(centre[0], i),
                        ry + c[1, i] - at(centre[1], i),
                        rz + c[2, i] - at(centre[2], i),
                        nx,
                        ny,
                        nz,
                    )
                    inverse_mass += turning
                    mass_rate *= 1.0 / (1.0 + mass * turning)
                ux = v[0, i] + omega[1, i] * rz - omega[2, i] * ry
                uy = v[1, i] + omega[2, i] * rx - omega[0, i] * rz
                uz = v[2, i] + omega[0, i] * ry - omega[1, i] * rx
                approach = -uz if plane else -(ux * nx + uy * ny + uz * nz)
                memory = memories[i]
                if box:  # out by another face is another contact
                    memory = memory if (face == row.face[i]) | (not sharp) else 0.0
                normal, memory, rest = normal_force(
                    overlap,
                    approach,
                    k,
                    a,
                    floor,
                    inverse_mass,
                    h,
                    mass_rate,
                    per_means[i],
                    memory,
                    loads[i],
                    befores[i],
                )
                # an empty slot stays empty, whatever its lane is up to
                normal = normal if weight > 0.0 else 0.0
                memory = memory if weight > 0.0 else 0.0
                lasts = seen.lasts[i] != 0.0
                memories[i] = memory if lasts else memories[i]
                loads[i] = normal if lasts else loads[i]
                kept = approach if weight > 0.0 else 0.0
                befores[i] = kept if lasts else befores[i]
                bearing[i] += weight if normal > 0.0 else 0.0
                if box:
                    face = face if weight > 0.0 else 0.0
                    row.face[i] = face if lasts else row.face[i]
                if plane:
                    fx, fy, fz = 0.0, 0.0, normal
                else:
                    fx, fy, fz = normal * nx, normal * ny, normal * nz
                if friction:
                    sx, sy, sz = row.shear[0, i], row.shear[1, i], row.shear[2, i]
                    if plane:
                        gx, gy, gz, sx, sy, sz = friction_force(
                            normal, ux, uy, 0.0, shear_k, shear_c, mu, h, sx, sy, 0.0, rest
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
                            rest,
                        )
                        fx += gx
                        fy += gy
                        fz += gz
                        row.shear[2, i] = sz if lasts else row.shear[2, i]
                    row.shear[0, i] = sx if lasts else row.shear[0, i]
                    row.shear[1, i] = sy if lasts else row.shear[1, i]
                if viscous:
                    gx, gy, gz = viscous_force(
                        normal,
                        ux + approach * nx,
                        uy + approach * ny,
                        uz + approach * nz,
                        shear_c,
                        mu,
                    )
                    fx += gx
                    fy += gy
                    fz += gz
                if resistance:
                    tx, ty, tz, sx, sy, sz = twist_torque(
                        normal,
                        omega[0, i],
                        omega[1, i],
                        omega[2, i],
                        nx,
                        ny,
                        nz,
                        at(twist_stiffness, i),
                        at(twist_damping, i),
                        rolling,
                        spinning,
                        h,
                        row.twist[0, i],
                        row.twist[1, i],
                        row.twist[2, i],
                    )
                    row.twist[0, i] = sx if lasts else row.twist[0, i]
                    row.twist[1, i] = sy if lasts else row.twist[1, i]
                    row.twist[2, i] = sz if lasts else row.twist[2, i]
                    torque[0, i] += tx * weight if weight > 0.0 else 0.0
                    torque[1, i] += ty * weight if weight > 0.0 else 0.0
                    torque[2, i] += tz * weight if weight > 0.0 else 0.0
                fx = fx * weight if weight > 0.0 else 0.0
                fy = fy * weight if weight > 0.0 else 0.0
                fz = fz * weight if weight > 0.0 else 0.0
                force[0, i] += fx
                force[1, i] += fy
                force[2, i] += fz
                torque[0, i] += ry * fz - rz * fy
                torque[1, i] += rz * fx - rx * fz
                torque[2, i] += rx * fy - ry * fx
                pressed[i] += weight * normal
                if report:
                    out = rows[n]
                    out.overlap[i] = overlap
                    out.point[0, i] = rx + c[0, i]
                    out.point[1, i] = ry + c[1, i]
                    out.point[2, i] = rz + c[2, i]
                    out.normal[0, i] = 0.0 if plane else nx
                    out.normal[1, i] = 0.0 if plane else ny
                    out.normal[2, i] = 1.0 if plane else nz
                    out.force[0, i] = fx
                    out.force[1, i] = fy
                    out.force[2, i] = fz
                    out.weight[i] = weight

    return loop


@cache
def make_side(features, report):
    """Kernel that works out one side, and the wrenches of it on its solids."""
    plane, sphere, box = features.plane, features.sphere, features.box
    capsule, particles = features.capsule, features.particles
    plane_loop = make_loop(features, PLANE, report)
    sphere_loop = make_loop(features, SPHERE, report)
    box_loop = make_loop(features, BOX, report)
    capsule_loop = make_loop(features, CAPSULE, report)
    particle_loop = make_loop(features, PARTICLES, report)
    others = sphere or box or capsule or particles
    compound = features.compound
    begin_side = make_begin_side(features)
    leaps = make_leaps(compound)

    @stage
    def side(model, state, work, rows, g, k, h):
        constants, meeting = model.side[k], work.side[k]
        kind, slots = constants.kind, meeting.slots
        owner, surface = work.solid[constants.owner], work.solid[constants.surface]
        frame = work.solid[constants.frame] if compound else surface
        first = constants.first_slot
        candidate = state.candidate[g, first : first + slots]
        out = rows[first : first + slots] if report else rows
        seen = owner if kind == PLANE else work.relative[0]
        begin_side(model, work, k, h, seen)
        if plane and kind == PLANE:
            plane_loop(slots, candidate, owner, constants, h, out)
        if others and kind != PLANE:
            relative_pose(owner, frame, seen)
            relative_motion(owner, frame, seen)
            if sphere and kind == SPHERE:
                sphere_loop(slots, candidate, seen, constants, h, out)
            if compound and box and kind == BOX:
                hide(model, k, candidate, seen)
            if box and kind == BOX:
                # a look has no step; the loop remembers the present faces, so this comes before
                if constants.sharp == 0 and h > 0.0:
                    leaps(slots, candidate, seen, constants, h)
                box_loop(slots, candidate, seen, constants, h, out)
            if capsule and kind == CAPSULE:
                capsule_loop(slots, candidate, seen, constants, h, out)
            if particles and kind == PARTICLES:
                particle_loop(slots, candidate, seen, constants, h, out)
            add_wrenches(owner, surface, frame, seen)

    return side


@cache
def make_begin_side(features):
    """Stage that sets what the loop of a side reads of the group, and sums up."""
    compound = features.compound

    @stage
    def begin_side(model, work, k, h, seen):
        """Of a pair, the mass rate is m / (W h), and 1 over the mean force is W / F.

        In the last step W, a share of its stiffness, bore the normal force F. Both are zero where
        nothing bore. A step of no length is a look, and a lane at rest has no step: neither lasts.
        The loop finds all of this in `seen`, for LLVM compares the places of all arrays in it with
        each other before every turn.
        """
        meeting, side, active = work.side[k], model.side[k], work.lane[0].active
        other = work.side[max(side.mirror, 0)]
        pair_mass = side.pair_mass
        if compound:
            sum_bore(model, work, k, seen.bearing, seen.pressed)
        for i in range(LANES):
            rate = at(pair_mass, i) / h if h > 0.0 else 0.0
            if compound:
                share, force = seen.bearing[i], seen.pressed[i]
            else:
                share = meeting.bore[i] + (other.bore[i] if side.mirror >= 0 else 0.0)
                force = meeting.pressed[i] + (other.pressed[i] if side.mirror >= 0 else 0.0)
            seen.mass_rate[i] = rate / share if share > 0.0 else 0.0
            seen.per_mean[i] = share / force if force > _LEAST_FORCE else 0.0
            seen.lasts[i] = 1.0 if (active[i] != 0) & (h > 0.0) else 0.0
            seen.bearing[i] = 0.0
            seen.pressed[i] = 0.0

    return begin_side


@kernel
def sum_bore(model, work, k, total, force):
    """Sums W and F of the last step over all sides of a pair: those of compounds have several."""
    for i in range(LANES):
        total[i] = work.side[k].bore[i]
        force[i] = work.side[k].pressed[i]
    other = model.side[k].next
    while other != k:
        bore, pressed = work.side[other].bore, work.side[other].pressed
        for i in range(LANES):
            total[i] += bore[i]
            force[i] += pressed[i]
        other = model.side[other].next


@stage
def add_wrenches(owner, surface, frame, seen):
    """Adds the wrench that the owner feels, as seen from a frame of the surface, to both solids."""
    R, a, b = frame.rotation, owner.position, surface.position
    f, t = seen.force, seen.torque
    F, T, G, U = owner.force, owner.torque, surface.force, surface.torque
    for i in range(LANES):
        fx, fy, fz = turned(R, i, f[0, i], f[1, i], f[2, i])
        tx, ty, tz = turned(R, i, t[0, i], t[1, i], t[2, i])
        dx, dy, dz = a[0, i] - b[0, i], a[1, i] - b[1, i], a[2, i] - b[2, i]
        F[0, i] += fx
        F[1, i] += fy
        F[2, i] += fz
        T[0, i] += tx
        T[1, i] += ty
        T[2, i] += tz
        G[0, i] -= fx
        G[1, i] -= fy
        G[2, i] -= fz
        U[0, i] -= tx + dy * fz - dz * fy
        U[1, i] -= ty + dz * fx - dx * fz
        U[2, i] -= tz + dx * fy - dy * fx


@cache
def make_contacts(features):
    """Stage that adds the contact forces of all sides, and notes first touches."""
    side = make_side(features, False)

    @stage
    def contacts(model, state, work, g, h, drifted, elapsed):
        for k in range(model.side.shape[0]):
            if work.side[k].slots > 0:
                side(model, state, work, (), g, k, h)
                constants = model.side[k]
                owner = work.solid[constants.owner]
                seen = owner if constants.kind == PLANE else work.relative[0]
                for i in range(LANES):
                    work.side[k].bearing[i] = seen.bearing[i]
                    work.side[k].presses[i] = seen.pressed[i]
        # after all: the sides of a pair read what all of them bore in the last step
        keeps = work.lane[0].keeps
        for k in range(model.side.shape[0]):
            meeting = work.side[k]
            if meeting.slots > 0:
                note_touch(model, state, work, g, k, meeting.presses, elapsed)
                for i in range(LANES):
                    meeting.bore[i] = meeting.bearing[i] if keeps[i] != 0 else meeting.bore[i]

    return contacts

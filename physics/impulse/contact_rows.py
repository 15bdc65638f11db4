"""Contact rows of the impulse law: arms, normals and effective masses in the world frame.

The rows of all half-pairs are prepared before the sweeps, because an impulse at one point changes
the velocities at the others. (The spring law needs a contact point only once.)

The separation s of a curved contact does not change at u n, with the present normal n. A ball that
follows a ring of radius R at speed v has u n = -+ v^2 h / 2R half a step before and after its
present position, while s stays constant. Over a drift of h

    s after - s before = h u n + h b,    s now - s last = h u n - h b,    b = h (d^2s/dt^2) / 2,

where d^2s/dt^2 is what points that move without acceleration would have. The second formula gives b
from the last drift, the first predicts the next one with it. Without b the impulse of a moving
contact on a curved surface is wrong by half of m v^2/R. It is not known, and counts as 0, in the
first step of a contact, where a sample changes the face, and where a step turns a solid, or the
direction in which the contact moves, by more than a radian: |b| is at most half of the speed times
that angle.

The samples of a cylinder or torus on a floor don't turn with it about its axis, see
`collision.facing`: that part of u n, `turned`, changes no separation. Where such a sample is apart,
b takes it away. (The leading samples of a wheel that rolls at 40 m/s would else be stopped above
the ground, and throw it into the air.)

A contact is at rest if it closes by no more than the speed that its load gives it in a short time,
`HALF_PAIR.rest_time`. The load is what pressed the contact in the last step, or what made it close
faster since the impacts of that step; what the known forces would do, where the last step isn't
known. Bodies that fall freely side by side have none, and an edge
that a block rocks down onto has little. Of several contacts of a pair some bear nothing, and
tremble: so a contact is also at rest if it closes by no more than the speed that all that pressed
its pair gives the pair's mass in one step, which no step resolves.
"""

import math

from physics.collision.compound_frames import mark_hidden_faces
from physics.collision.contact_point import HIDDEN, TOUCH_TOLERANCE, make_touch
from physics.collision.grid_distance import grid_distances
from physics.collision.relative_frame import relative_pose
from physics.collision.surface_kinds import by_surface_kind, present_kinds
from physics.compiler.jit import LANES, at, stage
from physics.impulse.moving_arms import slip_of_arms
from physics.impulse.point_impulses import effective_masses, relative_velocity
from physics.model.contact_memory import contact_memory
from physics.model.features import EULER, cached_by_features
from physics.motion.vectors import cross, rotated
from physics.scene.shapes import BOX, CYLINDER, GRID, PLANE

# kinds of surface with flat faces
_FLAT = (PLANE, BOX, GRID)


@cached_by_features
def make_find_points(features, kind):
    """Stage that writes arms, normals, separations and weights, in the frame of the surface.

    The surface is of one kind; candidates remember the face of it that they touch.
    """
    hides, has_faces = kind == BOX and features.compound, kind in (BOX, CYLINDER)
    touch, memory_rows = make_touch(features, kind), contact_memory(features)
    FACE, SEPARATION = memory_rows.face, memory_rows.separation

    @stage
    def find_points(slots, candidate, relative, constants, updates_memory, points):
        R, c = relative.rotation, relative.position
        radii, owner_radii, core = constants.radius, constants.owner_radius, constants.core
        overlap_share = constants.overlap_share
        face_normals, axial = constants.face_normals != 0, constants.axial != 0
        for n in range(slots):
            row, point = candidate[n], points[n]
            memory = row.memory
            for i in range(LANES):
                radius, owner_radius = at(radii, i), at(owner_radii, i)
                share = at(overlap_share, i)
                ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                x, y, z, nx, ny, nz, penetration, face = touch(
                    row, i, R, c, ca, cb, cc, radius, owner_radius, share, face_normals, axial
                )
                weight = row.weight[i]
                if hides:
                    weight = 0.0 if face == HIDDEN else weight
                last = memory[SEPARATION, i]
                known = last != 0.0
                if has_faces:
                    known = known & (face == memory[FACE, i])
                    face = face if weight > 0.0 else 0.0
                    memory[FACE, i] = face if updates_memory[i] != 0 else memory[FACE, i]
                point.normal[0, i] = nx
                point.normal[1, i] = ny
                point.normal[2, i] = nz
                point.arm[0, i] = x
                point.arm[1, i] = y
                point.arm[2, i] = z
                point.separation[i] = -penetration
                point.last_bend[i] = last if known else math.inf
                point.weight[i] = weight

    return find_points


@stage
def resolved(owner, surface, point, i, h, bend):
    """Whether a step of h s turns neither the solids nor their path by more than a radian."""
    v, u, p, w = owner.velocity, surface.velocity, owner.angular_velocity, surface.angular_velocity
    a, b = point.arm, point.surface_arm
    x, y, z = v[0, i] - u[0, i], v[1, i] - u[1, i], v[2, i] - u[2, i]
    spin = p[0, i] * p[0, i] + p[1, i] * p[1, i] + p[2, i] * p[2, i]
    turn = w[0, i] * w[0, i] + w[1, i] * w[1, i] + w[2, i] * w[2, i]
    square = x * x + y * y + z * z
    square += spin * (a[0, i] * a[0, i] + a[1, i] * a[1, i] + a[2, i] * a[2, i])
    square += turn * (b[0, i] * b[0, i] + b[1, i] * b[1, i] + b[2, i] * b[2, i])
    return (4.0 * bend * bend <= square) & (h * h * max(spin, turn) <= 1.0)


@cached_by_features
def make_sum_loads(features):
    """Stage that adds up what pressed the contacts of a pair in the last step, collisions aside."""
    NORMAL = contact_memory(features).normal_force

    @stage
    def sum_loads(model, candidates, workspace, k, pressed):
        """Writes newtons [LANES]. `candidates`: those of a lane group."""
        for i in range(LANES):
            pressed[i] = 0.0
        other = k
        while True:
            first = model.half_pair[other].first_slot
            for n in range(workspace.half_pair[other].slots):
                memory = candidates[first + n].memory
                for i in range(LANES):
                    pressed[i] += memory[NORMAL, i]
            other = model.half_pair[other].next_in_pair
            if other == k:
                break

    return sum_loads


@stage
def turning_rate(owner, point, i):
    """m/s, the part of u n at a point that is due to the owner's spin about its own z axis."""
    R, w = owner.rotation, owner.angular_velocity
    ax, ay, az = R[2, i], R[5, i], R[8, i]
    x, y, z = cross(ax, ay, az, point.arm[0, i], point.arm[1, i], point.arm[2, i])
    spin = w[0, i] * ax + w[1, i] * ay + w[2, i] * az
    return spin * (x * point.normal[0, i] + y * point.normal[1, i] + z * point.normal[2, i])


@cached_by_features
def make_prepare(features):
    """Stage that writes the rows of a half-pair whose points `find_points` has found.

    That has left the separation of the last step, or inf, in `last_bend`.
    """
    friction, resistance, compound = features.friction, features.resistance, features.compound
    axial, halves = features.axial, features.integrator != EULER
    memory_rows = contact_memory(features)
    NORMAL, TANGENT = memory_rows.normal_force, memory_rows.tangential_force
    SHEAR, TWIST, BEND = memory_rows.shear, memory_rows.twist, memory_rows.bend
    APPROACH = memory_rows.approach

    @stage
    def prepare(
        slots, candidate, owner, surface, frame, A, B, constants, h, drifted, pressed, points
    ):
        """Writes rows with the impulses of the last step as the first guess.

        `frame` describes the surface; remembered vectors are in the frame of its solid. `h` is the
        time in s over which the impulses of a step act; `drifted` [LANES]: see LANE; `pressed`
        [LANES]: N, with which the pair was pressed in the last step.
        """
        F, E, rest_times, per_h = owner.force, surface.force, constants.rest_time, 1.0 / h
        rest_speeds = constants.rest_speed
        inverse_mass, other = constants.owner_inverse_mass, constants.surface_inverse_mass
        G = frame.rotation if compound else surface.rotation
        Q, a, b = surface.rotation, owner.position, surface.position
        pair_mass, turns = constants.pair_mass, constants.axial != 0
        radii, flat = constants.owner_radius, 1.0 if constants.kind in _FLAT else 0.0
        for n in range(slots):
            row, point = candidate[n], points[n]
            memory = row.memory
            for i in range(LANES):
                x, y, z = point.arm[0, i], point.arm[1, i], point.arm[2, i]
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                ax, ay, az = rotated(G, i, x, y, z)
                nx, ny, nz = rotated(G, i, nx, ny, nz)
                bx = ax + (a[0, i] - b[0, i])
                by = ay + (a[1, i] - b[1, i])
                bz = az + (a[2, i] - b[2, i])
                point.normal[0, i] = nx
                point.normal[1, i] = ny
                point.normal[2, i] = nz
                point.arm[0, i] = ax
                point.arm[1, i] = ay
                point.arm[2, i] = az
                point.surface_arm[0, i] = bx
                point.surface_arm[1, i] = by
                point.surface_arm[2, i] = bz
                ux, uy, uz = relative_velocity(owner, surface, point, i)
                un = ux * nx + uy * ny + uz * nz
                last, moves = point.last_bend[i], drifted[i] > 0
                # with an infinite value the difference is not used
                bend = un - per_h * (point.separation[i] - last)
                known = (last < math.inf) & resolved(owner, surface, point, i, h, bend)
                bend = bend if known else 0.0
                kept = memory[BEND, i] if drifted[i] == 0 else 0.0
                bend = bend if moves else kept
                # only what touches may be pressed by it: a gap may never close
                touches = (point.separation[i] <= 0.0) | (memory[NORMAL, i] > 0.0)
                point.bend[i] = bend if touches else max(bend, 0.0)
                if axial:
                    turned = turning_rate(owner, point, i) if turns else 0.0
                    point.turned[i] = turned
                    point.bend[i] = point.bend[i] if touches | (not turns) else -turned
                point.last_bend[i] = bend if moves else 0.0
                ma, mb = at(inverse_mass, i), at(other, i)
                along = F[0, i] * nx + F[1, i] * ny + F[2, i] * nz
                back = E[0, i] * nx + E[1, i] * ny + E[2, i] * nz
                along = ma * along - (mb * back if mb > 0.0 else 0.0)
                known = known & moves
                point.rest_speed[i] = per_h * (-un - memory[APPROACH, i]) if known else -along
                point.approach[i] = -un
                point.relaxed[i] = 0.0
                point.remaining[i] = 1.0
                normal_impulse = h * memory[NORMAL, i]
                point.normal_impulse[i] = normal_impulse
                point.normal_impact[i] = 0.0
                gx, gy, gz = normal_impulse * nx, normal_impulse * ny, normal_impulse * nz
                if friction:
                    # in a refresh the velocities that follow are h ahead, else half of it
                    ahead = h if halves & (drifted[i] == 0) else 0.5 * h
                    tx, ty, tz = slip_of_arms(
                        owner, surface, point, i, ahead, at(radii, i), axial and turns
                    )
                    tx, ty, tz = flat * tx, flat * ty, flat * tz
                    point.slip_bend[0, i] = tx
                    point.slip_bend[1, i] = ty
                    point.slip_bend[2, i] = tz
                    tx, ty, tz = tx if moves else 0.0, ty if moves else 0.0, tz if moves else 0.0
                    point.last_slip_bend[0, i] = tx
                    point.last_slip_bend[1, i] = ty
                    point.last_slip_bend[2, i] = tz
                    px, py, pz = rotated(
                        Q, i, memory[TANGENT, i], memory[TANGENT + 1, i], memory[TANGENT + 2, i]
                    )
                    # the surface has rotated: back into the tangent plane
                    along = px * nx + py * ny + pz * nz
                    px, py, pz = h * (px - along * nx), h * (py - along * ny), h * (pz - along * nz)
                    point.tangential_impulse[0, i] = px
                    point.tangential_impulse[1, i] = py
                    point.tangential_impulse[2, i] = pz
                    gx, gy, gz = gx + px, gy + py, gz + pz
                    sx, sy, sz = rotated(
                        Q, i, memory[SHEAR, i], memory[SHEAR + 1, i], memory[SHEAR + 2, i]
                    )
                    sx += h * (ux - tx)
                    sy += h * (uy - ty)
                    sz += h * (uz - tz)
                    along = sx * nx + sy * ny + sz * nz
                    held = normal_impulse > 0.0
                    point.anchor[0, i] = sx - along * nx if held else 0.0
                    point.anchor[1, i] = sy - along * ny if held else 0.0
                    point.anchor[2, i] = sz - along * nz if held else 0.0
                if resistance:
                    px, py, pz = rotated(
                        Q, i, memory[TWIST, i], memory[TWIST + 1, i], memory[TWIST + 2, i]
                    )
                    point.twist[0, i] = h * px
                    point.twist[1, i] = h * py
                    point.twist[2, i] = h * pz
                    point.extra_angular_impulse[0, i] = -h * px
                    point.extra_angular_impulse[1, i] = -h * py
                    point.extra_angular_impulse[2, i] = -h * pz
                # a step applies the impulses that it ends with minus those of the last step
                point.extra_impulse[0, i] = -gx
                point.extra_impulse[1, i] = -gy
                point.extra_impulse[2, i] = -gz
            for i in range(LANES):
                effective_masses(point, i, A, B, 1.0 / at(pair_mass, i))
            for i in range(LANES):
                load = max(point.rest_speed[i], memory[NORMAL, i] / point.mass[i])
                rest_speed = max(at(rest_times, i) * load, per_h * TOUCH_TOLERANCE)
                rest_speed = max(rest_speed, h * pressed[i] / at(pair_mass, i))
                # at an impact and after it the last step says nothing
                point.rest_speed[i] = at(rest_speeds, i) if drifted[i] < 0 else rest_speed

    return prepare


@cached_by_features
def make_contact_rows(features):
    """Stage that writes the contact rows of a half-pair."""
    kinds, compound = present_kinds(features), features.compound
    on_plane = make_points_of_kind(features, PLANE)
    on_solid = by_surface_kind(
        features, lambda kind: None if kind == PLANE else make_points_of_kind(features, kind)
    )
    has_plane, has_solids = PLANE in kinds, any(kind != PLANE for kind in kinds)
    prepare, sum_loads = make_prepare(features), make_sum_loads(features)

    @stage
    def contact_rows(model, state, workspace, g, k, updates_memory, h):
        constants, slots = model.half_pair[k], workspace.half_pair[k].slots
        owner, surface = workspace.solid[constants.owner], workspace.solid[constants.surface]
        frame = workspace.solid[constants.frame] if compound else surface
        A, B = (
            workspace.tensor[constants.owner].component,
            workspace.tensor[constants.surface].component,
        )
        first = constants.first_slot
        candidate = state.candidate[g, first : first + slots]
        first = workspace.half_pair[k].first_row
        points = workspace.contact_row[first : first + slots]
        # a plane is in the world frame, as the owner is
        if has_plane and (not has_solids or constants.kind == PLANE):
            on_plane(model, k, slots, candidate, owner, constants, updates_memory, points)
        if has_solids and (not has_plane or constants.kind != PLANE):
            relative = workspace.relative[0]
            relative_pose(owner, frame, relative)
            on_solid(
                constants.kind, model, k, slots, candidate, relative, constants, updates_memory,
                points,
            )  # fmt: skip
        drifted, pressed = workspace.lane[0].drifted, workspace.relative[0].normal_force_sum
        sum_loads(model, state.candidate[g], workspace, k, pressed)
        prepare(
            slots, candidate, owner, surface, frame, A, B, constants, h, drifted, pressed, points
        )

    return contact_rows


@cached_by_features
def make_points_of_kind(features, kind):
    """Stage that finds the points of half-pairs whose surface is of one kind."""
    hides, grid = kind == BOX and features.compound, kind == GRID
    find_points = make_find_points(features, kind)

    @stage
    def points_of_kind(model, k, slots, candidate, relative, constants, updates_memory, points):
        if hides:
            mark_hidden_faces(model, k, candidate, relative)
        if grid:
            grid_distances(model, k, candidate, relative)
        find_points(slots, candidate, relative, constants, updates_memory, points)

    return points_of_kind

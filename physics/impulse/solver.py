"""The impulse law: contact impulses that keep solids from approaching.

The force of a step is an impulse over its duration, found by sequential impulses (projected
Gauss-Seidel): every contact is corrected in turn, once in steps 2 and 3 below and until it
converges in step 1. Many short substeps converge faster than many sweeps of a long one. The
impulses of the last substep, relaxed, are the first guess. With the relative velocity u at a point
and the normal n out of the surface, a substep

1. collides: instantaneous collisions with restitution at the present velocities, see
   `restitution.py`;
2. relaxes: from the velocities of half a step ago and the impulses of the last substep it solves
   u n >= 0 for bodies that overlap, u n >= -separation/h for others. This removes the velocity
   that pushing overlapping bodies apart has given them;
3. applies the other forces and the first guess, then solves u n >= -separation/h for bodies that
   are apart and the soft contact of `sweep.py` for those that overlap.

With Fidelity.solver="newton", `newton.py` solves step 3 for all contacts of a world at once, and
the relaxation is left out where nothing separates.
"""

from physics.compiler.jit import LANES, at, sequence, stage
from physics.constraints.joint_velocities import (
    make_begin_hold,
    make_clear_hold,
    make_end_hold,
    make_hold,
)
from physics.impulse.contact_rows import make_contact_rows
from physics.impulse.impact_points import lag_of
from physics.impulse.newton import find_separating, make_newton
from physics.impulse.point_impulses import (
    add_opposite,
    apply_angular_impulse,
    apply_impulse,
    operands_of,
    rotate_inertia,
)
from physics.impulse.restitution import make_find_all_impacts, make_impacts
from physics.impulse.sweep import make_sweep
from physics.model.contact_memory import contact_memory
from physics.model.features import cached_by_features
from physics.model.lanes import all_update, record_first_contact, update_previous
from physics.model.workspace import HAS_MET
from physics.motion.drives import make_finger_velocity_coupling
from physics.motion.vectors import rotated_back, tensor_times


@cached_by_features
def make_warm_start(features):
    """Stage that applies the first guess: the impulses of the last substep, relaxed.

    `contact_rows` sets `extra_impulse` to the impulses of the last substep with reversed sign.
    Adding the relaxed ones leaves the change that relaxing made; this step's force includes it.
    The friction that a contact kept when it ended is no guess for this step.

    A collision halves a step. Up to it contacts gave what they gave before, even if they end with
    it; only what they give in the rest of the step is solved for.
    """
    friction, resistance = features.friction, features.resistance

    @stage
    def warm_start(pair):
        points = pair.points
        for n in range(points.shape[0]):
            point = points[n]
            # `twist`: angular impulse against rolling and spinning
            normal, tangential, twist = point.normal, point.tangential_impulse, point.twist
            extra, extra_angular = point.extra_impulse, point.extra_angular_impulse
            half = point.half_impulse
            for i in range(LANES):
                size = point.normal_impulse[i]
                px, py, pz = size * normal[0, i], size * normal[1, i], size * normal[2, i]
                if friction:
                    px += tangential[0, i]
                    py += tangential[1, i]
                    pz += tangential[2, i]
                presses = 1.0 if size > 0.0 else 0.0
                guess = presses * point.remaining[i]
                given = presses - guess
                kept = 1.0 + given
                extra[0, i] += kept * px
                extra[1, i] += kept * py
                extra[2, i] += kept * pz
                half[0, i] = given * px
                half[1, i] = given * py
                half[2, i] = given * pz
                point.normal_impulse[i] = guess * size
                if friction:
                    tangential[0, i] *= guess
                    tangential[1, i] *= guess
                    tangential[2, i] *= guess
                apply_impulse(pair, point, i, presses * px, presses * py, presses * pz)
                if resistance:
                    tx, ty, tz = twist[0, i], twist[1, i], twist[2, i]
                    extra_angular[0, i] += kept * tx
                    extra_angular[1, i] += kept * ty
                    extra_angular[2, i] += kept * tz
                    point.half_twist[0, i] = given * tx
                    point.half_twist[1, i] = given * ty
                    point.half_twist[2, i] = given * tz
                    twist[0, i] *= guess
                    twist[1, i] *= guess
                    twist[2, i] *= guess
                    apply_angular_impulse(pair, i, presses * tx, presses * ty, presses * tz)

    return warm_start


@stage
def remember(memory, first, i, updates, x, y, z):
    """Stores a vector in three rows of a contact's memory, in a lane that updates its memory."""
    memory[first, i] = x if updates else memory[first, i]
    memory[first + 1, i] = y if updates else memory[first + 1, i]
    memory[first + 2, i] = z if updates else memory[first + 2, i]


@cached_by_features
def make_store_forces(features):
    """Stage that adds the forces of a half-pair's points, and stores what contacts remember."""
    friction, resistance = features.friction, features.resistance
    memory_rows = contact_memory(features)
    NORMAL, TANGENT = memory_rows.normal_force, memory_rows.tangential_force
    SHEAR, TWIST = memory_rows.shear, memory_rows.twist
    SEPARATION, BEND = memory_rows.separation, memory_rows.bend
    APPROACH = memory_rows.approach

    @stage
    def store_forces(pair, candidate, updates_memory, h, normal_force_sum):
        points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
        Q, per_h = surface.rotation, 1.0 / h
        F, T, G, U = owner.force, owner.torque, surface.force, surface.torque
        for n in range(points.shape[0]):
            point, row = points[n], candidate[n]
            memory, impact_force = row.memory, row.impact_force
            normal = point.normal
            tangential, tangential_impact = point.tangential_impulse, point.tangential_impact
            extra, extra_angular = point.extra_impulse, point.extra_angular_impulse
            half = point.half_impulse
            for i in range(LANES):
                updates, size = updates_memory[i] != 0, point.normal_impulse[i]
                fx = extra[0, i] + size * normal[0, i]
                fy = extra[1, i] + size * normal[1, i]
                fz = extra[2, i] + size * normal[2, i]
                # Memory holds mean forces of the step. A contact that a collision ended keeps
                # none: what it gave before counts as impact
                hx, hy, hz = half[0, i], half[1, i], half[2, i]
                along = hx * normal[0, i] + hy * normal[1, i] + hz * normal[2, i]
                whole, lasts = per_h * (size + along), 1.0 if size > 0.0 else 0.0
                normal_force_sum[i] += whole + per_h * point.normal_impact[i]
                memory[NORMAL, i] = lasts * whole if updates else memory[NORMAL, i]
                exists = row.weight[i] > 0.0  # an empty slot stays empty
                separation = point.separation[i] if exists else 0.0
                bend, approach = point.bend[i], point.approach[i]
                bend, approach = bend if exists else 0.0, approach if exists else 0.0
                memory[SEPARATION, i] = separation if updates else memory[SEPARATION, i]
                memory[BEND, i] = bend if updates else memory[BEND, i]
                memory[APPROACH, i] = approach if updates else memory[APPROACH, i]
                impact, ended = point.normal_impact[i], 1.0 - lasts
                bx, by, bz = rotated_back(
                    Q,
                    i,
                    per_h * (impact * normal[0, i] + tangential_impact[0, i] + ended * hx),
                    per_h * (impact * normal[1, i] + tangential_impact[1, i] + ended * hy),
                    per_h * (impact * normal[2, i] + tangential_impact[2, i] + ended * hz),
                )
                remember(impact_force, 0, i, updates, bx, by, bz)
                if friction:
                    px, py, pz = tangential[0, i], tangential[1, i], tangential[2, i]
                    fx += px
                    fy += py
                    fz += pz
                    px += lasts * (hx - along * normal[0, i])
                    py += lasts * (hy - along * normal[1, i])
                    pz += lasts * (hz - along * normal[2, i])
                    px, py, pz = rotated_back(Q, i, per_h * px, per_h * py, per_h * pz)
                    remember(memory, TANGENT, i, updates, px, py, pz)
                    anchor = point.anchor  # creep, m
                    sx, sy, sz = rotated_back(Q, i, anchor[0, i], anchor[1, i], anchor[2, i])
                    remember(memory, SHEAR, i, updates, sx, sy, sz)
                if resistance:
                    tx, ty, tz = point.twist[0, i], point.twist[1, i], point.twist[2, i]
                    px = tx + lasts * point.half_twist[0, i]
                    py = ty + lasts * point.half_twist[1, i]
                    pz = tz + lasts * point.half_twist[2, i]
                    px, py, pz = rotated_back(Q, i, per_h * px, per_h * py, per_h * pz)
                    remember(memory, TWIST, i, updates, px, py, pz)
                    tx = per_h * (tx + extra_angular[0, i])
                    ty = per_h * (ty + extra_angular[1, i])
                    tz = per_h * (tz + extra_angular[2, i])
                    T[0, i] += tx
                    T[1, i] += ty
                    T[2, i] += tz
                    U[0, i] -= tx
                    U[1, i] -= ty
                    U[2, i] -= tz
                fx, fy, fz = per_h * fx, per_h * fy, per_h * fz
                add_opposite(point, i, F, T, G, U, fx, fy, fz)

    return store_forces


@stage
def apply_known_forces(model, workspace, h):
    """Changes the velocities of all dynamic bodies by the forces of gravity and servos."""
    for m in range(model.dynamic.shape[0]):
        solid, inverse = workspace.solid[m], workspace.tensor[m].component
        v, omega, F, T = solid.velocity, solid.angular_velocity, solid.force, solid.torque
        inverse_mass = model.dynamic[m].inverse_mass
        for i in range(LANES):
            step = h * at(inverse_mass, i)
            v[0, i] += step * F[0, i]
            v[1, i] += step * F[1, i]
            v[2, i] += step * F[2, i]
            tx, ty, tz = tensor_times(inverse, i, T[0, i], T[1, i], T[2, i])
            omega[0, i] += h * tx
            omega[1, i] += h * ty
            omega[2, i] += h * tz


@cached_by_features
def make_impulses(features):
    """Stage that adds the contact forces of all half-pairs, and records contacts."""
    contact_rows, impacts = make_contact_rows(features), make_impacts(features)
    sweep, warm_start = make_sweep(features), make_warm_start(features)
    store_forces, find_all_impacts = make_store_forces(features), make_find_all_impacts(features)
    joints, solves_together = features.joints, features.newton
    timed = features.finds_impacts
    newton = make_newton(features)
    couple_finger_velocities = make_finger_velocity_coupling(features)
    begin_hold, hold = make_begin_hold(features), make_hold(features)
    clear_hold, end_hold = make_clear_hold(features), make_end_hold(features)
    lag = lag_of(features)

    @stage
    def sweep_all(model, workspace, h, soft):
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                moves = workspace.search[0].moves
                sweep(operands_of(model, workspace, k), model.half_pair[k], h, soft, moves)
                couple_finger_velocities(model, workspace)
        lane = workspace.lane[0]
        hold(model, workspace, lane.in_contact, h if soft else 0.0, lane)

    @stage
    def mark_drifted(workspace, drifted):
        """Writes LANE.drifted."""
        lane = workspace.lane[0]
        for i in range(LANES):
            lane.drifted[i] = 1 if drifted > 0.0 else 0
            if timed and drifted > 0.0 and workspace.clock[0].phase[i] == HAS_MET:
                lane.drifted[i] = -1

    @stage
    def find_lanes_in_contact(model, workspace):
        in_contact = workspace.lane[0].in_contact
        for i in range(LANES):
            in_contact[i] = 0
        for k in range(model.half_pair.shape[0]):
            count = workspace.half_pair[k].count
            for i in range(LANES):
                in_contact[i] = 1 if count[i] > 0 else in_contact[i]

    @stage
    def finish(model, state, workspace, g, k, h, elapsed):
        pair, first = operands_of(model, workspace, k), model.half_pair[k].first_slot
        candidate = state.candidate[g, first : first + pair.points.shape[0]]
        normal_force = pair.owner[0].normal_force_sum
        for i in range(LANES):
            normal_force[i] = 0.0
        store_forces(pair, candidate, workspace.lane[0].updates_memory, h, normal_force)
        record_first_contact(model, state, workspace, k, normal_force, elapsed)
        previous, updates_memory = (
            workspace.half_pair[k].previous_normal_force,
            workspace.lane[0].updates_memory,
        )
        update_previous(previous, normal_force, updates_memory, all_update(updates_memory))

    @sequence
    def impulses(model, state, workspace, g, h, drifted, elapsed):
        """Impulses act for `h` s; the last drift took `drifted` s, 0 in a refresh."""
        half_pairs, candidates = model.half_pair.shape[0], 0
        for k in range(half_pairs):
            candidates += workspace.half_pair[k].slots
        if candidates == 0:
            return
        find_lanes_in_contact(model, workspace)
        mark_drifted(workspace, drifted)
        rotate_inertia(model, workspace)
        for k in range(half_pairs):
            if workspace.half_pair[k].slots > 0:
                contact_rows(model, state, workspace, g, k, workspace.lane[0].updates_memory, h)
        if joints:
            find_all_impacts(model, workspace, h, True, 0.0)
        # velocities are half a step old; bodies collide with the present ones
        apply_known_forces(model, workspace, lag * drifted)
        impacts(model, workspace, h, drifted == 0.0, lag if drifted > 0.0 else 0.0)
        apply_known_forces(model, workspace, -lag * drifted)
        clear_hold(model, workspace)
        begin_hold(model, workspace, False, 0.0)
        if not solves_together or find_separating(model, workspace) > 0:
            sweep_all(model, workspace, h, False)
        apply_known_forces(model, workspace, h)
        begin_hold(model, workspace, True, h)
        for k in range(half_pairs):
            if workspace.half_pair[k].slots > 0:
                warm_start(operands_of(model, workspace, k))
        couple_finger_velocities(model, workspace)
        if not solves_together or newton(model, workspace, h) > 0:
            sweep_all(model, workspace, h, True)
        end_hold(model, workspace, h)
        for k in range(half_pairs):
            if workspace.half_pair[k].slots > 0:
                finish(model, state, workspace, g, k, h, elapsed)

    return impulses

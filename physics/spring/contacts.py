"""Contact forces of the spring law: every half-pair's candidates, and the wrenches on both solids.

Both solids feel opposite forces at the contact point, so momentum and angular momentum are
conserved. Arguments: `g` is the lane group, `k` the half-pair, `h` the step in s.

A step's force is the mean over the time from half a step before to half a step after it. The force
of a state that was set from outside acts for the half step that comes, so a contact without memory
is evaluated half of that time later. (Otherwise a ball with e = 1 that touches in its first step
would rebound with 1 + (omega h)^2/8 of its speed.) `refresh` says what forces without a step are
for, see `model.state`; with a query h = 0.
"""

import math

from physics.collision.compound_frames import mark_hidden_faces
from physics.collision.grid_distance import grid_distances
from physics.collision.relative_frame import relative_gravity, relative_pose, relative_velocities
from physics.collision.surface_kinds import by_surface_kind, present_kinds
from physics.compiler.jit import LANES, at, sequence, stage
from physics.model.features import EULER, cached_by_features
from physics.model.lanes import (
    all_update,
    find_waiting,
    record_first_contact,
    update_previous,
)
from physics.model.state import BEGINS, QUERY
from physics.motion.vectors import rotated
from physics.scene.shapes import BOX, GRID, PLANE
from physics.spring.contact_loop import LEAST_SPEED, make_contact_loop, weighs_on_solids
from physics.spring.contact_start import keep_pose, make_keep_memory, move_ahead
from physics.spring.energy_correction import make_energy_correction
from physics.spring.mass_splitting import split_masses, splits_mass

# N; below this normal force of a pair, weight / force could overflow
_LEAST_FORCE = 1e-200


@cached_by_features
def make_half_pair(features, report):
    """Sequence that computes the forces of one half-pair, and adds its wrenches to both solids.

    `rows`: one `contact_loop.REPORT` for each slot of all half-pairs, written if `report`; else ().
    """
    kinds = present_kinds(features)
    on_plane, on_solid = make_on_plane(features, report), make_on_solid(features, report)
    has_plane, has_solids = PLANE in kinds, any(kind != PLANE for kind in kinds)

    @sequence
    def half_pair(model, state, workspace, rows, g, k, h, refresh):
        if has_plane and (not has_solids or model.half_pair[k].kind == PLANE):
            on_plane(model, state, workspace, rows, g, k, h, refresh)
        if has_solids and (not has_plane or model.half_pair[k].kind != PLANE):
            on_solid(model, state, workspace, rows, g, k, h, refresh)

    return half_pair


@cached_by_features
def make_on_plane(features, report):
    """The same, for half-pairs whose surface is a plane.

    A plane is in the world frame, as the owner is: the loop reads the owner itself and adds the
    forces straight to it; a plane never moves, so it gets none.
    """
    begin_half_pair, loop = make_begin_half_pair(features), make_loop(features, PLANE, report)

    @sequence
    def on_plane(model, state, workspace, rows, g, k, h, refresh):
        owner = workspace.solid[model.half_pair[k].owner]
        begin_half_pair(model, workspace, k, h, refresh, owner)
        loop(model, state, workspace, rows, g, k, h, refresh, owner)

    return on_plane


@cached_by_features
def make_on_solid(features, report):
    """The same, for half-pairs whose surface is that of a solid."""
    compound, weighs = features.compound, weighs_on_solids(features)
    begin_half_pair = make_begin_half_pair(features)
    loops = by_surface_kind(
        features, lambda kind: None if kind == PLANE else make_loop(features, kind, report)
    )

    @sequence
    def on_solid(model, state, workspace, rows, g, k, h, refresh):
        constants, relative = model.half_pair[k], workspace.relative[0]
        owner, surface = workspace.solid[constants.owner], workspace.solid[constants.surface]
        # of a compound `frame` is the part that is touched, `surface` the whole that forces act on
        frame = workspace.solid[constants.frame] if compound else surface
        begin_half_pair(model, workspace, k, h, refresh, relative)
        relative_pose(owner, frame, relative)
        relative_velocities(owner, frame, relative)
        if weighs:
            relative_gravity(frame, constants.gravity, relative)
        loops(constants.kind, model, state, workspace, rows, g, k, h, refresh, relative)
        add_wrenches(owner, surface, frame, relative)

    return on_solid


@cached_by_features
def make_loop(features, kind, report):
    """Sequence that adds the forces of a half-pair's candidates to the sums in `relative`."""
    box, grid, compound = kind == BOX, kind == GRID, features.compound
    correct_energy = make_energy_correction(features)
    contact_loop = make_contact_loop(features, kind, report)
    save_memory, begin_memory, restore_memory = make_keep_memory(features)
    halfway = features.integrator != EULER

    @sequence
    def loop(model, state, workspace, rows, g, k, h, refresh, relative):
        constants, slots = model.half_pair[k], workspace.half_pair[k].slots
        first = constants.first_slot
        candidate = state.candidate[g, first : first + slots]
        out = rows[first : first + slots] if report else rows
        # nearly always all candidates remember this step, so the loop doesn't ask
        lane, saved = workspace.lane[0], workspace.saved_memory
        keeps = refresh or lane.waiting != 0
        if keeps:
            save_memory(candidate, slots, saved)
        begins = halfway and refresh == BEGINS
        if begins:
            begin_memory(candidate, slots, lane.updates_memory)
            keep_pose(relative, workspace.relative[1])
            move_ahead(relative, 0.5 * h, lane.updates_memory)
        if compound and box:
            mark_hidden_faces(model, k, candidate, relative)
        if grid:
            grid_distances(model, k, candidate, relative)
        # The normal on a ball or capsule (`face_normals` 0) can leap from face to face of a box
        # within a step and add energy, which this removes. Before the loop, which overwrites the
        # face that each candidate remembers. Not in a refresh, before which nothing has moved
        if box and constants.face_normals == 0 and not refresh:
            correct_energy(slots, candidate, relative, constants, h)
        contact_loop(slots, candidate, relative, constants, h, begins, out)
        if begins:
            keep_pose(workspace.relative[1], relative)
        if keeps:
            restore_memory(candidate, slots, saved, lane.updates_memory, refresh)

    return loop


@cached_by_features
def make_begin_half_pair(features):
    """Stage that prepares the sums of a half-pair, and what its loop reads of the last step."""
    compound, splits = features.compound, splits_mass(features)

    @stage
    def begin_half_pair(model, workspace, k, h, refresh, relative):
        """Prepares what the samples read of their pair, see spring/hunt_crossley.py.

        The load rate m / (W h), with the pair mass m split as `mass_splitting` says, turns a change
        of velocity into a force; W / F is the inverse of the mean force. Also the mean impact speed
        of the last step (samples that separate count as 0) and the ratio of impact speed to rate,
        which samples that join take over.

        Also corrects the damping coefficient for (omega h)^2 W, see model/normal_damping.py.

        h is the step; in a refresh nothing is known of the load. W is the sum of the weights of the
        samples that were in contact in the last
        step, over all half-pairs of the pair, and F their normal force. The results are zero where
        nothing was in contact. All of it is written to `relative`, one array, because LLVM checks
        before every run of the loop that its arrays don't overlap.
        """
        live, half_pair = workspace.half_pair[k], model.half_pair[k]
        # without a reverse half-pair (-1) row 0 is named, and not read
        other = workspace.half_pair[max(half_pair.reverse, 0)]
        pair_mass, stiffness = half_pair.pair_mass, half_pair.stiffness
        damping, errors = half_pair.damping, half_pair.damping_error
        driven = half_pair.driven != 0
        # of a plane; along other normals the loop finds it
        fall = max(-half_pair.gravity[2], 0.0) if half_pair.kind == PLANE else 0.0
        rest_time, weight_speed = half_pair.rest_time, half_pair.rest_speed
        parts = live.parts
        if compound:
            sum_of_pair(
                model, workspace, k,
                relative.current_weight, relative.normal_force_sum,
                relative.impact_sum, relative.closing_sum,
            )  # fmt: skip
        for i in range(LANES):
            mass, spring = at(pair_mass, i), at(stiffness, i)
            # a report, in steps of 0 s, splits nothing: parts may not be written
            part = mass / max(parts[i], 1.0) if splits else mass
            relative.grip[i] = live.grip[i] if splits and refresh != QUERY else 1.0
            rate = part / h if not refresh else 0.0
            relative.inverse_mass[i] = half_pair.crowding / mass
            relative.speed_per_load[i] = 1.0 / math.sqrt(mass * spring)
            if compound:  # until the loop these four fields are scratch, cleared below
                weight, force = relative.current_weight[i], relative.normal_force_sum[i]
                impact, closing = relative.impact_sum[i], relative.closing_sum[i]
            else:
                both = half_pair.reverse >= 0
                weight = live.previous_weight[i] + (other.previous_weight[i] if both else 0.0)
                force = live.previous_normal_force[i] + (
                    other.previous_normal_force[i] if both else 0.0
                )
                impact = live.previous_impact[i] + (other.previous_impact[i] if both else 0.0)
                closing = live.previous_closing[i] + (other.previous_closing[i] if both else 0.0)
            relative.load_rate[i] = rate / weight if weight > 0.0 else 0.0
            known = weight if weight > 0.0 else 1.0
            square = known * spring * (h * h) / mass
            square = min(square, 4.0)  # beyond it no step is stable
            loaded = driven or (splits and live.supported[i] != 0.0)
            slowest = at(weight_speed, i) if loaded else at(rest_time, i) * fall
            relative.rest_speed[i] = max(slowest, LEAST_SPEED)
            relative.damping[i] = at(damping, i) * (1.0 - at(errors, i) * square)
            inverse = 1.0 / force if force > _LEAST_FORCE else 0.0
            relative.inverse_mean_force[i] = weight * inverse
            relative.mean_impact_speed[i] = impact * inverse
            relative.impact_ratio[i] = impact / closing if closing > _LEAST_FORCE else 0.0
            relative.current_weight[i] = 0.0
            relative.normal_force_sum[i] = 0.0
            relative.impact_sum[i] = 0.0
            relative.closing_sum[i] = 0.0
        for c in range(3):
            for i in range(LANES):
                relative.normal_sum[c, i] = 0.0

    return begin_half_pair


@stage
def sum_of_pair(model, workspace, k, weight, force, impact, closing):
    """Adds up what the half-pairs of a pair had in the last step; compounds have several."""
    for i in range(LANES):
        weight[i] = workspace.half_pair[k].previous_weight[i]
        force[i] = workspace.half_pair[k].previous_normal_force[i]
        impact[i] = workspace.half_pair[k].previous_impact[i]
        closing[i] = workspace.half_pair[k].previous_closing[i]
    other = model.half_pair[k].next_in_pair
    while other != k:
        live = workspace.half_pair[other]
        for i in range(LANES):
            weight[i] += live.previous_weight[i]
            force[i] += live.previous_normal_force[i]
            impact[i] += live.previous_impact[i]
            closing[i] += live.previous_closing[i]
        other = model.half_pair[other].next_in_pair


@stage
def add_wrenches(owner, surface, frame, relative):
    """Adds the wrench on the owner, given in a frame of the surface, to both solids."""
    R, a, b = frame.rotation, owner.position, surface.position
    f, t = relative.force, relative.torque
    F, T, G, U = owner.force, owner.torque, surface.force, surface.torque
    for i in range(LANES):
        fx, fy, fz = rotated(R, i, f[0, i], f[1, i], f[2, i])
        tx, ty, tz = rotated(R, i, t[0, i], t[1, i], t[2, i])
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


@stage
def keep_normals(frame, relative, normal, updates_memory):
    """Writes the sum of normals times weights of a half-pair, in the world frame."""
    R, own = frame.rotation, relative.normal_sum
    for i in range(LANES):
        x, y, z = rotated(R, i, own[0, i], own[1, i], own[2, i])
        normal[0, i] = x if updates_memory[i] != 0 else normal[0, i]
        normal[1, i] = y if updates_memory[i] != 0 else normal[1, i]
        normal[2, i] = z if updates_memory[i] != 0 else normal[2, i]


@cached_by_features
def make_contacts(features):
    """Sequence that adds all contact forces of small worlds, see `make_pair_contacts`.

    It takes the arguments of the impulse law, which alone needs `drifted`, the time in s that the
    last drift took.
    """
    pair_contacts, splits = make_pair_contacts(features), splits_mass(features)

    @sequence
    def contacts(model, state, workspace, g, h, drifted, elapsed):
        if splits:
            split_masses(model, workspace)
        refresh = 0 if drifted > 0.0 else BEGINS if h > 0.0 else QUERY
        pair_contacts(model, state, workspace, g, h, refresh, elapsed)

    return contacts


@cached_by_features
def make_pair_contacts(features):
    """Sequence that adds contact forces, and records normal forces and first touches.

    Before it `HALF_PAIR_WORK.parts` are written, see `mass_splitting`. `elapsed` is the time in s
    since `advance` began.
    """
    half_pair = make_half_pair(features, False)
    compound, splits = features.compound, splits_mass(features)

    @sequence
    def pair_contacts(model, state, workspace, g, h, refresh, elapsed):
        find_waiting(workspace.lane[0])
        for k in range(model.half_pair.shape[0]):
            live = workspace.half_pair[k]
            if live.slots > 0:
                half_pair(model, state, workspace, (), g, k, h, refresh)
                constants = model.half_pair[k]
                owner, plane = workspace.solid[constants.owner], constants.kind == PLANE
                relative = owner if plane else workspace.relative[0]
                # one array a loop, which LLVM copies as a whole
                for i in range(LANES):
                    live.current_weight[i] = relative.current_weight[i]
                for i in range(LANES):
                    live.current_normal_force[i] = relative.normal_force_sum[i]
                for i in range(LANES):
                    live.current_impact[i] = relative.impact_sum[i]
                for i in range(LANES):
                    live.current_closing[i] = relative.closing_sum[i]
                if splits and not plane:
                    frame = workspace.solid[constants.frame if compound else constants.surface]
                    updates = workspace.lane[0].updates_memory
                    keep_normals(frame, relative, live.previous_normal, updates)
        # after all of them, because the half-pairs of a pair read the last step of each other
        updates_memory = workspace.lane[0].updates_memory
        everyone = all_update(updates_memory)
        for k in range(model.half_pair.shape[0]):
            live = workspace.half_pair[k]
            if live.slots > 0:
                force = live.current_normal_force
                record_first_contact(model, state, workspace, k, force, elapsed)
                update_previous(live.previous_normal_force, force, updates_memory, everyone)
                update_previous(live.previous_weight, live.current_weight, updates_memory, everyone)
                update_previous(live.previous_impact, live.current_impact, updates_memory, everyone)
                update_previous(
                    live.previous_closing, live.current_closing, updates_memory, everyone
                )

    return pair_contacts

"""Lists of candidates, one half-pair and one lane at a time: the narrow part of the broadphase.

A list holds the samples that are nearer to the surface than the skin, in the order of their ids.
When it is replaced, contacts that stay in it keep their memory. Slots behind the end of a list hold
zeros: a weight of zero makes them no contact.
"""

import math

from physics.collision.contact_point import TOUCH_TOLERANCE
from physics.collision.distances import core_distance
from physics.collision.entry_face import make_entry_face
from physics.collision.facing import FLOORS, facing
from physics.collision.grid_distance import grid_distance
from physics.collision.manifold import add_manifold_point
from physics.collision.separations import make_separations, separation_bound
from physics.collision.surface_kinds import by_surface_kind, present_kinds
from physics.compiler.jit import at, stage
from physics.model.contact_memory import contact_memory
from physics.model.features import cached_by_features
from physics.scene.shapes import BOX, CYLINDER, GRID, PARTICLES, PLANE

# relative to the skin: motion after which a list that isn't empty is replaced at the latest
_LONGEST_TRAVEL = 4.0


@cached_by_features
def make_clear(features):
    """Stage that empties a slot in one lane."""
    memory_size = contact_memory(features).size
    impulse, particles = features.impulse, features.particles

    @stage
    def clear(row, i):
        row.weight[i] = 0.0
        for m in range(memory_size):
            row.memory[m, i] = 0.0
        for axis in range(3):
            row.sample[axis, i] = 0.0
            if impulse:
                row.impact_force[axis, i] = 0.0
            if particles:
                row.partner[axis, i] = 0.0

    return clear


@cached_by_features
def make_add_candidate(features):
    """Stage that writes a candidate into a slot, with the memory that its sample had before."""
    memory_size, impulse = contact_memory(features).size, features.impulse
    hidden = features.box and features.compound

    @stage
    def add_candidate(row, i, old, cursor, count, sample_id, x, y, z, weight):
        """`old`: the list before, `count` long; ids below `cursor` are done.

        Returns the cursor, and whether the sample was in it.
        """
        while cursor < count and old[cursor].sample_id < sample_id:
            cursor += 1
        known = cursor < count and old[cursor].sample_id == sample_id
        row.sample[0, i] = x
        row.sample[1, i] = y
        row.sample[2, i] = z
        row.weight[i] = weight
        for axis in range(3):
            if hidden:  # the slot may have been that of another kind of pair
                row.hidden_offset[axis, i] = 0.0
        for m in range(memory_size):
            row.memory[m, i] = old[cursor].memory[m] if known else 0.0
        if impulse:
            for axis in range(3):
                row.impact_force[axis, i] = 0.0
        return cursor, known

    return add_candidate


@cached_by_features
def make_list_samples(features):
    """Stage that fills the list of a half-pair in one lane."""
    impulse, particles = features.impulse, features.particles
    manifolds = impulse and set(present_kinds(features)) != {PARTICLES}
    per_world_parameters, axial = features.per_world_parameters, features.axial
    add_candidate = make_add_candidate(features)
    grid = features.grid
    separations = make_separations(features)
    distance = by_surface_kind(
        features, lambda kind: None if kind == PARTICLES else core_distance(kind)
    )
    turn = by_surface_kind(features, lambda kind: facing(kind) if kind in FLOORS else None)
    box, cylinder, remembered_face = features.box, features.cylinder, contact_memory(features).face
    entry_face = make_entry_face(features, turn)

    @stage
    def list_samples(model, state, workspace, g, k, i, relative, old_count, first_point, reach):
        """Fills the list, and the manifold points of the impulse law.

        Args:
            model: of the lane group.
            state: of all worlds.
            workspace: of the lane group; `workspace.old` holds the list before.
            g: lane group.
            k: half-pair.
            i: lane.
            relative: the owner in the frame of the surface.
            old_count: length of the list before.
            first_point: row of workspace.manifold at which this half-pair's points begin.
            reach: m, separations up to which samples are listed.

        Returns:
            Length of the list, and m of relative motion for which it stays complete.
        """
        half_pair, old = model.half_pair[k], workspace.old
        first, room = half_pair.first_slot, half_pair.slot_count
        candidate = state.candidate[g, first : first + room]
        ids = state.sample_id[g, first : first + room]
        R, c = relative.rotation, relative.position
        ground = at(half_pair.core[0], i) if half_pair.kind == PLANE else 0.0
        radius, load_share = at(half_pair.radius, i), at(half_pair.load_share, i)
        n = 0
        cursor = 0
        nearest = 1e300
        pairs = particles and half_pair.partner_count > 0
        if not pairs:
            separations(model, half_pair, i, relative, workspace.separation)
        face, face_normals = 0.0, half_pair.face_normals != 0  # 0: not known yet
        faces = (box and half_pair.kind == BOX) or (cylinder and half_pair.kind == CYLINDER)
        faces = faces and face_normals
        for s in range(half_pair.sample_count):
            separation = 0.0 if pairs else workspace.separation[s]
            if not pairs and not separation < reach:
                nearest = min(nearest, separation)
                continue
            sample = model.sample[:, half_pair.first_sample + s]
            sx, sy, sz, weight = sample[0], sample[1], sample[2], load_share * sample[3]
            if per_world_parameters:
                size = at(half_pair.owner_size, i)
                sx, sy, sz = size * sx, size * sy, size * sz
            tx, ty = sx, sy
            if axial and impulse and half_pair.axial != 0:
                core = half_pair.core
                ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                tx, ty = turn(half_pair.kind, sx, sy, sz, R, c, i, ca, cb, cc)
            x = R[0, i] * tx + R[1, i] * ty + R[2, i] * sz + c[0, i]
            y = R[3, i] * tx + R[4, i] * ty + R[5, i] * sz + c[1, i]
            z = R[6, i] * tx + R[7, i] * ty + R[8, i] * sz + c[2, i] - ground
            if pairs:
                for j in range(half_pair.partner_count):
                    p = model.sample[:, half_pair.first_partner + j]
                    px, py, pz = p[0], p[1], p[2]
                    if per_world_parameters:
                        size = at(half_pair.surface_size, i)
                        px, py, pz = size * px, size * py, size * pz
                    ux, uy, uz = x - px, y - py, z - pz
                    separation = math.sqrt(ux * ux + uy * uy + uz * uz) - radius
                    if separation < reach and n == room:
                        state.world[workspace.lane[0].world[i]].overflow = 1
                    elif separation < reach:
                        row, pair_id = candidate[n], s * half_pair.partner_count + j
                        smaller = min(weight, p[3])
                        cursor, _ = add_candidate(
                            row, i, old, cursor, old_count, pair_id, sx, sy, sz, smaller
                        )
                        row.partner[0, i] = px
                        row.partner[1, i] = py
                        row.partner[2, i] = pz
                        ids[n, i] = pair_id
                        n += 1
                    elif separation < nearest:
                        nearest = separation
            else:
                row = candidate[n]
                cursor, known = add_candidate(row, i, old, cursor, old_count, s, sx, sy, sz, weight)
                if faces and not known and separation < 0.0:
                    if face == 0.0:
                        face = entry_face(model, workspace, half_pair, i, relative)
                    row.memory[remembered_face, i] = face
                if manifolds:
                    core = half_pair.core
                    ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                    _, nx, ny, nz = distance(
                        half_pair.kind, x, y, z, ca, cb, cc, radius, face_normals
                    )
                    if grid and half_pair.kind == GRID:
                        size = at(half_pair.surface_size, i)
                        _, nx, ny, nz = grid_distance(model, half_pair.grid, size, x, y, z)
                    add_manifold_point(
                        workspace.manifold[first_point + n],
                        workspace.solid[half_pair.frame],
                        i,
                        x,
                        y,
                        z + ground,
                        nx,
                        ny,
                        nz,
                        separation,
                    )
                ids[n, i] = s
                n += 1
        if n > 0:
            # A list that isn't empty keeps samples that have moved away, which cost as much as
            # those that touch. The impulse law chooses its manifold at each search
            nearest = reach if impulse else min(nearest, _LONGEST_TRAVEL * reach)
        return n, nearest

    return list_samples


@cached_by_features
def make_search(features):
    """Stage that replaces the list of a half-pair in one lane."""
    memory_size, impulse = contact_memory(features).size, features.impulse
    clear, list_samples = make_clear(features), make_list_samples(features)

    @stage
    def search(model, state, workspace, g, k, i, relative, first_point, relative_motion):
        """`relative_motion`: m, upper bound of that of the last drift; others: `list_samples`."""
        half_pair, live = model.half_pair[k], workspace.half_pair[k]
        first, before = half_pair.first_slot, live.count[i]
        c = relative.position
        # bounding spheres, or a bounding sphere over a plane
        if half_pair.kind == PLANE:
            separation = c[2, i] - at(half_pair.core[0], i) - at(half_pair.owner_reach, i)
        else:
            distance = math.sqrt(c[0, i] * c[0, i] + c[1, i] * c[1, i] + c[2, i] * c[2, i])
            separation = distance - at(half_pair.owner_reach, i) - at(half_pair.surface_reach, i)
        if half_pair.partner_count == 0:
            separation = max(separation, separation_bound(half_pair, i, relative))
        reach = at(half_pair.skin, i)
        one, two = workspace.solid[half_pair.owner], workspace.solid[half_pair.surface]
        slow = one.rotation_bound[i] <= at(half_pair.owner_reach, i)
        slow &= (half_pair.kind == PLANE) | (
            two.rotation_bound[i] <= at(half_pair.surface_reach, i)
        )
        # samples that touch by the middle of the next drift have a force in this step, or collide
        # before they overlap; more than `find_impacts` accepts, by more than round-off. Not of
        # springs on bodies that turn by more than a radian: their samples move on no straight line
        straight = impulse | slow
        if straight & (half_pair.partner_count == 0):
            reach = max(reach, 0.5 * relative_motion + 2.0 * TOUCH_TOLERANCE)
        count = 0
        remaining_skin = separation
        if not separation > reach:
            for n in range(before):
                old, row = workspace.old[n], state.candidate[g, first + n]
                old.sample_id = state.sample_id[g, first + n, i]
                for m in range(memory_size):
                    old.memory[m] = row.memory[m, i]
            count, remaining_skin = list_samples(
                model, state, workspace, g, k, i, relative, before, first_point, reach
            )
        for n in range(count, before):
            clear(state.candidate[g, first + n], i)
        live.count[i] = count
        live.remaining_skin[i] = remaining_skin
        if count == 0:
            live.previous_weight[i] = 0.0
            live.previous_impact[i] = 0.0
            live.previous_closing[i] = 0.0
            for c in range(3):
                live.previous_normal[c, i] = 0.0
            live.previous_normal_force[i] = 0.0

    return search

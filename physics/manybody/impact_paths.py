"""The way to the next impact in one world of many bodies, by several threads.

The steps of `step.event_steps`, where such a world would be one lane: all its bodies move to the
time of an impact, those that touch collide, and the rest of the way follows. Only pairs that are
fast and near take part in the search for the time.

`Crowd.path` says how far the way through a substep has been followed.
"""

from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, at, sequence, stage
from physics.impulse.point_impulses import operands_of
from physics.integrators.drift import make_drift
from physics.integrators.kick import make_kick
from physics.manybody.batches import model_of, workspace_of
from physics.manybody.blocks import (
    blocks_of,
    group_model,
    group_workspace,
    make_move_group,
    write_frames,
)
from physics.manybody.impulse_batches import batch_of
from physics.manybody.tables import (
    AGAIN,
    ANGULAR_VELOCITY,
    DISPLACEMENT,
    IMPACTS,
    POSITION,
    ROTATION,
    ROTATION_BOUND,
    TIME,
    VELOCITY,
)
from physics.manybody.team import FAR, MEETING, SAFE, share, smallest, takes_batch, total, wait
from physics.model.features import cached_by_features
from physics.model.workspace import BEGINNING
from physics.motion.drives import make_finger_coupling
from physics.motion.kinematics import make_kinematics
from physics.step.event_steps import (
    MOST_IMPACTS,
    clear_given,
    count_impulses,
    forget_given,
    make_choose,
)
from physics.step.impact_times import MOST, make_evaluate_here
from physics.step.lane_paths import (
    keep_pose,
    make_move,
    make_place_dynamic,
    rest_since_search,
    restore_pose,
    shift_momenta,
)


@stage
def gather_solid(crowd, p, solid, i):
    """Copies the solid at place p, with its momenta and forces, to lane i of another row."""
    frame = crowd.frame[p]
    for c in range(3):
        solid.position[c, i] = frame[POSITION + c]
        solid.velocity[c, i] = frame[VELOCITY + c]
        solid.angular_velocity[c, i] = frame[ANGULAR_VELOCITY + c]
        solid.momentum[c, i] = 0.0
        solid.angular_momentum[c, i] = 0.0
        solid.force[c, i] = 0.0
        solid.torque[c, i] = 0.0
    for c in range(9):
        solid.rotation[c, i] = frame[ROTATION + c]
    if p < crowd.body.shape[0]:
        source, j = crowd.solid[p // LANES], p % LANES
        for c in range(3):
            solid.momentum[c, i] = source.momentum[c, j]
            solid.angular_momentum[c, i] = source.angular_momentum[c, j]
            solid.force[c, i] = source.force[c, j]
            solid.torque[c, i] = source.torque[c, j]
        for c in range(4):
            solid.orientation[c, i] = source.orientation[c, j]


@cached_by_features
def make_choose_pairs(features):
    """Sequence that chooses the pairs of a batch whose impacts are found on the way.

    Returns how many of them may touch in this substep. `begins`: none has been chosen before.
    """
    choose = make_choose(features)

    @sequence
    def choose_pairs(all_model, workspace, crowd, pairs, b, h, begins):
        kind, count = crowd.pair_kind[pairs.kind[b]], 0
        model = bundle(model_of(all_model, kind))
        mine = bundle(workspace_of(workspace, pairs, kind, b, workspace.contact_row, 0, 0))
        for i in range(LANES):
            if begins:
                for k in range(mine.half_pair.shape[0]):
                    mine.timing[k].timed[i] = 0
                    mine.timing[k].impulse[i] = 0.0
            if pairs.first[b, i] >= 0:
                gather_solid(crowd, pairs.first[b, i], workspace.solid[0], i)
                gather_solid(crowd, pairs.second[b, i], workspace.solid[1], i)
                if choose(model, mine, i, h):
                    count += 1
        return count

    return choose_pairs


@stage
def clear_forces(crowd, pairs, b):
    """Clears the mean normal forces of a batch: those of a substep are added up on the way."""
    first = pairs.first_work[b]
    for k in range(first, first + crowd.pair_kind[pairs.kind[b]].half_pair_count):
        for i in range(LANES):
            pairs.work[k].previous_normal_force[i] = 0.0


@cached_by_features
def make_time_pairs(features):
    """Sequence: s until a chosen pair of a batch can touch, at most `left`, and how many do."""
    evaluate, compound_frames = make_evaluate_here(features), make_compound_frames(features)

    @sequence
    def time_pairs(all_model, workspace, crowd, pairs, b, left, h):
        kind = crowd.pair_kind[pairs.kind[b]]
        mine = bundle(workspace_of(workspace, pairs, kind, b, workspace.contact_row, 0, 0))
        chosen = 0
        for k in range(mine.half_pair.shape[0]):
            for i in range(LANES):
                chosen += mine.timing[k].timed[i]
        if chosen == 0:
            return left, 0
        model, earliest, touching = bundle(model_of(all_model, kind)), left, 0
        for i in range(LANES):
            first, second = max(pairs.first[b, i], 0), max(pairs.second[b, i], 0)
            gather_solid(crowd, first, workspace.solid[0], i)
            gather_solid(crowd, second, workspace.solid[1], i)
        compound_frames(model, mine)
        for i in range(LANES):
            if pairs.first[b, i] >= 0:
                safe, _, _, touches = evaluate(model, mine, i, left, h)
                earliest = min(earliest, safe)
                touching += 1 if touches else 0
        return earliest, touching

    return time_pairs


@cached_by_features
def make_expect_motion(features):
    """Sequence that predicts how far the bodies of a group move from `time` s to the end.

    It writes that to their frames, where a search looks for it, and returns how many would leave
    their margin. A body that tumbles can turn faster later on: twice as fast is allowed for.
    """
    place = make_place_dynamic(features)

    @sequence
    def expect_motion(model, workspace, crowd, g, time, h):
        own = bundle(group_model(model, crowd, g))
        mine = bundle(group_workspace(workspace, crowd, g))
        far, left = 0, h - time
        for i in range(LANES):
            place(own, mine, i, 0.5 * time)  # in the middle of the rest
        for m in blocks_of(crowd, g):
            write_frames(crowd, m)
            v, omega, constants = (
                crowd.solid[m].velocity,
                crowd.solid[m].angular_velocity,
                crowd.constants[m],
            )
            for i in range(LANES):
                frame, step = crowd.frame[m * LANES + i], 0.0
                for c in range(3):
                    frame[DISPLACEMENT + c] = left * v[c, i]
                    step += left * abs(v[c, i])
                spin = abs(omega[0, i]) + abs(omega[1, i]) + abs(omega[2, i])
                turns = min(2.0 * left * spin, 2.0)  # no point moves further than across the body
                frame[ROTATION_BOUND] = turns * at(constants.core_reach, i)
                step += frame[ROTATION_BOUND]
                stays = crowd.motion[m, i] + step <= crowd.margin[m, i]  # False of NaN
                far += 0 if stays or crowd.body[m * LANES + i] < 0 else 1
        return far

    return expect_motion


@stage
def note_motion(crowd, g):
    """Adds what the bodies of a group have moved since they last were at rest in `displacement`."""
    for m in blocks_of(crowd, g):
        write_frames(crowd, m)
        solid = crowd.solid[m]
        for i in range(LANES):
            step = solid.rotation_bound[i]
            for c in range(3):
                step += abs(solid.displacement[c, i])
            crowd.motion[m, i] += step


@cached_by_features
def make_follow(features):
    """Sequence that follows the way through a substep, or through the rest of it.

    Returns how many bodies are about to leave their margin, then nothing has moved, and whether the
    bodies are at an impact.
    """
    kick, drift, kinematics = make_kick(features), make_drift(features), make_kinematics(features)
    place, move = make_place_dynamic(features), make_move(features)
    choose_pairs, time_pairs = make_choose_pairs(features), make_time_pairs(features)
    expect_motion = make_expect_motion(features)

    @sequence
    def begin(model, workspace, crowd, g, before, h):
        own = bundle(group_model(model, crowd, g))
        mine = bundle(group_workspace(workspace, crowd, g))
        kick(own, mine, before)
        forget_given(own, mine, h)
        for i in range(LANES):
            clear_given(own, mine, i)

    @sequence
    def find(model, workspace, crowd, pairs, h, time, again, first, last, team):
        """Moves the bodies to the next impact; returns its time in s, and whether there is one."""
        mine = team.shared[team.thread]
        for n in range(MOST):
            for g in range(first, last):
                own = bundle(group_model(model, crowd, g))
                near = bundle(group_workspace(workspace, crowd, g))
                for i in range(LANES):
                    place(own, near, i, time - 0.5 * h)
                for m in blocks_of(crowd, g):
                    write_frames(crowd, m)
            wait(team)
            left = h - time
            mine[SAFE], mine[MEETING] = left, 0.0
            for k in range(crowd.order.shape[0]):
                if takes_batch(k, team):
                    safe, touching = time_pairs(
                        model, workspace, crowd, pairs, crowd.order[k], left, h
                    )
                    mine[SAFE] = min(mine[SAFE], safe)
                    mine[MEETING] += touching
            safe = smallest(team, SAFE)
            if total(team, MEETING) > 0.0 and not (again and n == 0):
                return time, True
            ends = (not safe < left) or n == MOST - 1
            span = left if ends else safe
            for g in range(first, last):
                own = bundle(group_model(model, crowd, g))
                near = bundle(group_workspace(workspace, crowd, g))
                for i in range(LANES):
                    move(own, near, i, time, span, h)
            time += span
            if ends:
                break
        return h, False

    @sequence
    def follow(model, workspace, crowd, pairs, before, h, begins, team):
        """`begins`: a substep, with a kick of `before` s."""
        first, last = share(0, crowd.group.shape[0], team)
        time, impacts, again = crowd.path[TIME], crowd.path[IMPACTS], crowd.path[AGAIN] != 0.0
        wait(team)
        if begins:
            time, impacts, again = 0.0, 0.0, False
        far, mine = 0, team.shared[team.thread]
        for g in range(first, last):
            if begins:
                begin(model, workspace, crowd, g, before, h)
            far += expect_motion(model, workspace, crowd, g, time, h)
        mine[FAR] = far
        if team.thread == 0:
            crowd.path[TIME], crowd.path[IMPACTS] = time, impacts
            crowd.path[AGAIN] = 1.0 if again else 0.0
        if total(team, FAR) > 0.0:
            return 1, False
        mine[MEETING] = 0.0
        for n in range(crowd.order.shape[0]):
            if takes_batch(n, team):
                b = crowd.order[n]
                if impacts == 0.0:
                    clear_forces(crowd, pairs, b)
                mine[MEETING] += choose_pairs(model, workspace, crowd, pairs, b, h, impacts == 0.0)
        on_the_way = total(team, MEETING) > 0.0 or impacts > 0.0
        for g in range(first, last):
            own = bundle(group_model(model, crowd, g))
            near = bundle(group_workspace(workspace, crowd, g))
            for i in range(LANES):
                if on_the_way and impacts == 0.0:
                    keep_pose(own, near, BEGINNING, i)
                rest_since_search(own, near, i)
        meets = False
        if on_the_way and impacts < max(MOST_IMPACTS, crowd.place.shape[0]):
            time, meets = find(model, workspace, crowd, pairs, h, time, again, first, last, team)
        for g in range(first, last):
            own = bundle(group_model(model, crowd, g))
            near = bundle(group_workspace(workspace, crowd, g))
            if meets:
                for i in range(LANES):
                    shift_momenta(own, near, i, time - 0.5 * h)
                    place(own, near, i, 0.0)
            elif impacts == 0.0:  # a way without impacts is that of fixed steps
                for i in range(LANES):
                    if on_the_way:
                        restore_pose(own, near, BEGINNING, i)
                        rest_since_search(own, near, i)
                drift(own, near, h)
            if not meets:
                kinematics(own, near)
            note_motion(crowd, g)
        wait(team)
        if team.thread == 0:
            crowd.path[TIME], crowd.path[IMPACTS] = time, impacts
        wait(team)
        return 0, meets

    return follow


@cached_by_features
def make_advance_bodies(features):
    """Sequence that moves all bodies through a substep; for what it returns see `make_follow`."""
    if features.finds_impacts:
        return make_follow(features)
    move_group = make_move_group(features)

    @sequence
    def advance_bodies(model, workspace, crowd, pairs, before, h, begins, team):
        first, last = share(0, crowd.group.shape[0], team)
        far = 0
        for g in range(first, last):
            far += move_group(model, workspace, crowd, g, before, h)
        team.shared[team.thread, FAR] = far
        return 1 if total(team, FAR) > 0.0 else 0, False

    return advance_bodies


@cached_by_features
def make_leave_impact(features):
    """Sequence after the collisions at an impact: momenta are those of the substep's middle again.

    It notes their impulses, and first contacts.
    """
    couple_fingers = make_finger_coupling(features)

    @sequence
    def leave_impact(all_model, workspace, rows, crowd, pairs, h, began, collided, team):
        """`began`: s, time of the world when the substep began."""
        first, last = share(0, crowd.group.shape[0], team)
        time = crowd.path[TIME]
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if collided and takes_batch(n, team) and pairs.busy[b] != 0:
                tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
                model, mine = bundle(tables), bundle(arrays)
                first_touch = mine.half_pair[0].first_touch
                for k in range(mine.half_pair.shape[0]):
                    points = operands_of(model, mine, k).points
                    for i in range(LANES):
                        impulse = 0.0
                        for p in range(points.shape[0]):
                            impulse += points[p].normal_impact[i]
                        mine.timing[k].impulse[i] += impulse
                        if impulse > 0.0 and not first_touch[i] <= began + time:
                            first_touch[i] = began + time
        for g in range(first, last):
            own = bundle(group_model(all_model, crowd, g))
            near = bundle(group_workspace(workspace, crowd, g))
            couple_fingers(own, near, h)
            for i in range(LANES):
                shift_momenta(own, near, i, 0.5 * h - time)
        wait(team)
        if team.thread == 0:
            crowd.path[IMPACTS] += 1.0
            crowd.path[AGAIN] = 0.0 if collided else 1.0
        wait(team)

    return leave_impact


@stage
def count_batch_impulses(all_model, workspace, crowd, pairs, b, h):
    """Adds the collisions on the way to the mean normal forces of a batch."""
    kind = crowd.pair_kind[pairs.kind[b]]
    mine = bundle(workspace_of(workspace, pairs, kind, b, workspace.contact_row, 0, 0))
    count_impulses(bundle(model_of(all_model, kind)), mine, h)

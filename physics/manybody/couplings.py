"""What couples the bodies of a group while impulses of contacts change velocities.

Velocities stand in `Crowd.frame`. Joints keep the rates that they had, see
`constraints.joint_velocities`, and the fingers of a gripper move as one solid.
"""

from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, sequence, stage
from physics.constraints.joint_velocities import (
    make_begin_hold,
    make_clear_hold,
    make_end_hold,
    make_hold,
)
from physics.manybody.blocks import blocks_of, group_model, group_workspace
from physics.manybody.tables import ANGULAR_VELOCITY, VELOCITY
from physics.manybody.team import share, wait
from physics.model.features import cached_by_features
from physics.motion.drives import CLOSING


@stage
def gather_group_speeds(crowd, g):
    """Copies the velocities of a group's bodies from their frames."""
    for m in blocks_of(crowd, g):
        v, omega = crowd.solid[m].velocity, crowd.solid[m].angular_velocity
        for i in range(LANES):
            frame = crowd.frame[m * LANES + i]
            for c in range(3):
                v[c, i] = frame[VELOCITY + c]
                omega[c, i] = frame[ANGULAR_VELOCITY + c]


@stage
def scatter_group_speeds(crowd, g):
    """The reverse."""
    for m in blocks_of(crowd, g):
        v, omega = crowd.solid[m].velocity, crowd.solid[m].angular_velocity
        for i in range(LANES):
            frame = crowd.frame[m * LANES + i]
            for c in range(3):
                frame[VELOCITY + c] = v[c, i]
                frame[ANGULAR_VELOCITY + c] = omega[c, i]


@stage
def find_in_contact(crowd, pairs, g, mask):
    """Marks the lanes in which a body has contacts; returns how many there are."""
    found = 0
    for i in range(LANES):
        mask[i] = 0
        for m in blocks_of(crowd, g):
            body = m * LANES + i
            for n in range(crowd.incident_first[body], crowd.incident_first[body + 1]):
                home = crowd.incident[n] >> 1
                b, lane = home // LANES, home % LANES
                first = pairs.first_work[b]
                for k in range(first, first + crowd.pair_kind[pairs.kind[b]].half_pair_count):
                    mask[i] = 1 if pairs.work[k].count[lane] > 0 else mask[i]
        found += mask[i]
    return found


@stage
def find_stirred(crowd, g, since, mask):
    """Marks the lanes in which a body has changed its velocity, and stirs all bodies there."""
    found = 0
    for i in range(LANES):
        latest = 0
        for m in blocks_of(crowd, g):
            latest = max(latest, crowd.stirred[m * LANES + i])
        mask[i] = 1 if latest >= since else 0
        found += mask[i]
        if latest >= since:
            for m in blocks_of(crowd, g):
                crowd.stirred[m * LANES + i] = latest
    return found


@cached_by_features
def make_begin_joints(features):
    """Sequence that notes the rates of all joints."""
    begin_hold, clear_hold = make_begin_hold(features), make_clear_hold(features)
    joints = features.joints

    @sequence
    def begin_joints(model, workspace, crowd, clears, limits, motor_time, team):
        """`clears`: their impulses begin at zero; for the next two see `make_begin_hold`."""
        if joints:
            first, last = share(0, crowd.group.shape[0], team)
            for g in range(first, last):
                if crowd.group[g].joint_count > 0:
                    own = bundle(group_model(model, crowd, g))
                    mine = bundle(group_workspace(workspace, crowd, g))
                    gather_group_speeds(crowd, g)
                    if clears:
                        clear_hold(own, mine)
                        crowd.joint_work[g] = 0.0
                    begin_hold(own, mine, limits, motor_time)
            wait(team)

    return begin_joints


@cached_by_features
def make_keep_joints(features):
    """Sequence that restores the rates of joints: in contact, or where something has changed."""
    hold, joints = make_hold(features), features.joints

    @sequence
    def keep_joints(model, workspace, crowd, pairs, since, motor_time, team):
        """`since`: sweep from which on a velocity has changed; -1: all that are in contact."""
        if not joints:
            return
        lane = workspace.lane[0]
        mask = lane.in_contact
        first, last = share(0, crowd.group.shape[0], team)
        for g in range(first, last):
            if crowd.group[g].joint_count == 0:
                continue
            if since < 0:
                found = find_in_contact(crowd, pairs, g, mask)
            else:
                found = find_stirred(crowd, g, since, mask)
            if found > 0:
                own = bundle(group_model(model, crowd, g))
                mine = bundle(group_workspace(workspace, crowd, g))
                gather_group_speeds(crowd, g)
                for i in range(LANES):
                    lane.impact_work[i] = 0.0
                hold(own, mine, mask, motor_time, lane)
                scatter_group_speeds(crowd, g)
                for i in range(LANES):
                    crowd.joint_work[g] += lane.impact_work[i]
        wait(team)

    return keep_joints


@cached_by_features
def make_end_joints(features):
    """Sequence that adds the joints' impulses to the momenta; or over h > 0 s to the forces."""
    end_hold, joints = make_end_hold(features), features.joints

    @sequence
    def end_joints(model, workspace, crowd, h, team):
        if joints:
            first, last = share(0, crowd.group.shape[0], team)
            for g in range(first, last):
                if crowd.group[g].joint_count > 0:
                    own = bundle(group_model(model, crowd, g))
                    mine = bundle(group_workspace(workspace, crowd, g))
                    end_hold(own, mine, h)

    return end_joints


@stage
def couple_fingers(crowd, g):
    """Makes one solid of the fingers of a group's grippers, except along the closing axis."""
    for m in blocks_of(crowd, g):
        partner = crowd.constants[m].gripper_partner
        other = crowd.group[g].first_block + partner
        if partner >= 0 and other > m:
            for i in range(LANES):
                p, q = m * LANES + i, other * LANES + i
                latest = max(crowd.stirred[p], crowd.stirred[q])  # both change their velocities
                crowd.stirred[p], crowd.stirred[q] = latest, latest
                one, two = crowd.frame[p], crowd.frame[q]
                for c in range(3):
                    if c != CLOSING:
                        mean = 0.5 * (one[VELOCITY + c] + two[VELOCITY + c])
                        one[VELOCITY + c] = mean
                        two[VELOCITY + c] = mean

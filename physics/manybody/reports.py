"""What touches what in a world of many bodies, computed by the step's own stages."""

from typing import Any, NamedTuple

import numpy as np

from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, factory, large_entry, stage
from physics.impulse.contact_rows import make_contact_rows
from physics.manybody.batches import (
    gather_pose,
    gather_velocity,
    has_candidates,
    mark_lanes,
    model_of,
    state_of,
    workspace_of,
)
from physics.manybody.impulse_batches import gather_tensors
from physics.model.features import Features
from physics.model.state import QUERY
from physics.motion.vectors import rotated
from physics.scene.shapes import PLANE
from physics.spring.contacts import make_half_pair

Array = np.ndarray

# one row per candidate that touches; vectors in the world frame
TOUCH = np.dtype(
    [
        ("half_pair", "i8"),  # row of the table of all kinds of pairs
        ("owner", "i8"),  # place of the solid with the sample
        ("surface", "i8"),
        ("penetration", "f8"),  # m
        ("point", "f8", (3,)),  # m
        ("normal", "f8", (3,)),
        ("force", "f8", (3,)),  # N on the owner
        ("weight", "f8"),
        ("first_touch", "f8"),  # s, since the two are near each other
    ],
    align=True,
)


class ReportArrays(NamedTuple):
    """Working memory and results of a report.

    Attributes:
        rows: [most slots of a kind] of contact_loop.REPORT.
        points: [most slots of a kind] of CONTACT_ROW.
        found: [n] of TOUCH.
    """

    rows: Array
    points: Array
    found: Array


@factory
def make_touching(features: Features) -> Any:
    """Entry point: the touching candidates of a world, and their number."""
    impulse, compound_frames = features.impulse, make_compound_frames(features)
    half_pair = make_contact_rows(features) if impulse else make_half_pair(features, True)

    @stage
    def write(found, frame, rotation, origin, i, x, y, z, nx, ny, nz, fx, fy, fz):
        """Writes vectors in the world frame; `frame`: they are in one with this rotation."""
        if frame:
            x, y, z = rotated(rotation, i, x, y, z)
            nx, ny, nz = rotated(rotation, i, nx, ny, nz)
            fx, fy, fz = rotated(rotation, i, fx, fy, fz)
            x, y, z = x + origin[0, i], y + origin[1, i], z + origin[2, i]
        found.point[0], found.point[1], found.point[2] = x, y, z
        found.normal[0], found.normal[1], found.normal[2] = nx, ny, nz
        found.force[0], found.force[1], found.force[2] = fx, fy, fz

    @large_entry
    def touching(all_model, state, workspace, crowd, pairs, arrays):
        """Rows beyond the length of `arrays.found` are counted only."""
        all_model, state, workspace = bundle(all_model), bundle(state), bundle(workspace)
        crowd, pairs = bundle(crowd), bundle(pairs)
        count, room = 0, arrays.found.shape[0]
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            kind = crowd.pair_kind[pairs.kind[b]]
            model = bundle(model_of(all_model, kind))
            points = arrays.points
            mine = bundle(workspace_of(workspace, pairs, kind, b, points, 0, points.shape[0]))
            own = bundle(state_of(state, pairs, kind, b))
            if not has_candidates(mine):
                continue
            mark_lanes(workspace.lane[0], pairs.first[b], False)
            for side in range(2):
                places = pairs.first[b] if side == 0 else pairs.second[b]
                gather_pose(crowd.frame, places, workspace.solid[side])
                gather_velocity(crowd.frame, places, workspace.solid[side])
            if impulse:
                gather_tensors(crowd, pairs, b, workspace)
            compound_frames(model, mine)
            for k in range(mine.half_pair.shape[0]):
                live, constants = mine.half_pair[k], model.half_pair[k]
                if live.slots == 0:
                    continue
                kept, live.first_row = live.first_row, 0
                if impulse:  # the impulse of one second is the force
                    half_pair(model, own, mine, 0, k, workspace.lane[0].updates_memory, 1.0)
                else:
                    half_pair(model, own, mine, arrays.rows, 0, k, 0.0, QUERY)
                live.first_row = kept
                frame, owner = workspace.solid[constants.frame], workspace.solid[constants.owner]
                surface = workspace.solid[constants.surface]
                for slot in range(live.slots):
                    for i in range(LANES):
                        if slot >= live.count[i]:
                            continue
                        if impulse:
                            point = points[slot]
                            row = own.candidate[0, constants.first_slot + slot]
                            ix, iy, iz = rotated(
                                surface.rotation, i, row.impact_force[0, i],
                                row.impact_force[1, i], row.impact_force[2, i],
                            )  # fmt: skip
                            hit = abs(ix) + abs(iy) + abs(iz) > 0.0
                            depth, weight = -point.separation[i], point.weight[i]
                        else:
                            out = arrays.rows[constants.first_slot + slot]
                            hit = False
                            depth, weight = out.penetration[i], out.weight[i]
                        if weight <= 0.0 or not (depth > 0.0 or hit):
                            continue
                        if count < room:
                            found = arrays.found[count]
                            found.half_pair = kind.first_half_pair + k
                            ends = pairs.first[b, i], pairs.second[b, i]
                            found.owner = ends[0] if constants.owner == 0 else ends[1]
                            found.surface = ends[1] if constants.owner == 0 else ends[0]
                            found.penetration, found.weight = depth, weight
                            found.first_touch = mine.half_pair[0].first_touch[i]
                            if impulse:
                                size, t = point.normal_impulse[i], point.tangential_impulse
                                x, y, z = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                                p, a = owner.position, point.arm
                                write(
                                    found, False, frame.rotation, frame.position, i,
                                    p[0, i] + a[0, i], p[1, i] + a[1, i], p[2, i] + a[2, i],
                                    x, y, z, ix + size * x + t[0, i], iy + size * y + t[1, i],
                                    iz + size * z + t[2, i],
                                )  # fmt: skip
                            else:
                                p, a, f = out.point, out.normal, out.force
                                write(
                                    found, constants.kind != PLANE, frame.rotation,
                                    frame.position, i, p[0, i], p[1, i], p[2, i],
                                    a[0, i], a[1, i], a[2, i], f[0, i], f[1, i], f[2, i],
                                )  # fmt: skip
                        count += 1
        return count

    return touching

"""Contacts of a world: what touches what, where and how hard; computed by the step's kernels."""

import functools
from typing import Any

import numpy as np

from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, factory, large_entry
from physics.impulse.contact_rows import make_contact_rows
from physics.model.contacts import ContactTable
from physics.model.features import Features
from physics.model.lanes import load, make_constants
from physics.model.state import FIRST_POSITION, FIRST_TOUCH, NORMAL_FORCE, QUERY, State
from physics.model.tables import Model
from physics.model.workspace import Workspace
from physics.motion.kinematics import make_kinematics, write_drive_frames, write_static_frames
from physics.rotation import rotation_matrix
from physics.scene.shapes import PLANE
from physics.spring.contact_loop import REPORT
from physics.spring.contacts import make_half_pair

Array = np.ndarray


@factory
def _make_report(features: Features) -> Any:
    """Entry point: evaluates every candidate of a lane group at its present state."""
    constants, kinematics = make_constants(features), make_kinematics(features)
    compound_frames = make_compound_frames(features)
    impulse = features.impulse
    half_pair = make_contact_rows(features) if impulse else make_half_pair(features, True)

    @large_entry
    def report(group, state, workspace, chosen, rows):
        state, workspace = bundle(state), bundle(workspace)
        model = bundle(constants(group, 0))
        write_static_frames(model, workspace)
        load(model, state, workspace, chosen, 0)
        write_drive_frames(model, workspace)
        kinematics(model, workspace)
        compound_frames(model, workspace)
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                if impulse:
                    # the impulse of one second is the force
                    half_pair(model, state, workspace, 0, k, workspace.lane[0].updates_memory, 1.0)
                else:
                    half_pair(model, state, workspace, rows, 0, k, 0.0, QUERY)

    return report


def _rows_of_group(model: Model, features: Features, state: State, group: int) -> Array:
    """[slots] of REPORT: every slot of a lane group.

    Vectors are in the frame of the half-pair's surface. With the impulse law they are in the world
    frame, and points are relative to the owner.
    """
    places = slice(group * LANES, (group + 1) * LANES)
    lanes = np.flatnonzero(state.resident[places] >= 0)
    worlds, resident = state.resident[places][lanes], np.full(LANES, -1)
    resident[lanes] = np.arange(len(lanes))
    alone = slice(group, group + 1)
    copied = State(
        dynamic=state.dynamic[worlds],  # a copy, as all of these
        half_pair=state.half_pair[worlds],
        touch=state.touch[..., worlds].copy(),  # worlds come last in memory
        world=state.world[worlds],
        sample_id=state.sample_id[alone].copy(),
        candidate=state.candidate[alone].copy(),  # their memory must not change
        wrench=state.wrench[worlds] if state.wrench.size else state.wrench,
        motor=state.motor[worlds],
        pace=state.pace[worlds] if state.pace.size else state.pace,
        place=lanes,
        resident=resident,
        servo=state.servo[worlds] if state.servo.size else state.servo,
    )
    rows = np.zeros(state.candidate.shape[1], REPORT)
    everyone = np.ones(len(copied.world), dtype=bool)
    workspace = Workspace.of(model.of_world(0), features)
    _make_report(features)(model.of_group(group), copied, workspace, everyone, rows)
    if features.impulse:
        points = workspace.contact_row
        rows["penetration"], rows["weight"] = -points["separation"], points["weight"]
        rows["point"], rows["normal"] = points["arm"], points["normal"]
        normal_impulses = points["normal_impulse"][:, None] * points["normal"]
        rows["force"] = points["tangential_impulse"] + normal_impulses
    return rows


def table(model: Model, features: Features, state: State, worlds: Array) -> ContactTable:
    """What touches in the worlds [n] of these indices, at least one."""
    if not state.candidate.shape[1]:  # nothing can touch
        return ContactTable.empty()
    groups = state.place[worlds] // LANES
    found = [
        _of_group(model, features, state, int(group), worlds[groups == group])
        for group in np.unique(groups)
    ]
    return ContactTable.join(found)


def _of_group(
    model: Model, features: Features, state: State, group: int, worlds: Array
) -> ContactTable:
    """What touches in worlds [n] of one lane group."""
    rows, lanes = _rows_of_group(model, features, state, group), state.place[worlds] % LANES
    own = model.dynamic.ndim > 1  # whether worlds have parameters of their own
    models = [model.of_world(int(world)) for world in (worlds if own else worlds[:1])]
    half_pairs = models[0].half_pair
    half_pair = np.repeat(np.arange(len(half_pairs)), half_pairs["slot_count"])
    place = np.arange(len(half_pair)) - half_pairs["first_slot"][half_pair]
    touching = rows["penetration"][:, lanes] > 0.0
    if "impact_force" in (state.candidate.dtype.names or ()):
        # an impact may come up to half a step before the solids touch
        touching |= state.candidate["impact_force"][group][:, :, lanes].any(axis=1)
    touching &= rows["weight"][:, lanes] > 0.0  # 0 where another part of a compound hides a face
    touching &= place[:, None] < state.half_pair["count"][worlds][:, half_pair].T
    touching &= state.world["diverged"][worlds] == 0
    of, slot = np.nonzero(touching.T)
    lane, half_pair = lanes[of], half_pair[slot]

    dynamic, static, part = state.dynamic[worlds], models[0].static, models[0].compound_part
    ends = np.stack([half_pairs["owner"], half_pairs["surface"]], axis=-1)[half_pair]
    frame = half_pairs["frame"][half_pair]
    everywhere = (len(worlds), len(static))
    centers = np.concatenate(
        [dynamic["position"], np.broadcast_to(static[:, :3], (*everywhere, 3))], axis=1
    )
    turns = np.concatenate(
        [dynamic["orientation"], np.broadcast_to(static[:, 3:], (*everywhere, 4))], axis=1
    )
    turns = rotation_matrix(turns)
    # compound parts have frames too
    at, places = part["solid"], np.stack([m.compound_part["position"] for m in models])
    centers = np.concatenate(
        [centers, centers[:, at] + np.einsum("wnij,wnj->wni", turns[:, at], places)], axis=1
    )
    turns = np.concatenate([turns, turns[:, at] @ part["rotation"].reshape(-1, 3, 3)], axis=1)
    plane = half_pairs["kind"][half_pair] == PLANE
    in_world_frame = features.impulse | plane[:, None]
    origin = centers[of, ends[:, 0]] if features.impulse else centers[of, frame]
    if not features.impulse:
        origin = np.where(in_world_frame, 0.0, origin)

    def rotated(vectors: Array, by: Array) -> Array:
        return np.einsum("nij,nj->ni", turns[of, by], vectors)

    def in_world(name: str) -> Array:
        vectors = rows[name][slot, :, lane]
        return np.where(in_world_frame, vectors, rotated(vectors, frame))

    force = in_world("force")
    if features.impulse:
        force = force + rotated(state.candidate["impact_force"][group, slot, :, lane], ends[:, 1])
    stiffness = np.stack([m.half_pair["stiffness"] for m in models])
    kinds, kind = np.unique(half_pair, return_inverse=True)
    return ContactTable(
        world=worlds[of],
        pair=ends,
        point=in_world("point") + origin,
        normal=in_world("normal"),
        penetration=rows["penetration"][slot, lane],
        force=force,
        first_touch=_first_touches(state, half_pairs)[half_pair, worlds[of]],
        weight=rows["weight"][slot, lane],
        stiffness=stiffness[of % len(models), half_pair],
        kind=kind,
        coefficients=list(half_pairs[kinds]),
    )


def _first_touches(state: State, half_pairs: Array) -> Array:
    """[half-pairs, worlds] s, when the two solids of each half-pair first touched."""
    ends = np.sort(np.stack([half_pairs["owner"], half_pairs["surface"]], axis=-1), axis=-1)
    _, pair = np.unique(ends, axis=0, return_inverse=True)
    touches = state.touch[:, FIRST_TOUCH, : len(state.world)]
    first = np.full((pair.max(initial=-1) + 1, touches.shape[1]), np.nan)
    np.fmin.at(first, pair.ravel(), touches)
    return first[pair.ravel()]


def first_touch(state: State, half_pairs: Array) -> Array:
    """When two solids first touched, [w] s, NaN before; by the half-pairs between them."""
    touches = state.touch[:, FIRST_TOUCH, : len(state.world)]
    return np.asarray(functools.reduce(np.fmin, touches[half_pairs]))


def first_touch_position(state: State, half_pairs: Array) -> Array:
    """Position of the first of two solids at their first touch, [w, 3] m, NaN before."""
    first, count = first_touch(state, half_pairs), len(state.world)
    found = np.full((3, count), np.nan)
    for k in reversed(half_pairs):
        places = state.touch[k, FIRST_POSITION:, :count]
        np.copyto(found, places, where=state.touch[k, FIRST_TOUCH, :count] == first)
    return found.T


def normal_force(state: State, half_pairs: Array) -> Array:
    """Sum of the normal forces between two solids in the last step, [w] N."""
    normal_forces = state.touch[:, NORMAL_FORCE, : len(state.world)]
    return np.asarray(functools.reduce(np.add, normal_forces[half_pairs]))


def between(model: Model, first: int, second: int) -> Array:
    """Which half-pairs are between two solids, [k] bools."""
    ends = np.sort(np.stack([model.half_pair["owner"], model.half_pair["surface"]], axis=-1))
    return np.asarray((ends == sorted((first, second))).all(axis=-1))


def samples(model: Model, solid: int) -> tuple[Array, float | Array]:
    """Points with which a solid touches others: [n, 3] m in its frame, and their radius in m.

    For a compound whose samples have different radii, their radii [n].
    """
    half_pair = model.half_pair
    for at, other, first, count in (
        ("owner", "surface", "first_sample", "sample_count"),
        ("surface", "owner", "first_partner", "partner_count"),
    ):
        rows = half_pair[(half_pair[at] == solid) & (half_pair[count] > 0)]
        if not len(rows):
            continue
        # the same points are tested against every other solid, and every part of it
        rows = rows[(rows[other] == rows[other][0]) & (rows["frame"] == rows["frame"][0])]
        points = [model.sample[:3, row[first] : row[first] + row[count]].T for row in rows]
        radii = rows["owner_radius"] if at == "owner" else rows["radius"] - rows["owner_radius"]
        if len(rows) == 1:
            return points[0].copy(), float(radii[0])
        return np.concatenate(points), np.repeat(radii, rows[count])
    return np.zeros((0, 3)), 0.0

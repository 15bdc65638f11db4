"""Contacts of a world: what touches what, where and how hard; computed by the step's kernels."""

import functools
from typing import Any, NamedTuple

import numpy as np

from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, factory, large_entry
from physics.impulse.contact_rows import make_contact_rows
from physics.model.contacts import Contacts
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


class Report(NamedTuple):
    """Touching candidates of one world, in the world frame.

    Attributes:
        half_pair: [n] of the model.
        penetration: [n] m.
        point: [n, 3] m.
        normal: [n, 3].
        force: [n, 3] N on the owner of the half-pair.
        weight: [n] of the sample.
    """

    half_pair: Array
    penetration: Array
    point: Array
    normal: Array
    force: Array
    weight: Array


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


def _touching(model: Model, state: State, world: int, rows: Array) -> tuple[Array, Array]:
    """Half-pair [n] and slot [n] of what touches in a world."""
    half_pair = np.repeat(np.arange(len(model.half_pair)), model.half_pair["slot_count"])
    place = np.arange(len(half_pair)) - model.half_pair["first_slot"][half_pair]
    group, lane = divmod(state.place[world], LANES)
    touching = rows["penetration"][:, lane] > 0.0
    if "impact_force" in (state.candidate.dtype.names or ()):
        # an impact may come up to half a step before the solids touch
        touching |= state.candidate["impact_force"][group, :, :, lane].any(axis=-1)
    touching &= rows["weight"][:, lane] > 0.0  # 0 where another part of a compound hides a face
    touching &= place < state.half_pair["count"][world, half_pair]
    touching &= state.world["diverged"][world] == 0
    return half_pair[touching], np.flatnonzero(touching)


def report(model: Model, features: Features, state: State, world: int) -> Report:
    """What touches in a world."""
    group, lane = divmod(int(state.place[world]), LANES)
    rows = _rows_of_group(model, features, state, group)
    model = model.of_world(world)
    half_pair, slot = _touching(model, state, world, rows)

    statics, dynamic = model.static, state.dynamic[world]
    centers = np.concatenate([dynamic["position"], statics[:, :3]])
    turns = rotation_matrix(np.concatenate([dynamic["orientation"], statics[:, 3:]]))
    # compound parts have frames too
    at, place = model.compound_part["solid"], model.compound_part["position"]
    centers = np.concatenate([centers, centers[at] + np.einsum("nij,nj->ni", turns[at], place)])
    turns = np.concatenate([turns, turns[at] @ model.compound_part["rotation"].reshape(-1, 3, 3)])
    surface, frame = model.half_pair["surface"][half_pair], model.half_pair["frame"][half_pair]
    plane = model.half_pair["kind"][half_pair] == PLANE
    in_world_frame = features.impulse | plane[:, None]
    origin = centers[model.half_pair["owner"][half_pair]] if features.impulse else centers[frame]
    if not features.impulse:
        origin = np.where(in_world_frame, 0.0, origin)

    def rotated(vectors: Array, by: Array) -> Array:
        return np.einsum("nij,nj->ni", turns[by], vectors)

    def in_world(name: str) -> Array:
        vectors = rows[name][slot, :, lane]
        return np.where(in_world_frame, vectors, rotated(vectors, frame))

    force = in_world("force")
    if features.impulse:
        force = force + rotated(state.candidate["impact_force"][group, slot, :, lane], surface)
    return Report(
        half_pair=half_pair,
        penetration=rows["penetration"][slot, lane],
        point=in_world("point") + origin,
        normal=in_world("normal"),
        force=force,
        weight=rows["weight"][slot, lane],
    )


def contacts(
    model: Model, features: Features, state: State, world: int, names: tuple[str, ...]
) -> Contacts:
    """The touching points of one world, whose solids have these names."""
    found = report(model, features, state, world)
    model = model.of_world(world)
    half_pair = model.half_pair[found.half_pair]
    pair = np.stack([half_pair["owner"], half_pair["surface"]], axis=-1)
    first = {
        ends: first_touch(state, np.flatnonzero(between(model, *ends)))[world]
        for ends in set(map(tuple, pair))
    }
    return Contacts(
        pair=pair,
        names=tuple((names[first], names[second]) for first, second in pair),
        point=found.point,
        normal=found.normal,
        penetration=found.penetration,
        force=found.force,
        first_touch=np.array([first[ends] for ends in map(tuple, pair)]),
    )


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


def penetration(model: Model, features: Features, state: State) -> Array:
    """Deepest penetration of each world now, [w] m, 0 where nothing touches."""
    deepest = np.zeros(len(state.world))
    half_pairs = model.of_world(0)
    for group in range(len(state.candidate)):
        rows = _rows_of_group(model, features, state, group)
        for lane, world in enumerate(state.resident[group * LANES : (group + 1) * LANES]):
            if world >= 0:
                slot = _touching(half_pairs, state, world, rows)[1]
                deepest[world] = rows["penetration"][slot, lane].max(initial=0.0)
    return deepest

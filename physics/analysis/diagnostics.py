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
from physics.motion.kinematics import make_kinematics, write_drive_frames, write_static_frames
from physics.rotation import rotation_matrix
from physics.scene.shapes import PLANE
from physics.spring.contact_loop import REPORT
from physics.spring.contacts import make_half_pair
from physics.step.simulation import Simulation
from physics.step.threads import run_in_blocks

Array = np.ndarray


@factory
def _make_report(features: Features) -> Any:
    """Entry point: evaluates every candidate of some lane groups at their present states."""
    constants, kinematics = make_constants(features), make_kinematics(features)
    compound_frames = make_compound_frames(features)
    impulse = features.impulse
    half_pair = make_contact_rows(features) if impulse else make_half_pair(features, True)

    @large_entry
    def report(all_model, state, workspace, chosen, groups, rows, first, last):
        """Writes rows [groups, slots] of REPORT, for groups first <= n < last."""
        state, workspace = bundle(state), bundle(workspace)
        for n in range(first, last):
            g, found = groups[n], rows[n]
            model = bundle(constants(all_model, g))
            if load(model, state, workspace, chosen, g) == 0:
                continue
            write_static_frames(model, workspace)
            write_drive_frames(model, workspace)
            kinematics(model, workspace)
            compound_frames(model, workspace)
            lane = workspace.lane[0]
            for i in range(LANES):
                lane.updates_memory[i] = 0
            for k in range(model.half_pair.shape[0]):
                live, slot = workspace.half_pair[k], model.half_pair[k].first_slot
                if live.slots == 0:
                    continue
                # what contacts remember stays: with springs the step of 0 s restores it
                if not impulse:
                    half_pair(model, state, workspace, found, g, k, 0.0, QUERY)
                    continue
                # the impulse of one second is the force
                half_pair(model, state, workspace, g, k, lane.updates_memory, 1.0)
                for s in range(slot, slot + live.slots):
                    point, row = workspace.contact_row[s], found[s]
                    for i in range(LANES):
                        row.penetration[i], row.weight[i] = -point.separation[i], point.weight[i]
                        for c in range(3):
                            row.point[c, i], row.normal[c, i] = point.arm[c, i], point.normal[c, i]
                            row.force[c, i] = (
                                point.normal_impulse[i] * point.normal[c, i]
                                + point.tangential_impulse[c, i]
                            )
        return 0

    return report


def table(simulation: Simulation, worlds: Array) -> ContactTable:
    """What touches in the worlds [n] of these indices."""
    state, features, model = simulation.state, simulation.features, simulation.model
    if not state.candidate.shape[1]:  # nothing can touch
        return ContactTable.empty()
    groups, group = np.unique(state.place[worlds] // LANES, return_inverse=True)
    rows, lane = _rows(simulation, worlds, groups), state.place[worlds] % LANES
    one = model.of_world(0)
    half_pairs = one.half_pair
    half_pair = np.repeat(np.arange(len(half_pairs)), half_pairs["slot_count"])
    place = np.arange(len(half_pair)) - half_pairs["first_slot"][half_pair]
    touching = rows["penetration"][group, :, lane] > 0.0  # [worlds, slots], as below
    if features.impulse:
        # an impact may come up to half a step before the solids touch
        impact_force = state.candidate["impact_force"][groups]
        touching |= impact_force[group, :, :, lane].any(axis=-1)
    touching &= rows["weight"][group, :, lane] > 0.0  # 0: another part of a compound hides a face
    touching &= place < state.half_pair["count"][worlds][:, half_pair]
    touching &= (state.world["diverged"][worlds] == 0)[:, None]
    of, slot = np.nonzero(touching)
    group, lane, world, half_pair = group[of], lane[of], worlds[of], half_pair[slot]

    ends = np.stack([half_pairs["owner"], half_pairs["surface"]], axis=-1)
    pair, frame = ends[half_pair], half_pairs["frame"][half_pair]
    centers, turns = _frames(model, one, state, worlds)
    in_world_frame = features.impulse | (half_pairs["kind"][half_pair] == PLANE)[:, None]

    def rotated(vectors: Array, by: Array) -> Array:
        return np.einsum("nij,nj->ni", turns[of, by], vectors)

    def in_world(name: str) -> Array:
        vectors = rows[name][group, slot, :, lane]
        return np.where(in_world_frame, vectors, rotated(vectors, frame))

    force, origin = in_world("force"), np.where(in_world_frame, 0.0, centers[of, frame])
    if features.impulse:  # points are relative to the owner
        origin = centers[of, pair[:, 0]]
        force = force + rotated(impact_force[group, slot, :, lane], pair[:, 1])
    return ContactTable(
        world=world,
        pair=pair,
        point=in_world("point") + origin,
        normal=in_world("normal"),
        penetration=rows["penetration"][group, slot, lane],
        force=force,
        first_touch=_first_touches(state, ends, worlds)[half_pair, of],
        weight=rows["weight"][group, slot, lane],
        stiffness=_of_worlds(model.half_pair, "stiffness", world, half_pair),
        kind=half_pair,
        coefficients=model.of_world(int(worlds[0])).half_pair,
    )


def _rows(simulation: Simulation, worlds: Array, groups: Array) -> Array:
    """[groups, slots] of REPORT: every slot of lane groups, of the worlds [n].

    Vectors are in the frame of the half-pair's surface. With the impulse law they are in the world
    frame, and points are relative to the owner.
    """
    model, state = simulation.model, simulation.state
    rows = np.zeros((len(groups), state.candidate.shape[1]), REPORT)
    chosen = np.zeros(simulation.count, dtype=bool)
    chosen[worlds] = True
    kernel = _make_report(simulation.features)

    def run(first: int, last: int) -> int:
        workspace = simulation.take_workspace()
        kernel(model, state, workspace, chosen, groups, rows, first, last)
        simulation.return_workspace(workspace)
        return 0

    run_in_blocks(run, len(groups), simulation.threads)
    return rows


def _frames(model: Model, one: Model, state: State, worlds: Array) -> tuple[Array, Array]:
    """Centres [n, frames, 3] m and rotations [n, frames, 3, 3] of solids and of compound parts.

    `one`: the model of one world.
    """
    dynamic, static = state.dynamic[worlds], one.static
    statics = np.broadcast_to(static, (len(worlds), *static.shape))
    centers = np.concatenate([dynamic["position"], statics[..., :3]], axis=1)
    turns = rotation_matrix(np.concatenate([dynamic["orientation"], statics[..., 3:]], axis=1))
    parts, at = one.compound_part, one.compound_part["solid"]
    every = np.broadcast_to(np.arange(len(parts)), (len(worlds), len(parts)))
    places = _of_worlds(model.compound_part, "position", worlds[:, None], every)
    places = centers[:, at] + np.einsum("wnij,wnj->wni", turns[:, at], places)
    own = turns[:, at] @ parts["rotation"].reshape(-1, 3, 3)
    return np.concatenate([centers, places], axis=1), np.concatenate([turns, own], axis=1)


def _of_worlds(table: Array, name: str, world: Array, row: Array) -> Array:
    """A field of rows of a model's table, each in a world, if the field differs between worlds."""
    if table.ndim == 1:
        return np.asarray(table[name][row])
    group, lane = np.divmod(world, LANES)
    return np.asarray(np.moveaxis(table[name], -1, 1)[group, lane, row])


def _first_touches(state: State, ends: Array, worlds: Array) -> Array:
    """[half-pairs, n] s, when the two solids of each half-pair first touched.

    `ends`: [half-pairs, 2] their solids.
    """
    _, pair = np.unique(np.sort(ends, axis=-1), axis=0, return_inverse=True)
    first = np.full((pair.max() + 1, len(worlds)), np.nan)
    np.fmin.at(first, pair.ravel(), state.touch[:, FIRST_TOUCH][:, worlds])
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

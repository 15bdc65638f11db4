"""Numbers that a user can ask of any world: energy, momentum, overlap, contacts."""

import functools
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.collision.compound_frames import make_parts
from physics.impulse.contact_rows import make_points
from physics.jit import LANES, SOURCES, entry
from physics.model.features import Features
from physics.model.lanes import load, make_constants
from physics.model.rocking import point_jacobian
from physics.model.state import FIRST_POSITION, FIRST_TOUCH, PRESSED, State
from physics.model.tables import Model
from physics.model.workspace import Work
from physics.motion.kinematics import make_kinematics, place_statics, place_tools
from physics.rotation import rotation_matrix
from physics.scene.shapes import PLANE
from physics.spring.contacts import REPORT, make_side

Array = np.ndarray


class Contacts(NamedTuple):
    """Touching points of one world, n of them, in the world frame.

    Attributes:
        pair: [n, 2] the two solids: bodies first, then drives, then statics, each in scene order.
        point: [n, 3] m, the middle of the overlap; on a ground, the sample's lowest.
        normal: [n, 3] unit vector from the second solid to the first.
        overlap: [n] m; negative where solids collided up to half a step before they touch.
        force: [n, 3] N on the first solid; the second feels the opposite. A collision of the
            impulse law counts as its mean over the substep.
        first_touch: [n] s, when the two first touched since their state was last set.
    """

    pair: Array
    point: Array
    normal: Array
    overlap: Array
    force: Array
    first_touch: Array


class Report(NamedTuple):
    """Touching candidates of one world, in the world frame.

    Attributes:
        side: [n] of the model.
        overlap: [n] m.
        point: [n, 3] m.
        normal: [n, 3].
        force: [n, 3] N on the owner of the side.
        weight: [n] of the sample.
    """

    side: Array
    overlap: Array
    point: Array
    normal: Array
    force: Array
    weight: Array


@cache
def _make_report(features: Features) -> Any:
    """Entry point that evaluates every candidate of a group of worlds at its present state."""
    sources = SOURCES
    constants, kinematics = make_constants(features), make_kinematics(features)
    parts = make_parts(features)
    impulse = features.impulse
    side = make_points(features) if impulse else make_side(features, True)

    @entry
    def report(group, state, work, chosen, rows):
        _ = sources
        model = constants(group, 0)
        place_statics(model, work)
        load(model, state, work, chosen, 0)
        place_tools(model, work)
        kinematics(model, work)
        parts(model, work)
        for k in range(model.side.shape[0]):
            if work.side[k].slots > 0:
                if impulse:
                    # the impulse of one second is the force
                    side(model, state, work, 0, k, work.lane[0].keeps, 1.0)
                else:
                    side(model, state, work, rows, 0, k, 0.0)

    return report


def _rows_of_group(model: Model, features: Features, state: State, group: int) -> Array:
    """[slots] of REPORT, every slot of a group, by the kernels of the step.

    Vectors are in the frame of the side's surface; of the impulse law in the world's, and points
    relative to the owner.
    """
    worlds = slice(group * LANES, (group + 1) * LANES)
    alone = slice(group, group + 1)
    copied = State(
        mover=state.mover[worlds].copy(),
        side=state.side[worlds].copy(),
        touch=state.touch[..., worlds].copy(),
        world=state.world[worlds].copy(),
        sample_id=state.sample_id[alone].copy(),
        candidate=state.candidate[alone].copy(),  # contacts remember; a look leaves no trace
    )
    rows = np.zeros(state.candidate.shape[1], REPORT)
    everyone = np.ones(len(copied.world), dtype=bool)
    work = Work.of(model.of_world(0), features)
    _make_report(features)(model.of_group(group), copied, work, everyone, rows)
    if features.impulse:
        rows["overlap"], rows["weight"] = -work.point["gap"], work.point["weight"]
        rows["point"], rows["normal"] = work.point["arm"], work.point["normal"]
        rows["force"] = work.point["pull"] + work.point["push"][:, None] * work.point["normal"]
    return rows


def _touching(model: Model, state: State, world: int, rows: Array) -> tuple[Array, Array]:
    """Side [n] and slot [n] of what touches in a world."""
    side = np.repeat(np.arange(len(model.side)), model.side["slot_count"])
    place = np.arange(len(side)) - model.side["first_slot"][side]
    overlap = rows["overlap"][:, world % LANES]
    meets = overlap > 0.0
    seen = rows["weight"][:, world % LANES] > 0.0  # what a compound's other part hides isn't
    if "blow" in (state.candidate.dtype.names or ()):  # an impulse may come up to half a step early
        meets |= state.candidate["blow"][world // LANES, :, :, world % LANES].any(axis=-1)
    touching = (place < state.side["count"][world, side]) & meets & seen
    touching &= state.world["diverged"][world] == 0
    return side[touching], np.flatnonzero(touching)


def report(model: Model, features: Features, state: State, world: int) -> Report:
    """What touches in a world."""
    rows, lane = _rows_of_group(model, features, state, world // LANES), world % LANES
    model = model.of_world(world)
    side, slot = _touching(model, state, world, rows)

    statics, mover = model.static, state.mover[world]
    centers = np.concatenate([mover["position"], statics[:, :3]])
    turns = rotation_matrix(np.concatenate([mover["orientation"], statics[:, 3:]]))
    # a part of a compound has a frame of its own
    at, place = model.part["solid"], model.part["position"]
    centers = np.concatenate([centers, centers[at] + np.einsum("nij,nj->ni", turns[at], place)])
    turns = np.concatenate([turns, turns[at] @ model.part["rotation"].reshape(-1, 3, 3)])
    surface, frame = model.side["surface"][side], model.side["frame"][side]
    in_place = features.impulse | (model.side["kind"][side] == PLANE)[:, None]  # a plane is too
    origin = centers[model.side["owner"][side]] if features.impulse else centers[frame]
    if not features.impulse:
        origin = np.where(in_place, 0.0, origin)

    def turned(vectors: Array, by: Array) -> Array:
        return np.einsum("nij,nj->ni", turns[by], vectors)

    def in_world(name: str) -> Array:
        vectors = rows[name][slot, :, lane]
        return np.where(in_place, vectors, turned(vectors, frame))

    force = in_world("force")
    if features.impulse:
        force = force + turned(state.candidate["blow"][world // LANES, slot, :, lane], surface)
    return Report(
        side=side,
        overlap=rows["overlap"][slot, lane],
        point=in_world("point") + origin,
        normal=in_world("normal"),
        force=force,
        weight=rows["weight"][slot, lane],
    )


def contacts(model: Model, features: Features, state: State, world: int) -> Contacts:
    """The touching points of one world."""
    told = report(model, features, state, world)
    model = model.of_world(world)
    side = model.side[told.side]
    pair = np.stack([side["owner"], side["surface"]], axis=-1)
    first = {
        ends: first_touch(state, np.flatnonzero(between(model, *ends)))[world]
        for ends in set(map(tuple, pair))
    }
    return Contacts(
        pair=pair,
        point=told.point,
        normal=told.normal,
        overlap=told.overlap,
        force=told.force,
        first_touch=np.array([first[ends] for ends in map(tuple, pair)]),
    )


def first_touch(state: State, sides: Array) -> Array:
    """When two solids first touched, [w] s, NaN before, by the sides between them."""
    touches = state.touch[:, FIRST_TOUCH, : len(state.world)]
    return np.asarray(functools.reduce(np.fmin, touches[sides]))


def first_touch_position(state: State, sides: Array) -> Array:
    """Where the first of two solids was then, [w, 3] m, NaN before."""
    first, count = first_touch(state, sides), len(state.world)
    found = np.full((3, count), np.nan)
    for k in reversed(sides):
        places = state.touch[k, FIRST_POSITION:, :count]
        np.copyto(found, places, where=state.touch[k, FIRST_TOUCH, :count] == first)
    return found.T


def pressing(state: State, sides: Array) -> Array:
    """Sum of the normal forces between two solids in the last step, [w] N."""
    pressed = state.touch[:, PRESSED, : len(state.world)]
    return np.asarray(functools.reduce(np.add, pressed[sides]))


def between(model: Model, first: int, second: int) -> Array:
    """Which sides lie between two solids, [k] bools."""
    ends = np.sort(np.stack([model.side["owner"], model.side["surface"]], axis=-1))
    return np.asarray((ends == sorted((first, second))).all(axis=-1))


def samples(model: Model, solid: int) -> tuple[Array, float | Array]:
    """Points with which a solid touches others: [n, 3] m in its frame, and their radius in m.

    Of a compound whose samples differ in it, their radii [n].
    """
    side = model.side
    for at, other, first, count in (
        ("owner", "surface", "first_sample", "sample_count"),
        ("surface", "owner", "first_partner", "partner_count"),
    ):
        rows = side[(side[at] == solid) & (side[count] > 0)]
        if not len(rows):
            continue
        # the same points meet every other solid, and every part of it
        rows = rows[(rows[other] == rows[other][0]) & (rows["frame"] == rows["frame"][0])]
        points = [model.sample[:3, row[first] : row[first] + row[count]].T for row in rows]
        radii = rows["owner_radius"] if at == "owner" else rows["radius"] - rows["owner_radius"]
        if len(rows) == 1:
            return points[0].copy(), float(radii[0])
        return np.concatenate(points), np.repeat(radii, rows[count])
    return np.zeros((0, 3)), 0.0


def penetration(model: Model, features: Features, state: State) -> Array:
    """Deepest overlap of each world now, [w] m, 0 where nothing touches."""
    deepest = np.zeros(len(state.world))
    sides = model.of_world(0)
    for group in range(len(state.candidate)):
        rows = _rows_of_group(model, features, state, group)
        for world in range(group * LANES, min((group + 1) * LANES, len(deepest))):
            slot = _touching(sides, state, world, rows)[1]
            deepest[world] = rows["overlap"][slot, world % LANES].max(initial=0.0)
    return deepest


def contact_shares(
    model: Model, features: Features, state: State, world: int
) -> dict[int, tuple[Array, Array, Array]]:
    """How a world's present contacts share their side's unit stiffness, by side.

    Returns:
        For each side that touches three matrices [6 m, 6 m]: along the normals, across them, and
        of relative turns.
        Coordinates are each mover's displacement, then its rotation vector, in the world frame.
    """
    told = report(model, features, state, world)
    model = model.of_world(world)
    movers = len(model.mover)
    shares: dict[int, tuple[Array, Array, Array]] = {}
    for k, point, normal, weight in zip(
        told.side, told.point, told.normal, told.weight, strict=True
    ):
        constants = model.side[k]
        jacobian, spin = np.zeros((2, 3, 6 * movers))
        for solid, sign in ((constants["owner"], 1.0), (constants["surface"], -1.0)):
            if solid < movers:
                arm = point - state.mover["position"][world, solid]
                columns = slice(6 * solid, 6 * solid + 6)
                jacobian[:, columns] = sign * point_jacobian(arm)
                spin[:, 6 * solid + 3 : 6 * solid + 6] = sign * np.eye(3)
        along = jacobian.T @ np.outer(normal, normal) @ jacobian
        across = jacobian.T @ jacobian - along
        along_k, across_k, turn_k = shares.get(int(k), (0.0, 0.0, 0.0))
        turn = weight * spin.T @ spin
        shares[int(k)] = (along_k + weight * along, across_k + weight * across, turn_k + turn)
    return shares


def inverse_masses(model: Model, state: State, world: int) -> Array:
    """Inverse mass matrix [6 m, 6 m] in the coordinates of `contact_shares`."""
    movers = len(model.mover)
    M = np.zeros((6 * movers, 6 * movers))
    turn = rotation_matrix(state.mover["orientation"][world])
    inertia = np.einsum("mij,mj,mkj->mik", turn, model.mover["inverse_inertia"], turn)
    for i in range(movers):
        M[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = model.mover["inverse_mass"][i] * np.eye(3)
        M[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = inertia[i]
    return M

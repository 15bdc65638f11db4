"""Numbers that a user can ask of any world: energy, momentum, overlap, contacts."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.features import Features
from physics.jit import LANES, SOURCES, entry
from physics.model import Model
from physics.rotation import rotation_matrix
from physics.shapes import PLANE
from physics.stages.contacts import (
    REPORT,
    REPORT_FORCE,
    REPORT_NORMAL,
    REPORT_OVERLAP,
    REPORT_POINT,
    REPORT_WEIGHT,
    make_side,
)
from physics.stages.kinematics import make_kinematics, place_statics
from physics.state import Scratch, State

Array = np.ndarray


class Contacts(NamedTuple):
    """Touching points of one world, n of them, in the world frame.

    Attributes:
        pair: [n, 2] the two solids: bodies first, then drives, then statics, each in scene order.
        point: [n, 3] m, the middle of the overlap.
        normal: [n, 3] unit vector from the second solid to the first.
        overlap: [n] m.
        force: [n, 3] N on the first solid; the second feels the opposite.
        first_touch: [n] s, when the two first touched since their state was last set.
    """

    pair: Array
    point: Array
    normal: Array
    overlap: Array
    force: Array
    first_touch: Array


class Report(NamedTuple):
    """Touching candidates of one world: side [n], and a row [n, REPORT] each, world frame."""

    side: Array
    rows: Array


@cache
def _make_report(features: Features) -> Any:
    """Entry point that evaluates every candidate of a world at its present state."""
    sources = SOURCES
    kinematics = make_kinematics(features)
    side = make_side(features, True)

    @entry
    def report(model, state, scratch, w, side_of):
        _ = sources
        frame, rel, rows, _old = scratch
        place_statics(model, frame)
        kinematics(model, state, frame, w)
        n = 0
        for k in range(model.side.shape[0]):
            count = state.side[w, k].count
            if count > 0:
                # room for whole chunks: a padded lane writes too, and is written over
                side(model, state, frame, rel, rows[n:], w, k, 0.0)
                for _c in range(count):
                    side_of[n] = k
                    n += 1
        return n

    return report


def report(model: Model, features: Features, state: State, world: int) -> Report:
    """What touches in a world, from the same kernels as the step, without a trace left behind."""
    per_world = state.lanes.size // len(state.world)
    only = slice(world, world + 1)
    one = State(
        mover=state.mover[only].copy(),
        side=state.side[only].copy(),
        world=state.world[only].copy(),
        sample_id=state.sample_id[only].copy(),
        lanes=state.lanes[world * per_world : (world + 1) * per_world].copy(),
    )
    room = one.sample_id.shape[1] + LANES
    side_of, rows = np.zeros(room, dtype=np.int64), np.zeros((room, REPORT))
    scratch = Scratch.of(model, rows)
    count = _make_report(features)(model, one, scratch, 0, side_of)
    touching = np.flatnonzero(rows[:count, REPORT_OVERLAP] > 0.0)
    side_of, rows = side_of[touching], rows[touching]

    # rows come in the frame of the side's surface
    movers = len(model.mover)
    statics = model.static
    centers = np.concatenate([one.mover["position"][0], statics[:, :3]])
    turns = rotation_matrix(np.concatenate([one.mover["orientation"][0], statics[:, 3:]]))
    surface = model.side["surface"][side_of]
    plane = model.side["kind"][side_of] == PLANE
    assert not np.any(plane & (surface < movers))
    turn = turns[surface]
    for column in (REPORT_POINT, REPORT_NORMAL, REPORT_FORCE):
        block = rows[:, column : column + 3]
        rows[:, column : column + 3] = np.einsum("nij,nj->ni", turn, block)
    # a plane's frame has the world's axes and lies under the owner's centre
    rows[:, REPORT_POINT : REPORT_POINT + 3] += centers[surface]
    rows[plane, REPORT_POINT + 2] += model.side["core"][side_of[plane], 0]
    return Report(side_of, rows)


def contacts(model: Model, features: Features, state: State, world: int) -> Contacts:
    """The touching points of one world."""
    side, rows = report(model, features, state, world)
    return Contacts(
        pair=np.stack([model.side["owner"][side], model.side["surface"][side]], axis=-1),
        point=rows[:, REPORT_POINT : REPORT_POINT + 3],
        normal=rows[:, REPORT_NORMAL : REPORT_NORMAL + 3],
        overlap=rows[:, REPORT_OVERLAP],
        force=rows[:, REPORT_FORCE : REPORT_FORCE + 3],
        first_touch=state.side["first_touch"][world, side],
    )


def penetration(model: Model, features: Features, state: State) -> Array:
    """Deepest overlap of each world now, [w] m, 0 where nothing touches."""
    return np.array(
        [
            report(model, features, state, w).rows[:, REPORT_OVERLAP].max(initial=0.0)
            for w in range(len(state.world))
        ]
    )


def contact_stiffness(
    model: Model, features: Features, state: State, world: int
) -> tuple[Array, Array]:
    """Stiffness and damping matrices [6 m, 6 m] of a world's present contacts and servos.

    Coordinates are each mover's displacement, then its rotation vector, in the world frame. The
    damping is the tangential one and the servos'; that along the normal takes no more than the
    approach speed and limits no step.
    """
    side, rows = report(model, features, state, world)
    movers = len(model.mover)
    K, C = np.zeros((6 * movers, 6 * movers)), np.zeros((6 * movers, 6 * movers))
    for k, row in zip(side, rows, strict=True):
        constants = model.side[k]
        normal = row[REPORT_NORMAL : REPORT_NORMAL + 3]
        jacobian = np.zeros((3, 6 * movers))
        for solid, sign in ((constants["owner"], 1.0), (constants["surface"], -1.0)):
            if solid < movers:
                r = row[REPORT_POINT : REPORT_POINT + 3] - state.mover["position"][world, solid]
                cross = np.array([[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]])
                jacobian[:, 6 * solid : 6 * solid + 3] = sign * np.eye(3)
                jacobian[:, 6 * solid + 3 : 6 * solid + 6] = sign * cross
        along = np.outer(normal, normal)
        across = (np.eye(3) - along) * (constants["friction"] > 0.0)
        weight = row[REPORT_WEIGHT]
        stiffness = constants["stiffness"] * along + constants["shear_stiffness"] * across
        K += weight * jacobian.T @ stiffness @ jacobian
        C += weight * jacobian.T @ (constants["shear_damping"] * across) @ jacobian
    for m, constants in enumerate(model.mover):
        block = slice(6 * m, 6 * m + 3)
        K[block, block] += constants["servo_stiffness"] * np.eye(3)
        C[block, block] += constants["servo_damping"] * np.eye(3)
    return K, C


def inverse_masses(model: Model, state: State, world: int) -> Array:
    """Inverse mass matrix [6 m, 6 m] in the coordinates of `contact_stiffness`."""
    movers = len(model.mover)
    M = np.zeros((6 * movers, 6 * movers))
    turn = rotation_matrix(state.mover["orientation"][world])
    inertia = np.einsum("mij,mj,mkj->mik", turn, model.mover["inverse_inertia"], turn)
    for i in range(movers):
        M[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = model.mover["inverse_mass"][i] * np.eye(3)
        M[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = inertia[i]
    return M

"""Reports: what touches in a heap, where and how hard, computed by the stages of the step."""

from functools import cache
from typing import Any

import numpy as np

from physics.compiler.jit import entry, stage
from physics.granular.body_pass import LOAD, make_body_pass
from physics.granular.pair_forces import (
    BLOCK,
    FORCE,
    NORMAL,
    PENETRATION,
    POINT_ARM,
    filter_touching,
    make_compute,
    make_pack,
)
from physics.granular.static_forces import make_static_force
from physics.granular.tables import (
    CENTER,
    EVALUATION,
    INVERSE_MASS,
    MOTION,
    PARITY,
    SLABS,
    WEIGHT,
    Constants,
    Heap,
    HeapFeatures,
    Scratch,
)
from physics.model.features import cached_by_features

Array = np.ndarray

# one row per contact
ROW = np.dtype(
    [
        ("owner", "i8"),  # place
        ("other", "i8"),  # place, or number of bodies and statics before it
        ("point", "f8", (3,)),
        ("normal", "f8", (3,)),
        ("penetration", "f8"),
        ("force", "f8", (3,)),
    ],
    align=True,
)


@cached_by_features
def make_report_pairs(features: HeapFeatures) -> Any:
    """Stage that writes the contacts between bodies, and returns how many there are."""
    history = features.history
    pack, compute = make_pack(features), make_compute(features)

    @stage
    def report_pairs(heap, constants, scratch, rows):
        found, evaluation = 0, heap.counts[EVALUATION]
        current, room = heap.counts[PARITY] % heap.pair.shape[0], heap.pair.shape[2]
        particle = heap.particle.reshape(4 * heap.particle.shape[0])
        motion = heap.motion.reshape(MOTION * heap.motion.shape[0])
        sample = heap.particle[0, 3], heap.motion[0, INVERSE_MASS], heap.motion[0, WEIGHT]
        block, touching = scratch.block[0], scratch.touching[0]
        for slab in range(SLABS):
            pair = heap.pair[current, slab].reshape(2 * room)
            begin, shear = slab * room, particle
            if history:
                shear = heap.shear[current, begin : begin + room].reshape(4 * room)
            count = filter_touching(particle, pair, heap.pair_count[current, slab], touching)
            for first in range(0, count, BLOCK):
                here = min(BLOCK, count - first)
                pack(
                    particle, motion, heap.body_of, constants, block, touching, pair, shear, first,
                    here, evaluation,
                )  # fmt: skip
                compute(constants, sample, block, here, 0.0)
                for n in range(here):
                    k, row = touching[first + n], rows[found]
                    a, b = heap.body_of[pair[2 * k]], heap.body_of[pair[2 * k + 1]]
                    row.owner, row.other = a, b
                    row.penetration = block[PENETRATION * BLOCK + n]
                    for c in range(3):
                        arm = block[(POINT_ARM + c) * BLOCK + n]
                        row.point[c] = heap.motion[a, CENTER + c] + arm
                        row.normal[c] = block[(NORMAL + c) * BLOCK + n]
                        row.force[c] = block[(FORCE + c) * BLOCK + n]
                    found += 1
        return found

    return report_pairs


@cached_by_features
def make_report_statics(features: HeapFeatures) -> Any:
    """Stage that appends the contacts with statics."""
    history, some = features.history, len(features.kinds) > 0
    static_force: Any = make_static_force(features) if some else None

    @stage
    def report_statics(heap, constants, rows, found):
        if some:
            evaluation = heap.counts[EVALUATION]
            current, room = heap.counts[PARITY] % heap.wall.shape[0], heap.wall.shape[2]
            for slab in range(SLABS):
                for entry_of in range(heap.wall_count[current, slab]):
                    n, s = (
                        heap.wall[current, slab, entry_of, 0],
                        heap.wall[current, slab, entry_of, 1],
                    )
                    sx = sy = sz = 0.0
                    if history:
                        shear = heap.wall_shear[current, slab * room + entry_of]
                        if shear[3] == evaluation:
                            sx, sy, sz = shear[0], shear[1], shear[2]
                    depth, nx, ny, nz, ax, ay, az, fx, fy, fz, _, _, _, _ = static_force(
                        heap, constants, n, s, 0.0, sx, sy, sz
                    )
                    if depth > 0.0:
                        row, a = rows[found], heap.body_of[n]
                        row.owner, row.other = a, heap.order.shape[0] + s
                        row.penetration = depth
                        row.normal[0], row.normal[1], row.normal[2] = nx, ny, nz
                        row.force[0], row.force[1], row.force[2] = fx, fy, fz
                        row.point[0] = heap.motion[a, CENTER] + ax
                        row.point[1] = heap.motion[a, CENTER + 1] + ay
                        row.point[2] = heap.motion[a, CENTER + 2] + az
                        found += 1
        return found

    return report_statics


@cache
def make_report(features: HeapFeatures) -> Any:
    """Entry point: writes rows [contacts] of ROW at the present state; returns how many."""
    body_pass = make_body_pass(features)
    report_pairs, report_statics = make_report_pairs(features), make_report_statics(features)

    @entry
    def report(heap, constants, scratch, states, rows):
        for slab in range(SLABS):
            body_pass(heap, constants, scratch, states, 0, slab, LOAD, 0.0, 0)
        found = report_pairs(heap, constants, scratch, rows)
        return report_statics(heap, constants, rows, found)

    return report


def touching_rows(
    heap: Heap, constants: Constants, scratch: Scratch, features: HeapFeatures, states: Array
) -> Array:
    """Rows [n] of ROW of a heap whose list is valid, with indices of solids.

    Args:
        heap: of the world.
        constants: of the scene.
        scratch: working memory.
        features: of the kernels.
        states: [bodies] of DYNAMIC_STATE.
    """
    current, walls = heap.counts[PARITY] % len(heap.pair), heap.counts[PARITY] % len(heap.wall)
    room = heap.pair_count[current].sum() + heap.wall_count[walls].sum()
    rows = np.zeros(int(room), ROW)
    rows = rows[: make_report(features)(heap, constants, scratch, states, rows)]
    bodies = len(heap.order)
    solid_of = np.concatenate([heap.order, np.arange(bodies, bodies + len(constants.static))])
    for end in ("owner", "other"):
        rows[end] = solid_of[rows[end]]
    return rows

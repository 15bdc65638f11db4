"""Model: the constants of a scene at a fidelity, as arrays that kernels read.

Movers are the bodies, then the drives. Solids and sides: see `layout`.

Worlds that are all alike share one row a mover and side. Where they are varied, each group of
worlds has rows of its own, in which the fields that differ hold a value for each lane; kernels read
both by `at`, and nothing of it remains in the code for worlds that are alike.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from physics.jit import LANES, aligned_zeros
from physics.model.coefficients import of_movers, of_parts, of_sides
from physics.model.features import GENERAL, ISOTROPIC, NO_ROTATION, Features
from physics.model.pairs import Layout
from physics.model.tables import (
    COVER,
    MOVER,
    MOVER_VARIES,
    PART,
    PART_VARIES,
    SIDE,
    SIDE_VARIES,
    Model,
)
from physics.scene.fidelity import Fidelity
from physics.scene.internal_faces import Cover, covers
from physics.scene.parameters import Parameters
from physics.scene.scene import NO_TURN, Body, Ground, Scene
from physics.scene.shapes import BOX, CAPSULE, PARTICLES, PLANE, SPHERE, Samples, Sphere

Array = np.ndarray


def _spread(dtype: np.dtype, fields: Sequence[str]) -> np.dtype:
    """The rows of a group of worlds: these fields with an entry for each lane."""
    assert dtype.names is not None
    assert dtype.fields is not None
    entries = []
    for name in dtype.names:
        field = dtype.fields[name][0]
        shape = (*field.shape, LANES) if name in fields else field.shape
        entries.append((name, field.base, shape))
    return np.dtype(entries, align=True)


def build(scene: Scene, fidelity: Fidelity, varied: bool = False) -> tuple[Model, Features]:
    """The arrays of a scene at a fidelity, and the features that it needs.

    With `varied` they are those for worlds with parameters of their own, see `spread`.
    """
    layout = Layout.of(scene, fidelity)
    own = Parameters.of(scene)
    movers, (parts, hidden), (sides, samples) = (
        _mover_rows(scene),
        _part_rows(layout),
        _side_rows(layout),
    )
    for rows, columns in (
        (movers, of_movers(layout, own)),
        (sides, of_sides(layout, own)),
        (parts, of_parts(layout, own)),
    ):
        for name, values in columns.items():
            rows[name] = values[0]
    poses = [
        (0.0, 0.0, 0.0, *NO_TURN) if isinstance(s, Ground) else (*s.position, *s.orientation)
        for s in scene.statics
    ]
    static = np.array(poses, dtype=float).reshape(-1, 7)
    model = Model(movers, sides, parts, hidden, static, samples)
    return model, _features(scene, fidelity, model, varied)


def spread(model: Model, count: int) -> Model:
    """The same model with rows of its own for each group of `count` worlds, all still alike."""
    tables = []
    for rows, fields in (
        (model.mover, MOVER_VARIES),
        (model.side, SIDE_VARIES),
        (model.part, PART_VARIES),
    ):
        table = aligned_zeros((-(-count // LANES), len(rows)), _spread(rows.dtype, fields))
        for name in rows.dtype.names or ():
            table[name] = rows[name][..., None] if name in fields else rows[name]
        tables.append(table)
    return model._replace(mover=tables[0], side=tables[1], part=tables[2])


def vary(model: Model, layout: Layout, worlds: Array, p: Parameters) -> None:
    """Writes what follows from the parameters [n, bodies] of the worlds [n] into a spread model."""
    group, lane = np.divmod(worlds, LANES)
    tables = (
        (model.mover, of_movers(layout, p)),
        (model.side, of_sides(layout, p)),
        (model.part, of_parts(layout, p)),
    )
    for table, columns in tables:
        for name, values in columns.items():
            table[name][group, ..., lane] = values


def _mover_rows(scene: Scene) -> Array:
    """All rows of MOVER: what doesn't follow from parameters."""
    rows = np.zeros(len(scene.bodies) + len(scene.tools), dtype=MOVER)
    rows["turns"][: len(scene.bodies)] = 1
    rows["twin"] = -1
    for row, drive in zip(rows[len(scene.bodies) :], scene.tools, strict=True):
        row["servo_stiffness"] = drive.mass * drive.frequency**2
        row["servo_damping"] = 2.0 * drive.damping_ratio * drive.mass * drive.frequency
        row["force_limit"] = drive.force_limit
    for index, gripper in scene.grippers:
        first = len(scene.bodies) + index
        rows["twin"][first : first + 2] = first + 1, first
        rows["grip_limit"][first : first + 2] = gripper.grip_limit
    return rows


def _part_rows(layout: Layout) -> tuple[Array, Array]:
    """All rows of PART: what doesn't follow from parameters; and those of COVER."""
    rows = np.zeros(len(layout.parts), dtype=PART)
    hidden: list[Cover] = []
    for solid in dict.fromkeys(solid for solid, _ in layout.parts):
        parts = [part for owner, part in layout.parts if owner == solid]
        own = rows[[owner == solid for owner, _ in layout.parts]]
        for row, part, some in zip(own, parts, covers(parts), strict=True):
            row["solid"], row["rotation"] = solid, part.rotation.ravel()
            row["first_cover"], row["cover_count"] = len(hidden), len(some)
            hidden += some
        rows[[owner == solid for owner, _ in layout.parts]] = own
    return rows, np.array([tuple(cover) for cover in hidden], dtype=COVER)


def _side_rows(layout: Layout) -> tuple[Array, Array]:
    """All rows of SIDE: what doesn't follow from parameters; and the samples."""
    rows = np.zeros(len(layout.sides), dtype=SIDE)
    samples: list[Array] = [np.zeros((0, 4))]
    slots = 0

    def add(some: Samples) -> tuple[int, int]:
        first = sum(len(block) for block in samples)
        samples.append(np.column_stack([some.positions, some.weights]))
        return first, len(some.weights)

    pairs: dict[tuple[int, int], list[int]] = {}
    for k, side in enumerate(layout.sides):
        first, last = sorted((side.owner, side.other))
        pairs.setdefault((first, last), []).append(k)
    row: Any
    for ends in pairs.values():
        rows["next"][ends] = np.roll(ends, -1)
        ways = {layout.sides[k].owner for k in ends}
        rows["mirror"][ends] = ends[::-1] if len(ends) == len(ways) == 2 else -1
    for row, side in zip(rows, layout.sides, strict=True):
        a, b = layout.solids[side.owner], layout.solids[side.other]
        row["owner"], row["surface"], row["kind"] = side.owner, side.other, side.surface.kind
        row["frame"] = side.other if side.part < 0 else len(layout.solids) + side.part
        row["first_sample"], row["sample_count"] = add(side.samples)
        row["extent"] = np.abs(side.samples.positions).max(axis=0, initial=0.0)
        if side.partners is not None:
            row["first_partner"], row["partner_count"] = add(side.partners)
        row["first_slot"], row["slot_count"] = slots, side.capacity
        slots += side.capacity
        row["sharp"] = side.sharp
        if isinstance(a, Body) or isinstance(b, Body):  # nothing else turns
            for name in ("rolling", "spinning"):
                field = f"{name}_resistance"
                row[name] = max(getattr(a.material, field), getattr(b.material, field))
    return rows, np.ascontiguousarray(np.concatenate(samples).T)


def _features(scene: Scene, fidelity: Fidelity, model: Model, varied: bool) -> Features:
    """What of the engine this scene needs."""
    impulse = fidelity.law == "impulse" and len(model.side) > 0
    kinds = set(model.side["kind"].tolist())
    # a body without friction may be given some
    rough = [varied and i < len(scene.bodies) for i in range(len(model.mover) + len(model.static))]
    solids = (*scene.bodies, *scene.tools, *scene.statics)
    rough = [r or s.material.friction > 0.0 for r, s in zip(rough, solids, strict=True)]
    friction = any(rough[side["owner"]] and rough[side["surface"]] for side in model.side)
    # a ball without friction is never turned, and one that doesn't spin needs no orientation
    inert = all(isinstance(b.shape, Sphere) and not any(b.angular_velocity) for b in scene.bodies)
    moments = model.mover["inertia"][: len(scene.bodies)]
    # impulses need every body's tensor in the world frame anyway
    isotropic = bool(np.all(moments == moments[:, :1])) and not impulse
    resistance = bool(np.any(model.side["rolling"] + model.side["spinning"] > 0.0))
    rotation = (
        NO_ROTATION
        if inert and not (friction or resistance)
        else ISOTROPIC
        if isotropic
        else GENERAL
    )
    return Features(
        impulse=impulse,
        dashpot=not impulse and fidelity.damping == "dashpot" and len(model.side) > 0,
        friction=friction,
        viscous=friction and fidelity.friction == "viscous",
        resistance=resistance,
        rotation=rotation,
        plane=PLANE in kinds,
        sphere=SPHERE in kinds,
        box=BOX in kinds,
        capsule=CAPSULE in kinds,
        particles=PARTICLES in kinds,
        drives=bool(scene.drives),
        gripper=bool(scene.grippers),
        compound=len(model.part) > 0,
        varied=varied,
    )

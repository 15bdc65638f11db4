"""Model: the constants of a scene at a fidelity, as arrays that kernels read.

Movers are the bodies, then the drives. Solids and sides: see `layout`.

Worlds that are all alike share one row a mover and side. Where they are varied, each group of
worlds has rows of its own, in which the fields that differ hold a value for each lane; kernels read
both by `at`, and nothing of it remains in the code for worlds that are alike.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from physics.constants import of_movers, of_parts, of_sides
from physics.features import GENERAL, ISOTROPIC, NO_ROTATION, Features
from physics.fidelity import Fidelity
from physics.jit import LANES, aligned_zeros
from physics.layout import Layout
from physics.parameters import Parameters
from physics.scene import NO_TURN, Body, Ground, Scene
from physics.seams import Cover, covers
from physics.shapes import BOX, CAPSULE, PARTICLES, PLANE, SPHERE, Samples, Sphere

Array = np.ndarray
# one row a mover: bodies, then drives. A drive has no inertia: it never turns
MOVER = np.dtype(
    [
        ("turns", "i8"),  # 1 for a body, 0 for a drive
        ("core_reach", "f8"),  # m, farthest point from the centre that turning moves
        ("inverse_mass", "f8"),  # 1/kg
        ("inertia", "f8", (3,)),  # kg m^2, principal moments; infinite for drives
        ("inverse_inertia", "f8", (3,)),  # 1/(kg m^2); 0 for drives
        ("weight", "f8", (3,)),  # N; 0 for drives, whose carriage carries them
        ("servo_stiffness", "f8"),  # N/m
        ("servo_damping", "f8"),  # N s/m
        ("force_limit", "f8"),  # N along each axis
        ("twin", "i8"),  # the other finger of a gripper, or -1
        ("grip_limit", "f8"),  # N between the two
    ],
    align=True,
)

# one row a side: the samples of an owner against the surface of another solid
SIDE = np.dtype(
    [
        ("owner", "i8"),  # solid that carries the samples
        ("surface", "i8"),  # solid whose surface they meet
        ("frame", "i8"),  # row of Work.solid in whose frame that surface lies
        ("kind", "i8"),  # of that surface
        ("mirror", "i8"),  # the side of the same pair the other way round, or -1
        ("next", "i8"),  # the next side of the same pair, after the last the first
        ("first_sample", "i8"),  # into Model.sample
        ("sample_count", "i8"),
        ("extent", "f8", (3,)),  # m at size 1, of the samples along the axes of the owner's frame
        ("first_partner", "i8"),  # likewise, the particles of a particle surface
        ("partner_count", "i8"),
        ("first_slot", "i8"),  # room for candidates
        ("slot_count", "i8"),
        ("sharp", "i8"),  # 1: corners and edges of a box, which faces push out
        ("core", "f8", (3,)),  # m, parameters of the surface's core
        ("owner_radius", "f8"),  # m, of the samples
        ("radius", "f8"),  # m, of the samples and the surface's rounding together
        ("owner_reach", "f8"),  # m
        ("surface_reach", "f8"),  # m
        ("owner_size", "f8"),  # factor of the samples' positions
        ("surface_size", "f8"),  # likewise of the partners'
        ("share", "f8"),  # of the pair's load, factor of the samples' weights
        ("skin", "f8"),  # m
        ("stiffness", "f8"),  # N/m of a whole face
        ("damping", "f8"),  # the law's coefficient
        ("restitution", "f8"),
        ("rest_speed", "f8"),  # m/s, floor of the impact speed
        ("pair_mass", "f8"),  # kg, reduced mass
        ("owner_inverse_mass", "f8"),  # 1/kg
        ("surface_inverse_mass", "f8"),  # 1/kg; 0 for statics
        ("surface_centre", "f8", (3,)),  # m, centre of mass of the surface's solid, in its frame
        ("yielding", "f8", (3,)),  # 1/(kg m^2), how easily that solid turns, where it counts
        ("shear_stiffness", "f8"),  # N/m
        ("shear_damping", "f8"),  # N s/m
        ("friction", "f8"),
        ("rolling", "f8"),  # m, of the resistance against it
        ("spinning", "f8"),  # m, likewise
        ("twist_stiffness", "f8"),  # N m
        ("twist_damping", "f8"),  # N m s
    ],
    align=True,
)

# one row a part of a compound that has a surface of its own
PART = np.dtype(
    [
        ("solid", "i8"),  # that it belongs to
        ("position", "f8", (3,)),  # m, of its centre in that solid's frame
        ("rotation", "f8", (9,)),  # matrix, row by row: its own frame to that solid's
        ("first_cover", "i8"),  # into Model.cover
        ("cover_count", "i8"),
    ],
    align=True,
)

# one row a rectangle of a part's face that another hides, see `seams.Cover`
COVER = np.dtype(
    [
        ("axis", "i8"),
        ("sign", "f8"),
        ("face", "f8"),  # m at size 1, as the others
        ("low", "f8", (2,)),
        ("high", "f8", (2,)),
    ],
    align=True,
)

# what differs where worlds are varied
MOVER_VARIES = ("core_reach", "inverse_mass", "inertia", "inverse_inertia", "weight")
SIDE_VARIES = (
    "core",
    "owner_radius",
    "radius",
    "owner_reach",
    "surface_reach",
    "owner_size",
    "surface_size",
    "share",
    "skin",
    "stiffness",
    "damping",
    "restitution",
    "rest_speed",
    "pair_mass",
    "owner_inverse_mass",
    "surface_inverse_mass",
    "surface_centre",
    "yielding",
    "shear_stiffness",
    "shear_damping",
    "friction",
    "twist_stiffness",
    "twist_damping",
)
PART_VARIES = ("position",)


class Model(NamedTuple):
    """The constants of a scene.

    Attributes:
        mover: [m] of MOVER; of varied worlds [groups, m], with a value a lane of MOVER_VARIES.
        side: [k] of SIDE; of varied worlds [groups, k], with a value a lane of SIDE_VARIES.
        part: [q] of PART; of varied worlds [groups, q], with a value a lane of PART_VARIES.
        cover: [c] of COVER.
        static: [s, 7] position m and quaternion x y z w of the statics.
        sample: [4, p] x y z in m in the owner's frame at size 1, and weight.
    """

    mover: Array
    side: Array
    part: Array
    cover: Array
    static: Array
    sample: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays: once for all worlds."""
        return sum(array.nbytes for array in self)

    def of_world(self, world: int) -> "Model":
        """The model of one world, by itself."""
        if self.mover.ndim == 1:
            return self
        group, lane = divmod(world, LANES)
        tables = []
        for table, dtype, fields in (
            (self.mover, MOVER, MOVER_VARIES),
            (self.side, SIDE, SIDE_VARIES),
            (self.part, PART, PART_VARIES),
        ):
            rows = np.zeros(table.shape[1], dtype=dtype)
            for name in dtype.names or ():
                values = table[name][group]
                rows[name] = values[..., lane] if name in fields else values
            tables.append(rows)
        return self._replace(mover=tables[0], side=tables[1], part=tables[2])

    def of_group(self, group: int) -> "Model":
        """The model of one group of worlds, as the kernels take it."""
        if self.mover.ndim == 1:
            return self
        alone = slice(group, group + 1)
        return self._replace(mover=self.mover[alone], side=self.side[alone], part=self.part[alone])


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

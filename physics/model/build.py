"""Builds a model: the tables of a scene at a fidelity, and the features that it needs."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from physics.compiler.jit import LANES, aligned_zeros
from physics.model.coefficients import (
    compound_part_columns,
    dynamic_columns,
    half_pair_columns,
)
from physics.model.features import FIXED, GENERAL, ISOTROPIC, NO_ROTATION, Features
from physics.model.fields import field_rows
from physics.model.grids import grid_rows
from physics.model.joints import joint_rows
from physics.model.pairs import Layout
from physics.model.tables import (
    COMPOUND_PART,
    COMPOUND_PART_PER_WORLD,
    DYNAMIC,
    DYNAMIC_PER_WORLD,
    HALF_PAIR,
    HALF_PAIR_PER_WORLD,
    HIDDEN_FACE,
    Model,
)
from physics.scene.drives import Drive
from physics.scene.fidelity import INTEGRATORS, TIME_CONTROLS, Fidelity
from physics.scene.fields import PointSpring, SurfaceDrag
from physics.scene.flush_statics import FlushBox
from physics.scene.internal_faces import HiddenFace, hidden_faces
from physics.scene.mesh import Mesh
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene
from physics.scene.shapes import (
    BOX,
    CAPSULE,
    CYLINDER,
    GRID,
    PARTICLES,
    PLANE,
    SPHERE,
    TORUS,
    Samples,
    Sphere,
)
from physics.scene.solids import Body, Ground
from physics.scene.validation import IDENTITY

Array = np.ndarray


def per_world_dtype(dtype: np.dtype, fields: Sequence[str]) -> np.dtype:
    """The rows of a lane group: these fields with one entry per lane."""
    assert dtype.names is not None
    assert dtype.fields is not None
    entries = []
    for name in dtype.names:
        field = dtype.fields[name][0]
        shape = (*field.shape, LANES) if name in fields else field.shape
        entries.append((name, field.base, shape))
    return np.dtype(entries, align=True)


def build(
    scene: Scene,
    fidelity: Fidelity,
    per_world_parameters: bool = False,
    own_spacing: bool = False,
) -> tuple[Model, Features]:
    """The model of a scene at a fidelity, and the features that it needs.

    The features are those for worlds with `per_world_parameters`, if asked for; the model is that
    of a single world, see `expand_per_world`. `own_spacing`: see `Layout.of`.
    """
    layout, own = Layout.of(scene, fidelity, own_spacing), Parameters.of(scene)
    dynamic = dynamic_rows(scene)
    half_pairs, samples = _half_pair_rows(layout)
    half_pairs["grid"], grids, nodes = grid_rows(layout)
    parts, hidden = _compound_part_rows(layout)
    for rows, columns in (
        (dynamic, dynamic_columns(layout, own)),
        (half_pairs, half_pair_columns(layout, own)),
        (parts, compound_part_columns(layout, own)),
    ):
        for name, values in columns.items():
            rows[name] = values[0]
    poses = [
        (0.0, 0.0, 0.0, *IDENTITY) if isinstance(s, Ground) else (*s.position, *s.orientation)
        for s in scene.statics
    ]
    static = np.array(poses, dtype=float).reshape(-1, 7)
    world = len(dynamic) + len(static) + len(parts)  # row of Workspace.solid
    joints = joint_rows(scene, world)
    tables = (dynamic, half_pairs, parts, hidden, static, samples)
    fields, points = field_rows(scene)
    model = Model(*tables, fields, joints, grids, nodes, points)
    features = _features(scene, fidelity, model, per_world_parameters)
    dynamic["rotation"] = features.rotation
    return model, features


def expand_per_world(model: Model, count: int) -> Model:
    """The same model with rows for each lane group of `count` worlds, all still identical."""
    tables = []
    for rows, fields in (
        (model.dynamic, DYNAMIC_PER_WORLD),
        (model.half_pair, HALF_PAIR_PER_WORLD),
        (model.compound_part, COMPOUND_PART_PER_WORLD),
    ):
        table = aligned_zeros((-(-count // LANES), len(rows)), per_world_dtype(rows.dtype, fields))
        for name in rows.dtype.names or ():
            table[name] = rows[name][..., None] if name in fields else rows[name]
        tables.append(table)
    return model._replace(dynamic=tables[0], half_pair=tables[1], compound_part=tables[2])


def write_per_world(model: Model, layout: Layout, worlds: Array, p: Parameters) -> None:
    """Writes all columns that depend on the parameters [n, bodies] of the worlds [n]."""
    group, lane = np.divmod(worlds, LANES)
    tables = (
        (model.dynamic, dynamic_columns(layout, p)),
        (model.half_pair, half_pair_columns(layout, p)),
        (model.compound_part, compound_part_columns(layout, p)),
    )
    for table, columns in tables:
        for name, values in columns.items():
            table[name][group, ..., lane] = values


def dynamic_rows(scene: Scene) -> Array:
    """Rows of DYNAMIC: the columns that don't depend on parameters."""
    rows = np.zeros(len(scene.bodies) + len(scene.driven_bodies), dtype=DYNAMIC)
    rows["is_body"][: len(scene.bodies)] = 1
    rows["gripper_partner"] = -1
    for row, drive in zip(rows[len(scene.bodies) :], scene.driven_bodies, strict=True):
        row["servo_stiffness"] = drive.mass * drive.frequency**2
        row["servo_damping"] = 2.0 * drive.damping_ratio * drive.mass * drive.frequency
        row["force_limit"] = drive.force_limit
    for index, gripper in scene.grippers:
        first = len(scene.bodies) + index
        rows["gripper_partner"][first : first + 2] = first + 1, first
        rows["grip_limit"][first : first + 2] = gripper.grip_limit
    return rows


def build_dynamic(scene: Scene, fidelity: Fidelity, bodies: Sequence[Body]) -> Array:
    """Rows of DYNAMIC of some bodies under a scene's gravity, without the pairs that they form."""
    alone = Scene(bodies=[replace(body, name=None, density=None) for body in bodies])
    count = len(bodies)
    layout = Layout(
        solids=tuple(bodies), dynamic_count=count, bodies=count, half_pairs=(), parts=(),
        modes=np.ones((count, 2)), leverage=np.zeros(count), rolls=np.zeros(count, dtype=bool),
        gravity=np.array(scene.gravity), fidelity=fidelity,
    )  # fmt: skip
    rows = dynamic_rows(alone)
    for name, values in dynamic_columns(layout, Parameters.of(alone)).items():
        rows[name] = values[0]
    return rows


def _compound_part_rows(layout: Layout) -> tuple[Array, Array]:
    """Rows of COMPOUND_PART: the columns that don't depend on parameters; and of HIDDEN_FACE."""
    rows = np.zeros(len(layout.parts), dtype=COMPOUND_PART)
    hidden: list[HiddenFace] = []
    for solid in dict.fromkeys(solid for solid, _ in layout.parts):
        parts = [part for owner, part in layout.parts if owner == solid]
        own = rows[[owner == solid for owner, _ in layout.parts]]
        shape = parts[0].shape
        found = [list(shape.hidden)] if isinstance(shape, FlushBox) else hidden_faces(parts)
        for row, part, faces in zip(own, parts, found, strict=True):
            row["solid"], row["rotation"] = solid, part.rotation.ravel()
            row["first_hidden_face"], row["hidden_face_count"] = len(hidden), len(faces)
            hidden += faces
        rows[[owner == solid for owner, _ in layout.parts]] = own
    return rows, np.array([tuple(face) for face in hidden], dtype=HIDDEN_FACE)


def _half_pair_rows(layout: Layout) -> tuple[Array, Array]:
    """Rows of HALF_PAIR: the columns that don't depend on parameters; and all samples."""
    rows = np.zeros(len(layout.half_pairs), dtype=HALF_PAIR)
    blocks: list[Array] = [np.zeros((0, 4))]
    slots = 0

    def add(samples: Samples) -> tuple[int, int]:
        first = sum(len(block) for block in blocks)
        blocks.append(np.column_stack([samples.positions, samples.weights]))
        return first, len(samples.weights)

    pairs: dict[tuple[int, int], list[int]] = {}
    for k, half_pair in enumerate(layout.half_pairs):
        first, last = sorted((half_pair.owner, half_pair.other))
        pairs.setdefault((first, last), []).append(k)
    row: Any
    for members in pairs.values():
        rows["next_in_pair"][members] = np.roll(members, -1)
        rows["reverse"][members] = -1
        facing = [k for k in members if not layout.half_pairs[k].inner]
        owners = {layout.half_pairs[k].owner for k in facing}
        if len(facing) == len(owners) == 2:
            rows["reverse"][facing] = facing[::-1]
    for row, half_pair in zip(rows, layout.half_pairs, strict=True):
        owner, surface, part = half_pair.owner, half_pair.other, half_pair.part
        row["owner"], row["surface"] = owner, surface
        row["kind"] = half_pair.surface.kind
        row["frame"] = surface if part < 0 else len(layout.solids) + part
        row["first_sample"], row["sample_count"] = add(half_pair.samples)
        row["extent"] = np.abs(half_pair.samples.positions).max(axis=0, initial=0.0)
        if half_pair.partners is not None:
            row["first_partner"], row["partner_count"] = add(half_pair.partners)
        row["first_slot"], row["slot_count"] = slots, half_pair.capacity
        slots += half_pair.capacity
        row["face_normals"] = half_pair.face_normals
        ends = (layout.solids[owner], layout.solids[surface])
        row["keeps_all"] = any(isinstance(getattr(s, "shape", None), Mesh) for s in ends)
        row["crowding"] = half_pair.crowding
        row["axial"] = half_pair.samples.axial
        row["slide_slope"] = np.inf
        row["driven"] = any(isinstance(solid, Drive) for solid in ends)
        row["impact_tolerance"] = layout.fidelity.impact_tolerance
        for sign, body, other in ((1.0, owner, surface), (-1.0, surface, owner)):
            if body < layout.bodies <= other:
                row["gravity"] = sign * layout.gravity
                if other >= layout.dynamic_count:
                    row["slide_slope"] = layout.modes[body, 1] if layout.rolls[body] else 1.0
        if any(isinstance(solid, Body) for solid in ends):  # nothing else rotates
            for name in ("rolling", "spinning"):
                resistances = [getattr(solid.material, f"{name}_resistance") for solid in ends]
                row[name] = max(resistances)
    return rows, np.ascontiguousarray(np.concatenate(blocks).T)


def couplings(scene: Scene) -> dict[str, bool]:
    """The features of what acts on bodies besides contacts, by name."""
    return {
        "drives": bool(scene.drives),
        "gripper": bool(scene.grippers),
        "fields": bool(scene.fields),
        "surface_drag": any(isinstance(field, SurfaceDrag) for field in scene.fields),
        "joints": bool(scene.joints),
    }


def _features(
    scene: Scene, fidelity: Fidelity, model: Model, per_world_parameters: bool
) -> Features:
    """The parts of the engine that this scene needs."""
    impulse = fidelity.law == "impulse" and len(model.half_pair) > 0
    kinds = set(model.half_pair["kind"].tolist())
    solids = (*scene.bodies, *scene.driven_bodies, *scene.statics)
    rough = [solid.material.friction > 0.0 for solid in solids]
    if per_world_parameters:  # any body may get friction in some world
        rough[: len(scene.bodies)] = [True] * len(scene.bodies)
    friction = any(rough[row["owner"]] and rough[row["surface"]] for row in model.half_pair)
    # nothing rotates a ball without friction; if it has no spin either, it needs no orientation
    inert = all(isinstance(b.shape, Sphere) and not any(b.angular_velocity) for b in scene.bodies)
    inert = inert and not scene.joints
    inert = inert and not any(
        any(f.point) or any(f.to_point) for f in scene.fields if isinstance(f, PointSpring)
    )
    moments = model.dynamic["inertia"][: len(scene.bodies)]
    isotropic = bool(np.all(moments == moments[:, :1]))
    resistance = bool(np.any(model.half_pair["rolling"] + model.half_pair["spinning"] > 0.0))
    rotation = (
        NO_ROTATION
        if inert and not (friction or resistance)
        else ISOTROPIC
        if isotropic
        else GENERAL
    )
    # the normal of a ground is z; statics have normals in all directions
    slope = any(
        np.any(row["gravity"][:2]) or (row["kind"] != PLANE and np.any(row["gravity"]))
        for row in model.half_pair
        if row["slide_slope"] < np.inf
    )
    return Features(
        integrator=INTEGRATORS.index(fidelity.integrator),
        impulse=impulse,
        dashpot=not impulse and fidelity.damping == "dashpot" and len(model.half_pair) > 0,
        friction=friction,
        viscous=friction and fidelity.friction == "viscous",
        slope=slope
        and friction
        and not impulse
        and (fidelity.friction, fidelity.damping) == ("coulomb", "hunt_crossley"),
        lever=bool(np.any(model.half_pair["surface_inverse_inertia"])),
        resistance=resistance,
        rotation=rotation,
        plane=PLANE in kinds,
        sphere=SPHERE in kinds,
        box=BOX in kinds,
        capsule=CAPSULE in kinds,
        particles=PARTICLES in kinds,
        grid=GRID in kinds,
        mesh=bool(np.any(model.half_pair["keeps_all"])),
        cylinder=CYLINDER in kinds,
        torus=TORUS in kinds,
        axial=bool(np.any(model.half_pair["axial"])),
        wrench=False,
        **couplings(scene),
        compound=len(model.compound_part) > 0,
        per_world_parameters=per_world_parameters,
        time_control=TIME_CONTROLS.index(fidelity.time_control) if len(model.half_pair) else FIXED,
        newton=impulse and fidelity.solver == "newton",
    )

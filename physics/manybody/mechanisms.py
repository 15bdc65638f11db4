"""Mechanisms: bodies that joints, grippers or springs couple, and how they stand side by side.

Within a mechanism the stages of a lane group do all the work, as for a small scene. Mechanisms of
the same structure stand in the lanes of one body group, whatever their masses, sizes, anchors and
motors; fields that name bodies must be equal. A body that nothing couples is a mechanism of its
own. Between mechanisms there are only contacts.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from physics.compiler.jit import LANES, aligned_zeros
from physics.manybody.tables import BODY_GROUP
from physics.model.build import dynamic_rows, per_world_dtype
from physics.model.fields import field_rows
from physics.model.groups import Groups
from physics.model.joints import joint_rows, motors
from physics.model.tables import DYNAMIC_PER_WORLD, FIELD, JOINT_ROW, JOINT_ROW_PER_LANE
from physics.scene.drives import Gripper
from physics.scene.fields import Attractor, PointSpring
from physics.scene.scene import Scene

Array = np.ndarray

_LANED_JOINT = per_world_dtype(JOINT_ROW, JOINT_ROW_PER_LANE)


class Mechanisms(NamedTuple):
    """The body groups of a scene, and where each body stands.

    Attributes:
        group: [groups] of BODY_GROUP.
        present: [groups, LANES] see `Crowd.present`, as the next two.
        body: [blocks * LANES].
        place: [dynamic bodies].
        joint_row: of JOINT_ROW with values per lane, of all groups.
        entries: of `Crowd.joint_factor`.
        field: [n] of FIELD, of all groups.
        surface_point: [7, p] see `Model.surface_point`.
        motor: [motors, 2] row and column of `Crowd.motor` of each motor, in scene order.
        checked: of all mechanisms of the same structure and masses the fields of one, and it as a
            scene of its own: what its servos and fields need of a step.
    """

    group: Array
    present: Array
    body: Array
    place: Array
    joint_row: Array
    entries: int
    field: Array
    surface_point: Array
    motor: Array
    checked: tuple[tuple[list[int], Scene], ...]

    @property
    def most_blocks(self) -> int:
        """Of a group."""
        return int(self.group["block_count"].max())


class _One(NamedTuple):
    """One mechanism: what it consists of, and its tables as those of a scene of its own."""

    members: list[int]
    joints: list[int]
    fields: list[int]
    scene: Scene
    dynamic: Array
    joint_row: Array
    field: Array
    surface_point: Array

    @property
    def structure(self) -> Any:
        """What mechanisms side by side have in common."""
        shared = [name for name in self.dynamic.dtype.names or () if name not in DYNAMIC_PER_WORLD]
        rows = [name for name in JOINT_ROW.names or () if name not in JOINT_ROW_PER_LANE]
        return (
            *(self.dynamic[name].tobytes() for name in shared),
            *(self.joint_row[name].tobytes() for name in rows),
            self.field.tobytes(),
            self.surface_point.tobytes(),
        )


def find_mechanisms(scene: Scene) -> Mechanisms:
    """The mechanisms of a scene's bodies and drives, those of the same structure side by side."""
    alike: dict[Any, list[_One]] = {}
    lone: dict[Any, _One] = {}
    named = {f for f, field in enumerate(scene.fields) if _bodies_of(scene, field)}
    for members, joints, fields in _components(scene):
        key = None
        if (
            len(members) == 1
            and members[0] < len(scene.bodies)
            and not (joints or named & {*fields})
        ):
            body = scene.bodies[members[0]]  # what acts on it acts on all bodies
            key = (body.shape, body.mass) if scene.fields else ("body",)
        if key in lone:
            one = lone[key]._replace(members=members)
        else:
            one = _one(scene, members, joints, fields)
            lone.update({} if key is None else {key: one})
        alike.setdefault(one.structure, []).append(one)
    return _side_by_side(scene, list(alike.values()))


def _components(scene: Scene) -> list[tuple[list[int], list[int], list[int]]]:
    """Dynamic bodies that are coupled, their joints, and the fields that act on them alone."""
    bodies, count = len(scene.bodies), len(scene.bodies) + len(scene.driven_bodies)
    group = Groups()
    for joint in scene.joints:
        a, b = scene.joint_ends(joint)
        group.unite(a, a if b is None else b)
    for first, _ in scene.grippers:
        group.unite(bodies + first, bodies + first + 1)
    of_field = [_bodies_of(scene, field) for field in scene.fields]
    for ends in of_field:
        if ends:
            group.unite(ends[0], ends[-1])
    found: dict[int, tuple[list[int], list[int], list[int]]] = {}
    for n in range(count):
        found.setdefault(group.of(n), ([], [], []))[0].append(n)
    for j, joint in enumerate(scene.joints):
        found[group.of(scene.joint_ends(joint)[0])][1].append(j)
    for f, ends in enumerate(of_field):
        for component in [found[group.of(ends[0])]] if ends else found.values():
            component[2].append(f)
    return list(found.values())


def _bodies_of(scene: Scene, field: Any) -> list[int]:
    """Bodies that a field names; none if it acts on all."""
    named = [getattr(field, "body", None)]
    if isinstance(field, PointSpring) and isinstance(field.to, int | str):
        named.append(field.to)
    return [scene.body_index(body) for body in named if body is not None]


def _one(scene: Scene, members: list[int], joints: list[int], fields: list[int]) -> _One:
    """A mechanism as a scene of its own, and the tables of that."""
    local = {n: k for k, n in enumerate(members)}
    first = len(scene.bodies)
    drives: list[Any] = []
    for drive in scene.drives:
        if first in local and isinstance(drive, Gripper):
            drives.append(replace(drive, name=drive.name or f"drive {first - len(scene.bodies)}"))
        elif first in local:
            drives.append(replace(drive, name=scene.solid_names[first]))
        first += 2 if isinstance(drive, Gripper) else 1
    own_joints = []
    for joint in (scene.joints[j] for j in joints):
        a, b = scene.joint_ends(joint)
        own_joints.append(replace(joint, a=local[a], b=None if b is None else local[b]))
    names = scene.solid_names  # a part would number unnamed bodies from 0 again
    own_fields: list[Any] = []
    for field in (scene.fields[f] for f in fields):
        ends = [local[n] for n in _bodies_of(scene, field)]
        if isinstance(field, Attractor) or not ends:
            own_fields.append(field)
        elif isinstance(field, PointSpring) and len(ends) == 2:
            own_fields.append(replace(field, body=ends[0], to=ends[1]))
        else:
            own_fields.append(replace(field, body=ends[0]))
    part = Scene(
        bodies=[
            replace(scene.bodies[n], name=names[n], density=None)
            for n in members
            if n < len(scene.bodies)
        ],
        drives=drives,
        gravity=scene.gravity,
        joints=own_joints,
        fields=own_fields,
    )
    field_table, points = field_rows(part)
    rows = joint_rows(part, len(members))
    return _One(members, joints, fields, part, dynamic_rows(part), rows, field_table, points)


def _side_by_side(scene: Scene, kinds: list[list[_One]]) -> Mechanisms:
    """The groups, of at most LANES mechanisms each."""
    groups, present, bodies = [], [], []
    joint_rows_of, fields, points = [np.zeros(0, _LANED_JOINT)], [np.zeros(0, FIELD)], []
    place = np.zeros(len(scene.bodies) + len(scene.driven_bodies), np.int64)
    motor = np.zeros((len(motors(scene)), 2), np.int64)
    number = {j: n for n, j in enumerate(motors(scene))}
    blocks = joints = entries = field_count = point_count = 0
    for kind in kinds:
        example = kind[0]
        count, rows = len(example.members), len(example.joint_row)
        solids = count + (1 if rows else 0)
        field = example.field.copy()
        field["first_point"] += point_count
        fields.append(field)
        points.append(example.surface_point)
        point_count += example.surface_point.shape[1]
        for start in range(0, len(kind), LANES):
            lanes = kind[start : start + LANES]
            filled = [*lanes, *([lanes[0]] * (LANES - len(lanes)))]
            own_entries = int((np.arange(rows) - example.joint_row["first"]).sum())
            groups.append((
                blocks, count, solids, joints, rows, entries, own_entries, field_count, len(field),
                bool(example.scene.grippers),
            ))  # fmt: skip
            present.append(np.arange(LANES) < len(lanes))
            at = np.full((solids, LANES), -1)
            at[:count] = np.array([one.members for one in filled]).T
            bodies.append(at.ravel())
            for lane, one in enumerate(lanes):
                place[one.members] = (blocks + np.arange(count)) * LANES + lane
                for k, j in enumerate(one.joints[n] for n in motors(one.scene)):
                    motor[number[j]] = (len(groups) - 1) * LANES + lane, k
            joint_rows_of.append(_laned([one.joint_row for one in filled]))
            blocks, joints, entries = blocks + solids, joints + rows, entries + own_entries
        field_count += len(field)
    differing: dict[Any, _One] = {}
    for k, kind in enumerate(kinds):
        for one in kind:
            masses = tuple((body.shape, body.mass) for body in one.scene.bodies)
            differing.setdefault((k, masses), one)
    return Mechanisms(
        group=np.array(groups, dtype=BODY_GROUP),
        present=np.array(present, dtype=np.int64),
        body=np.concatenate(bodies),
        place=place,
        joint_row=np.concatenate(joint_rows_of),
        entries=entries,
        field=np.concatenate(fields),
        surface_point=np.ascontiguousarray(np.concatenate(points, axis=1)),
        motor=motor,
        checked=tuple((one.fields, one.scene) for one in differing.values()),
    )


def _laned(tables: list[Array]) -> Array:
    """Rows of joints of LANES mechanisms, with the values of each in its lane."""
    out = aligned_zeros(len(tables[0]), _LANED_JOINT)
    for name in JOINT_ROW.names or ():
        if name in JOINT_ROW_PER_LANE:
            out[name] = np.stack([table[name] for table in tables], axis=-1)
        else:
            out[name] = tables[0][name]
    return out

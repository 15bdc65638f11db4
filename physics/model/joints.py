"""Rows of the table of joints: the scalar constraints that each joint consists of.

Rows of joints that share a body are coupled. Joints are put into an order in which coupled rows
stand close together, so that the coupled system fits into a narrow envelope (reverse
Cuthill-McKee): a chain of any length costs time proportional to its length.
"""

from typing import Any

import numpy as np

from physics.model.groups import Groups
from physics.model.tables import (
    ALONG,
    ANGLE,
    DISTANCE,
    EQUALITY,
    HIGH_LIMIT,
    JOINT_ROW,
    LOW_LIMIT,
    MOTOR,
    PERPENDICULAR,
)
from physics.rotation import rotation_matrix
from physics.scene.drives import Drive
from physics.scene.joints import BallJoint, Distance, Hinge, Joint, Slider, Weld
from physics.scene.scene import Scene
from physics.scene.solids import Body

Array = np.ndarray


def joint_rows(scene: Scene, world: int) -> Array:
    """Rows of JOINT_ROW; `world` is the row of Workspace.solid that stands for the world."""
    rows: list[Any] = []
    last: list[Any] = []
    looped = _joints_in_loops(scene)
    for j in _order(scene):
        for row in _Rows(scene, j, world).found:
            # in a closed loop a motor may depend on other joints; then it is the one left out
            (last if j in looped and row["role"] != EQUALITY else rows).append(row)
    rows += last
    table = np.array(rows, dtype=JOINT_ROW)
    first_of_body: dict[int, int] = {}
    entries = 0
    for r in range(len(table)):
        ends = {int(table["a"][r]), int(table["b"][r])} - {world}
        first = min(first_of_body.setdefault(end, r) for end in ends)
        table["first"][r], table["entry"][r] = first, entries
        entries += r - first
    return table


def free_directions(scene: Scene) -> list[Any]:
    """A record of JOINT_ROW for each hinge and slider: the direction that it leaves free."""
    solids = len(scene.bodies) + len(scene.driven_bodies)
    found = [_Rows(scene, j, solids).free for j in range(len(scene.joints))]
    return [row for row in found if row is not None]


def motors(scene: Scene) -> list[int]:
    """Indices of the joints that have a motor, in scene order."""
    return [j for j, joint in enumerate(scene.joints) if getattr(joint, "motor", None) is not None]


def motor_commands(scene: Scene) -> Array:
    """[motors, 2] in the scene: velocity in rad/s or m/s; set point in rad or m, NaN: none."""
    given: list[Any] = [getattr(scene.joints[j], "motor", None) for j in motors(scene)]
    rows = [(m.velocity, np.nan if m.position is None else m.position) for m in given]
    return np.array(rows, dtype=float).reshape(-1, 2)


def _order(scene: Scene) -> list[int]:
    """Indices of all joints, such that joints that share a body stand close together."""
    bodies = [set(scene.joint_ends(joint)) - {None} for joint in scene.joints]
    of_body: dict[int | None, list[int]] = {}
    for j, ends in enumerate(bodies):
        for body in ends:
            of_body.setdefault(body, []).append(j)
    neighbours = [sorted({n for body in ends for n in of_body[body]} - {j})
                  for j, ends in enumerate(bodies)]  # fmt: skip
    degree = [len(found) for found in neighbours]
    order: list[int] = []
    seen: set[int] = set()
    for start in sorted(range(len(bodies)), key=lambda j: degree[j]):
        if start in seen:
            continue
        seen.add(start)
        queue = [start]
        for j in queue:
            new = sorted((n for n in neighbours[j] if n not in seen), key=lambda n: degree[n])
            seen.update(new)
            queue += new
        order += queue
    return order[::-1]


def _direction(axis: Any) -> Array:
    """Unit vector along an axis of any length."""
    scaled = np.array(axis) / np.abs(axis).max()  # squares of its entries may be beyond doubles
    return scaled / np.linalg.norm(scaled)


def _joints_in_loops(scene: Scene) -> set[int]:
    """Indices of all joints of those groups of bodies in which joints form closed loops."""
    # the world and all drives are one solid here, as none of them yields
    ends = [
        (a, -1 if b is None or b >= len(scene.bodies) else b)
        for a, b in (scene.joint_ends(joint) for joint in scene.joints)
    ]
    group = Groups()
    closing = [a for a, b in ends if not group.unite(a, b)]
    looped = {group.of(a) for a in closing}
    return {j for j, (a, _) in enumerate(ends) if group.of(a) in looped}


def held_axes(scene: Scene) -> list[tuple[int, int, int | None, Array]]:
    """Joint, ends, and directions [k, 3] of the world frame that both ends keep in common."""
    found: list[tuple[int, int, int | None, Array]] = []
    for j, joint in enumerate(scene.joints):
        if isinstance(joint, Hinge):
            found.append((j, *scene.joint_ends(joint), _direction(joint.axis)[None]))
        elif isinstance(joint, Slider | Weld):
            found.append((j, *scene.joint_ends(joint), np.eye(3)))
    return found


def _pose(scene: Scene, solid: int | None) -> tuple[Array, Array]:
    """Position and rotation matrix of a body or drive in the scene, or of the world."""
    if solid is None:
        return np.zeros(3), np.eye(3)
    solids: tuple[Body | Drive, ...] = (*scene.bodies, *scene.driven_bodies)
    found = solids[solid]
    return np.array(found.position), rotation_matrix(np.array(found.orientation))


class _Rows:
    """The rows of one joint, as records in the order in which they are solved."""

    def __init__(self, scene: Scene, index: int, world: int) -> None:
        self.found: list[Any] = []
        self.free: Any = None
        joint = scene.joints[index]
        a, b = scene.joint_ends(joint)
        self.position_a, self.rotation_a = _pose(scene, a)
        self.position_b, self.rotation_b = _pose(scene, b)
        self.base: Any = np.zeros(1, dtype=JOINT_ROW)[0]
        self.base["joint"], self.base["a"] = index, a
        self.base["b"] = world if b is None else b
        self.base["motor"], self.base["scale"] = -1, 1.0
        self.motor = motors(scene).index(index) if getattr(joint, "motor", None) else -1
        anchor = getattr(joint, "anchor", None)
        self._anchors(self.position_a if anchor is None else np.array(anchor), None)
        self._add_joint(scene, joint)

    def _anchors(self, of_a: Array, of_b: Array | None) -> None:
        """Sets the anchors, given in the world frame."""
        of_b = of_a if of_b is None else of_b
        self.base["point_a"] = self.rotation_a.T @ (of_a - self.position_a)
        self.base["point_b"] = self.rotation_b.T @ (of_b - self.position_b)

    def _add(self, kind: int, role: int = EQUALITY, **values: Any) -> None:
        row = self.base.copy()
        row["kind"], row["role"] = kind, role
        if kind in (ALONG, DISTANCE):
            ends = [np.linalg.norm(row[name]) for name in ("point_a", "point_b")]
            row["scale"] = max(sum(ends) + abs(values.get("target", 0.0)), 1e-9)
        for name, value in values.items():
            row[name] = value
        self.found.append(row)

    def _hold_along(self, *directions: Array) -> None:
        """The anchors don't move apart along directions of the world frame, fixed to b."""
        for direction in directions:
            self._add(ALONG, axis_b=self.rotation_b.T @ direction)

    def _hold_perpendicular(self, *pairs: tuple[Array, Array]) -> None:
        """Pairs of axes, of a and of b, stay perpendicular to each other."""
        for of_a, of_b in pairs:
            self._add(
                PERPENDICULAR, axis_a=self.rotation_a.T @ of_a, axis_b=self.rotation_b.T @ of_b
            )

    def _add_joint(self, scene: Scene, joint: Joint) -> None:
        x, y, z = np.eye(3)
        if isinstance(joint, BallJoint):
            self._hold_along(x, y, z)
        elif isinstance(joint, Weld):
            self._hold_along(x, y, z)
            self._hold_perpendicular((x, y), (y, z), (z, x))
        elif isinstance(joint, Distance):
            one, other = (np.array(point) for point in scene.distance_anchors(joint))
            self._anchors(one, other)
            self._add(DISTANCE, target=np.linalg.norm(one - other))
        else:
            n = _direction(joint.axis)
            s = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
            s /= np.linalg.norm(s)
            t = np.cross(n, s)
            if isinstance(joint, Slider):
                self._hold_along(s, t)
                self._hold_perpendicular((s, t), (t, n), (n, s))
                self._free(joint, ALONG, axis_b=self.rotation_b.T @ n)
            else:
                self._hold_along(x, y, z)
                self._hold_perpendicular((n, s), (n, t))
                self._free(
                    joint,
                    ANGLE,
                    axis_a=self.rotation_a.T @ s,
                    axis_b=self.rotation_b.T @ s,
                    pivot=self.rotation_b.T @ n,
                )

    def _free(self, joint: Hinge | Slider, kind: int, **values: Any) -> None:
        """Rows for the limits and the motor along the direction that a joint leaves free.

        They count the angle of a hinge with limits from the middle of its range, and so only wrap
        half a turn away from there.
        """
        self._add(kind, MOTOR, **values)
        self.free = self.found.pop()
        low, high = joint.limits or (-np.inf, np.inf)
        middle = 0.0
        if kind == ANGLE and joint.limits is not None:
            middle = 0.5 * (low + high)
            axis = self.rotation_b.T @ _direction(joint.axis)
            turned = self.rotation_b @ _turned(values["axis_b"], axis, -middle)
            values = values | {"axis_a": self.rotation_a.T @ turned}
        low, high = low - middle, high - middle
        if joint.motor is not None:  # before the limits, on which it would depend
            values_of_motor = {"motor": self.motor, "limits": (low, high), "middle": middle}
            for name in ("force_limit", "frequency"):
                values_of_motor[name] = getattr(joint.motor, name)
            self._add(kind, MOTOR, **values, **values_of_motor)
        for role, limit in ((LOW_LIMIT, low), (HIGH_LIMIT, high)):
            if np.isfinite(limit):
                self._add(kind, role, target=limit, **values)


def _turned(vector: Array, axis: Array, angle: float) -> Array:
    """A vector perpendicular to a unit axis, rotated about it by an angle in rad."""
    return np.cos(angle) * vector + np.sin(angle) * np.cross(axis, vector)

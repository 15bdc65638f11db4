"""Rows of the table of joints: the scalar constraints that each joint consists of.

Rows of joints that share a body are coupled. Joints are put into an order in which coupled rows
stand close together, so that the coupled system fits into a narrow envelope (reverse
Cuthill-McKee): a chain of any length costs time proportional to its length.
"""

from typing import Any

import numpy as np

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
from physics.scene.fields import BodyName
from physics.scene.joints import BallJoint, Distance, Hinge, Joint, Slider, Weld
from physics.scene.scene import Scene

Array = np.ndarray


def joint_rows(scene: Scene, world: int) -> Array:
    """Rows of JOINT_ROW; `world` is the row of Workspace.solid that stands for the world."""
    rows: list[Any] = []
    for j in _order(scene):
        rows += _Rows(scene, j, world).found
    table = np.array(rows, dtype=JOINT_ROW)
    entries = 0
    for r in range(len(table)):
        ends = {int(table["a"][r]), int(table["b"][r])} - {world}
        coupled = [s for s in range(r + 1) if ends & {int(table["a"][s]), int(table["b"][s])}]
        table["first"][r], table["entry"][r] = coupled[0], entries
        entries += r - coupled[0]
    return table


def free_directions(scene: Scene) -> list[Any]:
    """A record of JOINT_ROW for each hinge and slider: the direction that it leaves free."""
    found = [_Rows(scene, j, len(scene.bodies)).free for j in range(len(scene.joints))]
    return [row for row in found if row is not None]


def motors(scene: Scene) -> list[int]:
    """Indices of the joints that have a motor, in scene order."""
    return [j for j, joint in enumerate(scene.joints) if getattr(joint, "motor", None) is not None]


def motor_velocities(scene: Scene) -> Array:
    """[motors] rad/s or m/s in the scene."""
    return np.array([scene.joints[j].motor.velocity for j in motors(scene)])  # type: ignore[union-attr]


def _order(scene: Scene) -> list[int]:
    """Indices of all joints, such that joints that share a body stand close together."""
    bodies = [
        {scene.body_index(body) for body in (joint.a, joint.b) if body is not None}
        for joint in scene.joints
    ]
    of_body: dict[int, list[int]] = {}
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


def _pose(scene: Scene, body: BodyName | None) -> tuple[Array, Array]:
    """Position and rotation matrix of a body in the scene, or of the world."""
    if body is None:
        return np.zeros(3), np.eye(3)
    solid = scene.bodies[scene.body_index(body)]
    return np.array(solid.position), rotation_matrix(np.array(solid.orientation))


class _Rows:
    """The rows of one joint, as records in the order in which they are solved."""

    def __init__(self, scene: Scene, index: int, world: int) -> None:
        self.found: list[Any] = []
        self.free: Any = None
        joint = scene.joints[index]
        a = scene.body_index(joint.a)
        b = world if joint.b is None else scene.body_index(joint.b)
        self.position_a, self.rotation_a = _pose(scene, joint.a)
        self.position_b, self.rotation_b = _pose(scene, joint.b)
        self.base: Any = np.zeros(1, dtype=JOINT_ROW)[0]
        self.base["joint"], self.base["a"], self.base["b"] = index, a, b
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
            n = np.array(joint.axis) / np.linalg.norm(joint.axis)
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
        """Rows for the limits and the motor along the direction that a joint leaves free."""
        self._add(kind, MOTOR, **values)
        self.free = self.found.pop()
        limits = joint.limits or (-np.inf, np.inf)
        if joint.motor is not None:  # before the limits, on which it would depend
            limit = joint.motor.force_limit
            self._add(kind, MOTOR, force_limit=limit, motor=self.motor, limits=limits, **values)
        if joint.limits is not None:
            self._add(kind, LOW_LIMIT, target=limits[0], **values)
            self._add(kind, HIGH_LIMIT, target=limits[1], **values)

"""Scene: bodies, static solids and driven solids, in SI units.

A scene and all that is in it are frozen and checked when they are built. An error names the field,
its value and what would be right.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

from physics.scene import saving
from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.drives import Drive, Gripper
from physics.scene.fields import Attractor, BodyName, Drag, Field, PointSpring, SurfaceDrag
from physics.scene.joints import BallJoint, Distance, Hinge, Joint, Motor, Slider, Weld
from physics.scene.material import Material
from physics.scene.mesh import Mesh
from physics.scene.part import Part
from physics.scene.particles import Particles
from physics.scene.shapes import Box, Capsule, Sphere
from physics.scene.solids import Body, Ground, Static
from physics.scene.torus import Torus
from physics.scene.validation import ZERO, Vector, instance, vector

# classes of all objects that a scene is made of
_PARTS = (
    Body, Ground, Static, Drive, Gripper, Material, PointSpring, Attractor, Drag,
    SurfaceDrag, Sphere, Box, Capsule, Compound, Part, Cylinder, Torus, Particles, Mesh,
    BallJoint, Hinge, Slider, Weld, Distance, Motor,
)  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """Bodies, static solids and driven solids under gravity.

    Args:
        bodies: free bodies; at least one body or drive is needed.
        statics: Ground or Static.
        drives: driven solids: Drive or Gripper.
        gravity: m/s^2.
        fields: other forces on bodies: PointSpring, Attractor, Drag or SurfaceDrag.
        joints: BallJoint, Hinge, Slider, Weld or Distance.

    Raises:
        TypeError, ValueError: an argument is of the wrong type; two solids have the same name; a
            force or joint on a body that isn't there; a distance that its anchors don't have.
    """

    bodies: Sequence[Body] = ()
    statics: Sequence[Ground | Static] = ()
    drives: Sequence[Drive | Gripper] = ()
    gravity: Vector = (0.0, 0.0, -9.81)
    fields: Sequence[Field] = ()
    joints: Sequence[Joint] = ()

    def __post_init__(self) -> None:
        """Checks every field and turns the sequences into tuples."""
        kinds: dict[str, tuple[type, ...]] = {
            "bodies": (Body,),
            "statics": (Ground, Static),
            "drives": (Drive, Gripper),
            "fields": (PointSpring, Attractor, Drag, SurfaceDrag),
            "joints": (BallJoint, Hinge, Slider, Weld, Distance),
        }
        for name, types in kinds.items():
            value = getattr(self, name)
            if isinstance(value, str) or not isinstance(value, Sequence):
                raise TypeError(f"Scene.{name} must be a sequence, got {value!r}")
            for i, item in enumerate(value):
                instance(f"Scene.{name}[{i}]", item, *types)
            object.__setattr__(self, name, tuple(value))
        if not self.bodies and not self.drives:
            raise ValueError("Scene.bodies must hold at least one Body (or Scene.drives a Drive)")
        object.__setattr__(self, "gravity", vector("Scene.gravity", self.gravity))
        twice = [name for name, count in Counter(self.solid_names).items() if count > 1]
        if twice:
            raise ValueError(f"Scene: names of solids must be unique, got {twice[0]!r} twice")
        for i, force in enumerate(self.fields):
            self._check_field(f"Scene.fields[{i}]", force)
        for i, joint in enumerate(self.joints):
            self._check_joint(f"Scene.joints[{i}]", joint)

    def _check_field(self, where: str, force: Field) -> None:
        """Raises ValueError if a field acts on a body that isn't there, or ties one to itself."""
        body, to = getattr(force, "body", None), getattr(force, "to", None)
        for name, value in (("body", body), ("to", to if isinstance(to, int | str) else None)):
            if value is not None:
                self.body_index(value, f"{where}: {type(force).__name__}.{name}")
        if (
            isinstance(force, PointSpring)
            and isinstance(force.to, int | str)
            and self.body_index(force.to) == self.body_index(force.body)
        ):
            raise ValueError(f"{where}: PointSpring.to is the body itself, {to!r}")

    def _check_joint(self, where: str, joint: Joint) -> None:
        """Raises ValueError if a joint has no two different solids, or anchors that disagree."""
        kind = type(joint).__name__
        a, b = self.joint_ends(joint, f"{where}: {kind}.")
        if a == b:
            raise ValueError(f"{where}: {kind}.b is the same body as a, {joint.b!r}")
        if isinstance(joint, Distance):
            apart = math.dist(*self.distance_anchors(joint))
            if apart == 0.0:
                raise ValueError(f"{where}: Distance between two anchors at the same point")
            if joint.length is not None and abs(joint.length - apart) > 1e-9 * apart:
                raise ValueError(
                    f"{where}: Distance.length {joint.length:g} m disagrees with its anchors, "
                    f"{apart:.9g} m apart in the scene; give length=None or move a body"
                )

    def joint_ends(self, joint: Joint, field: str = "") -> tuple[int, int | None]:
        """Indices of a joint's solids: bodies, then drives; None is the world.

        Raises:
            ValueError: `a` is no body, `b` no body or drive; the message begins with `field`.
        """
        a = self.body_index(joint.a, f"{field}a")
        if joint.b is None:
            return a, None
        bodies, fingers = len(self.bodies), set()
        for first, _ in self.grippers:
            fingers |= {bodies + first, bodies + first + 1}
        names = self.solid_names[: bodies + len(self.driven_bodies)]
        index = names.index(joint.b) if joint.b in names else joint.b
        if isinstance(index, int) and 0 <= index < len(names) and index not in fingers:
            return a, index
        listed = ", ".join(repr(name) for i, name in enumerate(names) if i not in fingers)
        statics = self.solid_names[len(names) :]
        why = ""
        if joint.b in statics:
            why = ", which never moves: None holds a body just as well"
        elif index in fingers or joint.b in [gripper.name for _, gripper in self.grippers]:
            why = ", a Gripper, whose fingers can't have joints: use a Drive"
        raise ValueError(
            f"{field}b must be None for the world, or the name or index of a body or Drive, got "
            f"{joint.b!r}{why}; there are: {listed}"
        )

    def distance_anchors(self, joint: Distance) -> tuple[Vector, Vector]:
        """Both ends of a Distance, world frame, m."""
        a, b = self.joint_ends(joint)
        solids: tuple[Body | Drive, ...] = (*self.bodies, *self.driven_bodies)
        other = ZERO if b is None else solids[b].position
        return joint.anchor or self.bodies[a].position, joint.to_anchor or other

    @cached_property
    def jointed_pairs(self) -> frozenset[tuple[int, int]]:
        """Pairs of solids that don't touch each other because a joint connects them."""
        pairs = set()
        for joint in self.joints:
            a, b = self.joint_ends(joint)
            if b is not None and not joint.collide:
                pairs.add((min(a, b), max(a, b)))
        return frozenset(pairs)

    def body_index(self, body: BodyName, field: str = "body") -> int:
        """Index of a body that is given by index or name.

        Raises:
            ValueError: there is no such body; the message names `field` and lists the bodies.
        """
        names = self.solid_names[: len(self.bodies)]
        if isinstance(body, str) and body in names:
            return names.index(body)
        if isinstance(body, int) and 0 <= body < len(names):
            return body
        listed = ", ".join(repr(name) for name in names) or "none"
        others = self.solid_names[len(names) :]
        which = ", which is a drive or static" if body in others else ""
        raise ValueError(
            f"{field} must be the name or index of a body, got {body!r}{which}; there are: {listed}"
        )

    def to_json(self) -> str:
        """The scene as JSON text, from which `from_json` builds an equal one."""
        return saving.write(self, "scene")

    @classmethod
    def from_json(cls, text: str) -> "Scene":
        """The scene of a text of `to_json`.

        Raises:
            TypeError, ValueError: no such text, or a bad value in it; the message names its place.
        """
        return cast(Scene, saving.read(text, "scene", (cls, *_PARTS)))

    @cached_property
    def driven_bodies(self) -> tuple[Drive, ...]:
        """All driven solids in the order of a World: of a Gripper, both fingers."""
        found: list[Drive] = []
        for drive in self.drives:
            found += drive.fingers if isinstance(drive, Gripper) else [drive]
        return tuple(found)

    @cached_property
    def grippers(self) -> tuple[tuple[int, Gripper], ...]:
        """Every Gripper, and the index of its first finger among the driven bodies."""
        found, first = [], 0
        for drive in self.drives:
            if isinstance(drive, Gripper):
                found.append((first, drive))
            first += 2 if isinstance(drive, Gripper) else 1
        return tuple(found)

    @cached_property
    def solid_names(self) -> tuple[str, ...]:
        """Name of every solid: bodies, then driven bodies, then statics.

        A solid without a name of its own is called by its kind and index: "body 0", "drive 1".
        """
        kinds: dict[str, Sequence[Any]] = {
            "body": self.bodies,
            "drive": self.driven_bodies,
            "static": self.statics,
        }
        return tuple(
            f"{kind} {i}" if solid.name is None else solid.name
            for kind, solids in kinds.items()
            for i, solid in enumerate(solids)
        )

"""Which scenes this package simulates, and at which fidelities."""

from typing import Any

from physics.scene.fidelity import Fidelity
from physics.scene.particles import Particles
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Capsule, Shape, Sphere
from physics.scene.solids import EVERY_GROUP, Ground
from physics.scene.torus import Torus

_STATICS = (Box, Sphere, Capsule, Torus)
# different bodies, up to size, beyond which the table of their pairs becomes large
MOST_CLASSES = 512

_FIELDS = (
    ("law", ("spring",)),
    ("damping", ("dashpot",)),
    ("integrator", ("midpoint", "euler")),
    ("time_control", ("fixed",)),
)


def supports(scene: Scene, fidelity: Fidelity) -> str:
    """Why a scene can't be simulated as a heap of particles at a fidelity; "" if it can.

    The reason names the field, its value and what would be right.
    """
    for name, right in _FIELDS:
        value = getattr(fidelity, name)
        if value not in right:
            return f"Fidelity.{name} must be {' or '.join(map(repr, right))}, got {value!r}"
    if not scene.bodies:
        return "Scene.bodies must hold at least one body, got none"
    for name in ("drives", "joints", "fields"):
        if getattr(scene, name):
            return f"Scene.{name} must be empty, got {len(getattr(scene, name))} of them"
    checked: set[tuple[int, int]] = set()
    for what, solids in (("bodies", scene.bodies), ("statics", scene.statics)):
        for i, solid in enumerate(solids):
            key = (id(getattr(solid, "shape", None)), id(solid.material))
            if (solid.group, solid.mask) != (1, EVERY_GROUP):
                return (
                    f"Scene.{what}[{i}] must have the default group and mask, got group="
                    f"{solid.group}, mask={solid.mask}"
                )
            if key not in checked:
                checked.add(key)
                reason = _reason(solid, what == "bodies")
                if reason:
                    return f"Scene.{what}[{i}]{reason}"
    return _mixture(scene, fidelity)


def _reason(solid: Any, moves: bool) -> str:
    material = solid.material
    for name in ("rolling_resistance", "spinning_resistance"):
        if getattr(material, name) > 0.0:
            return f".material.{name} must be 0, got {getattr(material, name)!r}"
    if isinstance(solid, Ground):
        return ""
    shape: Shape = solid.shape
    if not moves:
        kind = type(shape).__name__
        return (
            "" if isinstance(shape, _STATICS) else f".shape must be one of {_named()}, got {kind}"
        )
    if not isinstance(shape, Particles | Sphere):
        return f".shape must be Particles or Sphere, got {type(shape).__name__}"
    if isinstance(shape, Particles) and len(shape.positions) == 1:
        return ".shape must be a Sphere instead of Particles with one ball"
    return ""


def _named() -> str:
    return ", ".join(one.__name__ for one in _STATICS)


def _mixture(scene: Scene, fidelity: Fidelity) -> str:
    kinds = {type(body.shape) for body in scene.bodies}
    if fidelity.geometry == "particle" and len(kinds) == 2:
        return (
            "Fidelity.geometry must be 'shape' where spheres and particles are mixed, got "
            "'particle'"
        )
    return ""

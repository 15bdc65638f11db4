"""Warnings of scenes that are probably not what was meant: solids inside others, units mixed up.

A body whose centre begins inside something solid is thrown out: springs give back the energy of the
whole overlap, impulses push at a bounded speed but have no side to push to. And a mesh in
millimetres is a thousand times as large as what it is to touch.
"""

import warnings
from typing import cast

import numpy as np

from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.fidelity import Fidelity
from physics.scene.mesh import Mesh
from physics.scene.part import Part
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Capsule, Shape, Sphere
from physics.scene.solids import Ground, Static, touch_each_other

Array = np.ndarray

# times as wide as the widest other shape, above which a mesh has other units, most likely;
# millimetres taken for metres give a thousand
HUGE = 100.0


class OddScene(UserWarning):
    """A scene that can be simulated, but was hardly meant."""


def warn_of_odd_scenes(scene: Scene, fidelity: Fidelity) -> None:
    """Warns of the body that begins deepest inside a static, and of the mesh that is too large."""
    for found in (_inside(scene, fidelity), _huge_mesh(scene)):
        if found:
            warnings.warn(found, OddScene, stacklevel=3)


def _inside(scene: Scene, fidelity: Fidelity) -> str:
    """What to say of the body whose centre is deepest below a surface; nothing if none is."""
    if not scene.bodies:
        return ""
    centres = np.array([body.position for body in scene.bodies])
    first = len(scene.bodies) + len(scene.driven_bodies)
    worst, deepest, under = 0.0, 0, 0
    for n, static in enumerate(scene.statics):
        depth = _depth(static, centres)
        for i in np.flatnonzero(depth > worst).tolist():
            body = scene.bodies[i]
            fits = not isinstance(static, Ground) and _is_hollow(body.shape)
            if depth[i] > worst and touch_each_other(body, static) and not fits:
                worst, deepest, under = float(depth[i]), i, first + n
    if worst == 0.0:
        return ""
    body = scene.bodies[deepest]
    if fidelity.law == "impulse":
        then = "impulses push it out slowly, or not at all"
    else:  # all energy of the overlap becomes motion
        overlap = worst + body.shape.reach
        speed = overlap * fidelity.contact_resolution / fidelity.substep
        then = f"springs throw it out, at up to {speed:.3g} m/s where no material is softer"
    return (
        f"the centre of {scene.solid_names[deepest]} begins {worst:.3g} m below the surface of "
        f"{scene.solid_names[under]}, at position {body.position} m: {then}; place it outside"
    )


def _is_hollow(shape: Shape) -> bool:
    """Whether a shape's centre may be outside of it, so that a static has room there."""
    if isinstance(shape, Compound):
        parts = cast(tuple[Part, ...], shape.parts)
        return bool(min(float(part.distance(np.zeros(3))) for part in parts) >= 0.0)
    return not isinstance(shape, Box | Capsule | Sphere | Cylinder)


def _depth(static: Ground | Static, points: Array) -> Array:
    """[n] m by which points [n, 3] m are inside a static; negative outside, and of other shapes."""
    if isinstance(static, Ground):
        return np.asarray(static.height - points[:, 2])
    pose = Part(Sphere(1.0), static.position, static.orientation)
    local = pose.inward(points)
    shape = static.shape
    if isinstance(shape, Compound):
        parts = cast(tuple[Part, ...], shape.parts)
        return np.asarray(-np.min([part.distance(local) for part in parts], axis=0))
    if isinstance(shape, Box | Capsule | Sphere):
        return -Part(shape).distance(local)
    return np.full(len(points), -1.0)


def _huge_mesh(scene: Scene) -> str:
    """What to say of the mesh of a body that is far wider than all else that moves."""
    shapes: list[Shape] = [body.shape for body in scene.bodies]
    shapes += [drive.shape for drive in scene.driven_bodies]
    widths = [shape.width for shape in shapes]
    if len(widths) < 2:
        return ""
    next_one, widest = sorted(widths)[-2:]
    i = widths.index(widest)
    if not isinstance(shapes[i], Mesh) or widest <= HUGE * next_one:
        return ""
    return (
        f"the Mesh of {scene.solid_names[i]} is {widest:.3g} m wide, the next solid {next_one:.3g} "
        "m: vertices are in m; for a file in millimetres use scale=0.001"
    )

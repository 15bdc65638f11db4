"""What the parts of a scene cost, found by adding them one after another."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from physics.scene.drives import Drive, Gripper
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.tuning.candidates import can_touch
from physics.tuning.motion import Course, simulate

_FRAME, _FRAMES = 0.02, 5  # s
_GROUPS = 32  # lane groups that are timed: enough that the next one's data must be loaded


class Part(NamedTuple):
    """A part of a scene and its cost.

    Attributes:
        name: what was added.
        cost: s per substep and world, on one thread, with others side by side; inf: refused.
        note: why it is refused, or diverges.
    """

    name: str
    cost: float
    note: str = ""


def parts_cost(scene: Scene, fidelity: Fidelity, worlds: int) -> list[Part]:
    """What each part adds to the cost of a substep, in the scene's first 0.1 s.

    Bodies alone come first, then joints, fields, drives, contacts without friction, and friction;
    parts that the scene doesn't have are omitted. A part that is new is compiled, 5 to 20 s.
    """
    found, before = [], 0.0
    for name, partial in _steps(scene):
        course = Course(partial, _FRAMES, _FRAME, worlds if worlds == 1 else worlds * _GROUPS)
        simulated = simulate(course, fidelity)
        if simulated.motion is None:
            found.append(Part(name, math.inf, simulated.note))
            continue
        # no part costs less than nothing; a measured time is a little off
        cost = max(simulated.cost * _step(fidelity), before)
        found.append(Part(name, cost - before))
        before = cost
    return found


def _step(fidelity: Fidelity) -> float:
    """The substep that a frame is divided into, s."""
    return _FRAME / math.ceil(_FRAME / fidelity.substep * (1.0 - 1e-9))


def _steps(scene: Scene) -> Iterator[tuple[str, Scene]]:
    """Scenes that have one part more than the one before; the last one is the whole scene."""
    free = [replace(body, mask=0) for body in scene.bodies]
    drives = [replace(drive, mask=0) for drive in scene.drives]
    if scene.bodies:
        yield "motion of bodies", replace(scene, bodies=free, drives=(), fields=(), joints=())
    ends = [scene.joint_ends(joint)[1] for joint in scene.joints]
    on_bodies = all(end is None or end < len(scene.bodies) for end in ends)
    if scene.joints and on_bodies:
        yield "joints", replace(scene, bodies=free, drives=(), fields=())
    joints = scene.joints if on_bodies else ()
    if scene.fields:
        yield "fields", replace(scene, bodies=free, drives=(), joints=joints)
    if scene.drives:
        yield "drives", replace(scene, bodies=free, drives=drives)
    if not can_touch(scene):
        return
    smooth = _without_friction(scene)
    if smooth != scene:
        yield "contacts", smooth
        yield "friction", scene
    else:
        yield "contacts", scene


def _without_friction(scene: Scene) -> Scene:
    def smooth(solid):  # type: ignore[no-untyped-def]
        return replace(solid, material=replace(solid.material, friction=0.0))

    drives: list[Drive | Gripper] = [smooth(drive) for drive in scene.drives]
    return replace(
        scene,
        bodies=[smooth(body) for body in scene.bodies],
        statics=[smooth(static) for static in scene.statics],
        drives=drives,
    )

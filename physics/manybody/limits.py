"""Checks before the first step that the substep is short enough for a world of many bodies."""

from dataclasses import replace
from typing import Any

import numpy as np

from physics.analysis.step_limits import check_step
from physics.manybody.kinds import Kinds
from physics.model.build import build
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.solids import Body

# solids that can touch a body at once, see `analysis.stability`
_NEIGHBOURS = 6


def check_crowd(scene: Scene, fidelity: Fidelity, kinds: Kinds) -> None:
    """Raises an error if the substep is too long for a scene of many bodies.

    What limits a step are the kinds of bodies that touch each other, not their number. So each kind
    is checked on the statics, and, if a material gives a stiffness, between six of each kind that
    it can touch.

    Raises:
        ValueError: see `analysis.step_limits.check_step`.
    """
    of_body = kinds.of_solid[: len(scene.bodies)]
    bodies = {int(kind): scene.bodies[int(np.argmax(of_body == kind))] for kind in set(of_body)}
    known = {int(kind): n for n, kind in enumerate(kinds.of_solid[len(scene.bodies) :])}
    statics = [scene.statics[n] for n in sorted(known.values())]
    solids = (*scene.bodies, *scene.statics)
    stiff = any(solid.material.stiffness is not None for solid in solids)
    for kind, body in bodies.items():
        _check([body], statics, scene, fidelity)
        for other, neighbour in bodies.items() if stiff else ():
            if kinds.pair[kind, other] >= 0:
                own = replace(body, name=scene.solid_names[scene.bodies.index(body)], density=None)
                _check(
                    [own, *([replace(neighbour, name=None, density=None)] * _NEIGHBOURS)],
                    statics, scene, fidelity,
                )  # fmt: skip


def _check(bodies: list[Body], statics: list[Any], scene: Scene, fidelity: Fidelity) -> None:
    few = Scene(bodies=bodies, statics=statics, gravity=scene.gravity)
    check_step(few, fidelity, *build(few, fidelity, own_spacing=True))

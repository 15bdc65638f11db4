"""Checks before the first step that the substep is short enough for a world of many bodies."""

from dataclasses import replace
from typing import Any, cast

import numpy as np

from physics.analysis.step_limits import check_step
from physics.model.build import build
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.solids import Body, touch_each_other

Array = np.ndarray

# solids that can touch a body at once, see `analysis.stability`
_NEIGHBOURS = 6
# kinds of the lightest and of the heaviest bodies that are checked where there are many
_MOST = 8


def check_crowd(scene: Scene, fidelity: Fidelity, of_solid: Array) -> None:
    """Raises an error if the substep is too long for a scene of many bodies.

    What limits a step are the kinds of bodies that touch each other, not their number. So each kind
    is checked on the statics, and, if a material gives a stiffness, between six of each kind that
    it can touch. Of many kinds those with the lightest bodies are checked, and those with the
    heaviest beside them.

    Args:
        scene: of bodies and statics.
        fidelity: of the physics.
        of_solid: [bodies and statics] kind of each.

    Raises:
        ValueError: see `analysis.step_limits.check_step`.
    """
    of_body = of_solid[: len(scene.bodies)]
    found, first = np.unique(of_body, return_index=True)
    by_mass = sorted(first.tolist(), key=lambda n: cast(float, scene.bodies[n].mass))
    if len(found) > 2 * _MOST:
        by_mass = [*by_mass[:_MOST], *by_mass[-_MOST:]]
    known = {int(kind): n for n, kind in enumerate(of_solid[len(scene.bodies) :])}
    statics = [scene.statics[n] for n in sorted(known.values())]
    solids = (*scene.bodies, *scene.statics)
    stiff = any(solid.material.stiffness is not None for solid in solids)
    for n in by_mass:
        own = replace(scene.bodies[n], name=scene.solid_names[n], density=None)
        _check([own], statics, scene, fidelity)
        for m in by_mass if stiff else ():
            if touch_each_other(own, scene.bodies[m]):
                around = replace(scene.bodies[m], name=None, density=None)
                _check([own, *([around] * _NEIGHBOURS)], statics, scene, fidelity)


def _check(bodies: list[Body], statics: list[Any], scene: Scene, fidelity: Fidelity) -> None:
    few = Scene(bodies=bodies, statics=statics, gravity=scene.gravity)
    check_step(few, fidelity, *build(few, fidelity, own_spacing=True))

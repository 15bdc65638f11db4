"""Checks before the first step that the substep is short enough for a world of many bodies."""

import numpy as np

from physics.analysis.step_limits import check_step
from physics.manybody.kinds import Kinds
from physics.model.build import build
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene

# solids that can touch a body at once, and the body itself, see `analysis.stability`
_TOGETHER = 7
# bodies of the scene that is checked, at most: it is built with all its pairs
_MOST = 64


def check_crowd(scene: Scene, fidelity: Fidelity, kinds: Kinds) -> None:
    """Raises an error if the substep is too long for a scene of many bodies.

    What limits a step are the kinds of bodies that touch each other, not their number. So a scene
    is checked that has a few of each kind: enough for a body to be surrounded by its own kind.

    Raises:
        ValueError: see `analysis.step_limits.check_step`.
    """
    of_body = kinds.of_solid[: len(scene.bodies)]
    found = np.unique(of_body)
    each = max(1, min(_TOGETHER, _MOST // len(found)))
    chosen = sorted(n for kind in found for n in np.flatnonzero(of_body == kind)[:each])
    statics = {int(kind): n for n, kind in enumerate(kinds.of_solid[len(scene.bodies) :])}
    few = Scene(
        bodies=[scene.bodies[n] for n in chosen],
        statics=[scene.statics[n] for n in sorted(statics.values())],
        gravity=scene.gravity,
    )
    check_step(few, fidelity, *build(few, fidelity, own_spacing=True))

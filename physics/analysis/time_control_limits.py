"""Which scenes a time control can advance."""

import numpy as np

from physics.model.features import FIXED, Features
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.shapes import GRID, PARTICLES, TORUS

Array = np.ndarray

# kinds of surface whose distance has no tangent that bounds it
_CONCAVE = {GRID: "a mesh", TORUS: "a torus", PARTICLES: "a solid of particles"}


def check_time_control(
    scene: Scene, fidelity: Fidelity, half_pair: Array, names: Array, features: Features
) -> None:
    """Raises an error if a time control doesn't hold what it promises in a scene.

    Args:
        scene: what is in each world.
        fidelity: of the physics.
        half_pair: rows of HALF_PAIR.
        names: [half-pairs, 2] of the owner and of the surface of each.
        features: of the scene.

    Raises:
        ValueError: divided steps with joints; times of impact with a surface that isn't convex, or
            with a tolerance at which solids touch before they are candidates for contact.
    """
    if features.time_control == FIXED:
        return
    problem = f"Fidelity.time_control {fidelity.time_control!r}"
    if scene.joints:
        raise ValueError(
            f"{problem} can't divide the steps of joints, of which the scene has "
            f"{len(scene.joints)}; use time_control='fixed'"
        )
    if not features.finds_impacts:
        return
    concave = np.flatnonzero(np.isin(half_pair["kind"], list(_CONCAVE)))
    if len(concave):
        raise ValueError(
            f"{problem} needs convex surfaces, because their tangents bound the distance; "
            f"{names[concave[0], 1]} is {_CONCAVE[int(half_pair['kind'][concave[0]])]}: use "
            "time_control='adaptive' or 'fixed'"
        )
    k = int(np.argmin(half_pair["skin"]))
    largest = 0.5 * float(half_pair["skin"][k])
    if fidelity.impact_tolerance > largest:
        raise ValueError(
            f"Fidelity.impact_tolerance {fidelity.impact_tolerance:g} m must be at most "
            f"{largest:.2g} m, half of the skin between {names[k, 0]} and {names[k, 1]}"
        )

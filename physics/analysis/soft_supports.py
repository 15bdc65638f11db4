"""A warning where a body sinks deep at rest: contacts are as stiff as step and masses allow.

A body sinks into what carries it by the load over the stiffness of their contact. The load is its
weight and that of all bodies above it as the scene begins; where no material gives a stiffness, it
follows from the lighter of the two masses. So a light body under a heavy one, a body that is small
against g h^2, and the lowest ones of a tower sink deep, or even pass through.
"""

import math
import warnings

import numpy as np

from physics.analysis.sinks import rest_depth
from physics.analysis.solver_limits import check_solver
from physics.analysis.step_limits import given_stiffness
from physics.model.tables import Model
from physics.scene.fidelity import NEWTON, Fidelity
from physics.scene.scene import Scene
from physics.scene.solids import Ground

Array = np.ndarray

# depth as a fraction of the narrower solid's width, above which a world warns
DEEP = 0.1


class SoftSupport(UserWarning):
    """A body would sink by more than `DEEP` of its width at rest."""


def warn_of_soft_supports(scene: Scene, fidelity: Fidelity, model: Model) -> None:
    """Warns of the contact that is deepest for its width, and says what would be right."""
    bodies = scene.bodies
    if not any(scene.gravity) or not bodies:
        return
    loads, above = _loads(scene)
    solids = (*bodies, *scene.driven_bodies, *scene.statics)
    worst, found = DEEP, (0, 0, 0.0)
    for n, row in enumerate(model.half_pair):
        upper, lower = int(row["owner"]), int(row["surface"])
        if upper < len(bodies) and lower < len(bodies) and above[upper, lower]:
            upper, lower = lower, upper
        carried = lower >= len(model.dynamic) or (
            lower < len(bodies) and upper < len(bodies) and above[lower, upper]
        )
        if upper >= len(bodies) or not carried:
            continue
        depth = rest_depth(scene, model, n, float(loads[upper]))
        carrier = solids[lower]
        width = bodies[upper].shape.width
        if not isinstance(carrier, Ground):
            width = min(width, carrier.shape.width)
        if depth / width > worst:
            worst, found = depth / width, (upper, lower, depth)
    if worst == DEEP:
        return
    upper, lower, depth = found
    warnings.warn(
        f"{scene.solid_names[upper]} presses on {scene.solid_names[lower]} with "
        f"{loads[upper]:.3g} kg, those above it included, and sinks into it by {1e3 * depth:.3g} "
        f"mm at rest, {100.0 * worst:.3g} % of the width of the narrower one; for at most "
        f"{100.0 * DEEP:g} % use {_better(scene, fidelity, worst)}",
        SoftSupport,
        stacklevel=3,
    )


def _better(scene: Scene, fidelity: Fidelity, depth: float) -> str:
    """Settings at which the depth isn't this fraction of a width, but `DEEP`."""
    if given_stiffness(scene):
        return f"materials {depth / DEEP:.2g} times as stiff"
    shorter = f"substep={fidelity.substep * math.sqrt(DEEP / depth):.2g}"
    try:
        check_solver(scene, NEWTON, "worlds")
    except ValueError:
        return shorter
    solves = "law='impulse' with solver='newton' and contact_resolution=50"
    # sweeps don't carry a load that is a thousand times a body's mass at any step
    return solves if fidelity.law == "impulse" else f"{shorter}, or {solves}"


def _loads(scene: Scene) -> tuple[Array, Array]:
    """[bodies] kg of each with those above it, and [bodies, bodies] whether the second is above."""
    bodies, up = scene.bodies, -np.array(scene.gravity) / math.hypot(*scene.gravity)
    places = np.array([body.position for body in bodies])
    widths = np.array([body.shape.width for body in bodies])
    apart = places[None] - places[:, None]  # [i, j]: from i to j
    height = apart @ up
    across = np.linalg.norm(apart - height[..., None] * up, axis=2)
    above = (height > 0.0) & (across < 0.5 * np.minimum(widths[:, None], widths[None]))
    masses = np.array([body.mass for body in bodies])
    return masses + above @ masses, above

"""The motion that errors are measured against, and how well it is known.

No closed form exists for a scene of a user's. The reference is the engine's own motion at short
steps, which are halved until halving changes the motion by less than a quarter of the tolerance. If
the changes don't become small, the motion is chaotic: no step that can be afforded predicts it.
Springs and impulses are two models of the same rigid contact. If both converge and agree, neither
is wrong; where they disagree, the scene doesn't determine its motion (as with several simultaneous
impacts), and the reference is that of one law.
"""

import math
from dataclasses import replace
from typing import NamedTuple

from physics.scene.fidelity import PRESETS, Fidelity
from physics.scene.scene import Scene
from physics.tuning.candidates import can_touch, with_substep
from physics.tuning.metrics import Metric
from physics.tuning.motion import FRAME, Course, Motion, simulate

# substeps per frame: 0.25 ms first, then halved
_FIRST, _LAST = 160, 5120
# change by halving that counts as converged, as a fraction of the tolerance
CONVERGED = 0.25


class Reference(NamedTuple):
    """A motion and its uncertainty.

    Attributes:
        motion: None if no step was accepted or the motion is chaotic.
        uncertainty: by how much halving the step changed the metric.
        description: how it was found.
        horizon: s, until when the two finest motions agree well enough for the tolerance.
        disagreement: of the other law's reference, in the unit of the metric; nan if unknown.
    """

    motion: Motion | None
    uncertainty: float
    description: str
    horizon: float
    disagreement: float = math.nan


def _fine(scene: Scene, law: str) -> tuple[Fidelity, str]:
    """The fidelity whose step is halved, and its name."""
    if not can_touch(scene):
        # Runge-Kutta methods hold neither joints nor drives
        integrator = "midpoint" if scene.joints or scene.drives else "rk4"
        return Fidelity(integrator=integrator), integrator
    base = PRESETS["accurate"]
    if law == "impulse":
        base = replace(PRESETS["solid"], spacing=base.spacing)
    return base, f"{law} law"


def converged(
    course: Course, metric: Metric, tolerance: float, law: str, budget: float
) -> Reference:
    """Halves the step of a law until the motion no longer changes.

    Args:
        course: what happens.
        metric: the error.
        tolerance: in its unit.
        law: "spring" or "impulse".
        budget: s of wall time, about.
    """
    (base, method), spent = _fine(course.scene, law), 0.0
    count, before, note = _FIRST, None, ""
    reference = Reference(None, math.inf, "", 0.0)
    while count <= _LAST:
        fidelity = with_substep(base, FRAME / count)
        found = simulate(course, fidelity, timed=False)
        if found.motion is None:
            note, before = found.note, None
        else:
            if before is not None:
                apart = metric.distance(before, found.motion)
                within = apart <= CONVERGED * tolerance
                frames = len(apart) if within.all() else int(within.argmin())
                text = f"{method}, substep {1e3 * fidelity.substep:g} ms"
                horizon = max(frames - 1, 0) * course.frame
                reference = Reference(found.motion, float(apart.max()), text, horizon)
                if reference.uncertainty <= CONVERGED * tolerance:
                    return reference
            before = found.motion
            took = found.cost * course.simulated
            spent += took
            if spent + 2.0 * took > budget:  # what the next one would take
                break
        count *= 2
    if reference.motion is None:
        return reference._replace(description=note or "no step was accepted")
    return reference


def find_reference(
    course: Course, metric: Metric, tolerance: float, law: str | None, budget: float
) -> Reference:
    """The reference of a course.

    Args:
        course: what happens.
        metric: the error.
        tolerance: in its unit.
        law: of the reference; None: springs if a material gives a stiffness, which impulses
            don't model, else impulses.
        budget: s of wall time, about.
    """
    solids = (*course.scene.bodies, *course.scene.driven_bodies, *course.scene.statics)
    given = any(solid.material.stiffness is not None for solid in solids)
    if not can_touch(course.scene):
        return converged(course, metric, tolerance, "spring", budget)
    first = law or ("spring" if given else "impulse")
    second = "impulse" if first == "spring" else "spring"
    reference = converged(course, metric, tolerance, first, 0.5 * budget)
    if given and law is None:
        return reference
    other = converged(course, metric, tolerance, second, 0.5 * budget)
    known = [r for r in (reference, other) if r.uncertainty <= CONVERGED * tolerance]
    if law is None and known and known[0] is other:
        changes = reference.uncertainty
        why = f"changes by {changes:.2g} by halving" if changes < math.inf else "takes no step"
        return other._replace(
            description=f"{other.description} (the {first} law has not converged: it {why})"
        )
    if reference.motion is not None and other.motion is not None and len(known) == 2:
        apart = float(metric.distance(other.motion, reference.motion).max())
        return reference._replace(disagreement=apart)
    return reference

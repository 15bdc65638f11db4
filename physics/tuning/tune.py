"""tune: the cheapest fidelity whose error on a scene is within a tolerance."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from physics.engines import MANY
from physics.scene.fidelity import LAWS, Fidelity
from physics.scene.scene import Scene
from physics.scene.validation import choice, instance, integer, positive
from physics.tuning.candidates import families, safe_speed
from physics.tuning.description import code
from physics.tuning.metrics import METRICS, Metric
from physics.tuning.motion import (
    FRAME,
    Control,
    Course,
    Start,
    begin,
    compile_for,
    side_by_side,
    simulate,
)
from physics.tuning.reference import CONVERGED, Reference, find_reference

_BUDGET = 15.0  # s of wall time for the reference
_TRIES = 40.0  # s of wall time for the fidelities, compilation not counted
_SHOWN = 12  # rows of evidence that `str` prints


class Evidence(NamedTuple):
    """A fidelity that was tried.

    Attributes:
        family: what it has in common with others.
        fidelity: the fidelity.
        error: in the unit of the metric; inf if it is refused or diverges.
        cost: wall time in s per simulated s of one world, on one thread, with others side by side.
        note: why it is refused or diverges.
    """

    family: str
    fidelity: Fidelity
    error: float
    cost: float
    note: str = ""


class Tuned(NamedTuple):
    """What `tune` found; print it.

    Attributes:
        fidelity: the cheapest one within the tolerance; None if there is none.
        error: its error, in the unit of the metric.
        cost: wall time in s per simulated s of one world, on one thread.
        evidence: all fidelities that were tried.
        reference: what errors were measured against.
        metric: name of the metric.
        tolerance: in its unit.
        reason: why there is no fidelity; "" if there is one.
    """

    fidelity: Fidelity | None
    error: float
    cost: float
    evidence: Sequence[Evidence]
    reference: Reference
    metric: str
    tolerance: float
    reason: str = ""

    def __str__(self) -> str:
        """The fidelity, ready to paste, and the evidence."""
        unit = METRICS[self.metric].unit
        unit = f" {unit}" if unit else ""
        lines = []
        if self.fidelity is None:
            lines.append(f"no fidelity has a {self.metric} error of at most {self.tolerance:g}"
                         f"{unit}: {self.reason}")  # fmt: skip
        else:
            lines.append(code(self.fidelity))
            lines.append(
                f"{self.metric} error {self.error:.2g}{unit} (tolerance {self.tolerance:g}{unit}), "
                f"{1.0 / self.cost:,.0f} simulated s/s on one thread"
            )
            worse = [
                e for e in self.evidence
                if e.fidelity == replace(self.fidelity, substep=e.fidelity.substep,
                                         collision_substeps=e.fidelity.collision_substeps)
                and e.fidelity.substep < self.fidelity.substep and e.error > self.tolerance
            ]  # fmt: skip
            if worse:
                lines.append(
                    f"caution: at {1e3 * worse[0].fidelity.substep:.3g} ms, a shorter step, the "
                    f"error is {worse[0].error:.2g}{unit}. The motion is sensitive: try a shorter "
                    "time, or other starts"
                )
        if METRICS[self.metric].needs_reference and self.reference.motion is not None:
            lines.append(
                f"reference: {self.reference.description}; halving its step changes it by "
                f"{self.reference.uncertainty:.2g}{unit}"
            )
        apart = self.reference.disagreement
        if apart > self.tolerance:
            lines.append(
                f"the other contact law ends {apart:.2g}{unit} away: this scene doesn't determine "
                "its motion (several simultaneous impacts?); choose with law='spring' or 'impulse'"
            )
        found = sorted((e for e in self.evidence if e.error < math.inf), key=lambda e: e.cost)
        near = [e for e in found if e.error <= self.tolerance][:_SHOWN]
        near += sorted((e for e in found if e.error > self.tolerance), key=lambda e: e.error)[
            : _SHOWN - len(near)
        ]
        if near:
            lines.append(f"{'error' + unit:>12}  within  {'s/s':>9}  fidelity")
            for e in sorted(near, key=lambda e: e.cost):
                within = "yes" if e.error <= self.tolerance else "no"
                mark = "*" if e.fidelity == self.fidelity else " "
                rate = f"{1.0 / e.cost:,.0f}"
                lines.append(f"{e.error:12.2g}  {within:>6}  {rate:>9} {mark}{code(e.fidelity)}")
            lines.append(
                f"{len(self.evidence)} fidelities tried; these {len(near)} are within the "
                "tolerance, or nearest to it, in the order of their speed"
                + ("; * marks the one above" if self.fidelity else "")
            )
        return "\n".join(lines)


def tune(
    scene: Scene,
    tolerance: float = 1e-3,
    metric: str = "position",
    *,
    time: float = 1.0,
    law: str | None = None,
    start: Start | None = None,
    control: Control | None = None,
    worlds: int | None = None,
    exhaustive: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Tuned:
    """Finds the cheapest fidelity whose measured error on this very scene is within a tolerance.

    Every family of fidelities (contact law, damping, spacing, integrator ...) is tried from long to
    short steps, until a member is accurate enough or costs more than the best so far. Errors are
    those against a reference that is the engine's own at short steps, see
    `physics.tuning.reference`. Kernels that are new are compiled first, 2 to 10 s for each; with
    compiled kernels a scene of a few bodies takes seconds.

    Args:
        scene: the scene.
        tolerance: largest error, in the unit of the metric, over all bodies, worlds and frames.
        metric: "position" (m), "orientation" (rad), "velocity" (m/s), "energy" (relative) or
            "penetration" (m, needs no reference).
        time: s that are simulated, in frames of 40 ms.
        law: contact law of the reference; None: springs if a material gives a stiffness, else
            impulses.
        start: called with each World before its first frame, and once before anything is compiled;
            sets states.
        control: called with the World and the frame's index before every frame, moves drives.
        worlds: number of worlds simulated side by side; None: 16, or 1 of many bodies.
        exhaustive: try all fidelities, also those that can't be the cheapest.
        progress: called with a line of text before every family.

    Returns:
        The fidelity and the evidence; `fidelity` is None, and `reason` says why, if there is none.

    Raises:
        TypeError, ValueError: an argument is of the wrong type or out of range.
    """
    instance("scene", scene, Scene)
    tolerance, name = positive("tolerance", tolerance), choice("metric", metric, METRICS)
    if law is not None:
        choice("law", law, LAWS)
    frames = max(1, round(positive("time", time) / FRAME))
    count = integer("worlds", side_by_side(scene) if worlds is None else worlds, low=1)
    course = Course(scene, frames, FRAME, count, start, control)
    say = progress or (lambda _: None)
    members = [family.members[-1] for family in families(scene)]
    begin(course, members)
    if len(scene.bodies) < MANY:
        say("kernels: those that this scene has not had before are compiled")
        compile_for(course, members)
    measure = METRICS[name]
    reference = Reference(None, 0.0, "none is needed", time)
    if measure.needs_reference:
        say("reference: short steps until halving them changes nothing")
        reference = find_reference(course, measure, tolerance, law, _BUDGET)
        if reference.motion is None or reference.uncertainty > CONVERGED * tolerance:
            reason = _unknown(reference, measure, tolerance, frames * FRAME)
            return Tuned(None, math.inf, math.inf, (), reference, name, tolerance, reason)
    evidence = _try_all(course, measure, reference, tolerance, exhaustive, say)
    good = [e for e in evidence if e.error <= tolerance]
    if not good:
        least = min(e.error for e in evidence)
        if math.isinf(least):
            reason = (
                f"all {len(evidence)} fidelities are refused or fail, the last: {evidence[-1].note}"
            )
        else:
            unit = measure.unit
            reason = (
                f"the smallest error of {len(evidence)} fidelities is {least:.2g} {unit}".strip()
                + f"; a tolerance of {_rounded_up(least):g} can be met, or try a shorter time"
            )
        return Tuned(None, least, math.inf, evidence, reference, name, tolerance, reason.strip())
    best = min(good, key=lambda e: e.cost)
    return Tuned(best.fidelity, best.error, best.cost, evidence, reference, name, tolerance)


def _try_all(
    course: Course,
    metric: Metric,
    reference: Reference,
    tolerance: float,
    exhaustive: bool,
    say: Callable[[str], None],
) -> tuple[Evidence, ...]:
    """Errors and costs of the members of all families."""
    evidence, cheapest, spent = [], math.inf, 0.0
    for family in families(course.scene):
        say(family.name)
        took = 0.0
        for fidelity in family.members:
            if spent + 2.0 * took > _TRIES and not exhaustive:
                break  # the next one takes up to twice as long as the last
            found = simulate(course, fidelity, closely=reference.motion is None)
            error, note = math.inf, found.note
            if found.motion is not None:
                base = found.motion if reference.motion is None else reference.motion
                error = float(metric.distance(found.motion, base).max())
                if reference.motion is None:  # which would show what passes through
                    note = _passing(course.scene, fidelity, float(found.motion.speed.max()))
                    error = math.inf if note else error
            evidence.append(Evidence(family.name, fidelity, error, found.cost, note))
            if found.motion is not None:
                took = found.cost * course.simulated
                spent += took
            if error <= tolerance:
                cheapest = min(cheapest, found.cost)
            # a refusal costs nothing; shorter steps are accepted
            done = found.cost < math.inf and found.cost >= cheapest
            if done and not exhaustive:
                break
    return tuple(evidence)


def _passing(scene: Scene, fidelity: Fidelity, speed: float) -> str:
    """Why a small penetration proves nothing: something may have passed through; else ""."""
    safe, thin = safe_speed(scene, fidelity)
    if speed <= safe:
        return ""
    return (
        f"at {speed:.3g} m/s something moves {1e3 * speed * fidelity.substep:.3g} mm in a substep "
        f"and may pass through the thinnest solid, {1e3 * thin:.3g} mm"
    )


def _unknown(reference: Reference, metric: Metric, tolerance: float, time: float) -> str:
    """Why nothing can be compared with a reference that isn't known."""
    if reference.motion is None:
        return f"no reference: {reference.description}"
    unit = f" {metric.unit}" if metric.unit else ""
    changes = (
        f"halving the substep of {reference.description} still changes it by "
        f"{reference.uncertainty:.2g}{unit}"
    )
    if reference.horizon >= time:
        enough = _rounded_up(reference.uncertainty / CONVERGED)
        return (
            f"the reference isn't known well enough: {changes}; a tolerance of {enough:g}{unit} "
            "can be tuned for"
        )
    if reference.horizon > 0.0:
        until = (
            f"it is known well enough for the first {reference.horizon:g} of {time:g} s: tune for "
            f"{reference.horizon:g} s, or with the metric penetration"
        )
    else:
        until = "not even its first frame is known: tune with the metric penetration"
    return f"the motion is chaotic, or needs shorter steps than can be tried: {changes}; {until}"


def _rounded_up(value: float) -> float:
    """To two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / unit * (1.0 - 1e-9)) * unit

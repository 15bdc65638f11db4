"""The settings that are measured: curves of our engine and of MuJoCo, one point a step."""

from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from typing import Any, NamedTuple

from benchmarks.peers.mujoco_options import MujocoOptions
from benchmarks.trade.trial import Trial
from physics import PRESETS, Fidelity
from physics.scene.fidelity import FIND_IMPACTS, NEWTON

OURS, PEER = "rigid-envs", "MuJoCo"
# s; each divides the 40 ms between two readings. A trial has those up to its longest one
STEPS = (0.04, 0.02, 0.01, 8e-3, 4e-3, 2e-3, 1e-3, 0.5e-3, 0.25e-3, 0.125e-3)
FINEST = 0.0625e-3  # s, of ours alone
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)  # of the adaptive integrator


class Setting(NamedTuple):
    """One point of a curve.

    Attributes:
        engine: OURS or PEER.
        curve: settings that differ only in the step (or the tolerance) share a curve.
        label: the step or tolerance as text, or the name of a preset.
        options: a Fidelity, or MujocoOptions.
    """

    engine: str
    curve: str
    label: str
    options: Fidelity | MujocoOptions

    @property
    def key(self) -> tuple[str, str, str]:
        """Engine, curve and label, which name the setting in the results."""
        return self.engine, self.curve, self.label


def milliseconds(step: float) -> str:
    """A step as text."""
    return f"{1e3 * step:.4g} ms"


_SPRING, _IMPULSE = Fidelity(), PRESETS["solid"]
_CONTACT_CURVES: dict[str, Fidelity] = {
    "springs": _SPRING,
    "springs, stiffer step": replace(_SPRING, contact_resolution=0.7),
    "springs, finer step": replace(_SPRING, contact_resolution=0.2),
    "springs, spacing 0.25": replace(_SPRING, spacing=0.25),
    "springs, spacing 1": replace(_SPRING, spacing=1.0),
    "springs, linear dashpot": replace(_SPRING, damping="dashpot"),
    "springs, viscous friction": replace(_SPRING, friction="viscous"),
    "springs, particles": replace(_SPRING, geometry="particle"),
    "springs, Euler": replace(_SPRING, integrator="euler"),
    "springs, adaptive steps": replace(_SPRING, time_control="adaptive"),
    "impulses": _IMPULSE,
    "impulses, softer": replace(_IMPULSE, contact_resolution=1.0),
    "impulses, particles": replace(_IMPULSE, geometry="particle"),
    "impulses, Newton": NEWTON,
    "impulses, Newton, stiffer": replace(NEWTON, contact_resolution=100.0),
    "impulses, bisection": replace(_IMPULSE, time_control="bisection"),
    "impulses, advancement": replace(_IMPULSE, time_control="advancement"),
    "impulses, swept": replace(_IMPULSE, time_control="swept"),
}
_ROTATION_CURVES: dict[str, Fidelity] = {
    "midpoint": _SPRING,
    "Euler": replace(_SPRING, integrator="euler"),
    "RK4": replace(_SPRING, integrator="rk4"),
}
_STIFF: dict[str, Any] = {"solimp": (0.99, 0.999, 0.001)}
_PEER_CURVES: dict[str, dict[str, Any]] = {
    "elliptic cone": {},
    "pyramidal cone": {"cone": "pyramidal"},
    "stiff": _STIFF,
    "stiff, pyramidal": {**_STIFF, "cone": "pyramidal"},
    "stiff, impratio 10": {**_STIFF, "impratio": 10.0},
    "stiff, impratio 100": {**_STIFF, "impratio": 100.0},
    "stiff, noslip": {**_STIFF, "noslip": 5},
    "stiff, RK4": {**_STIFF, "integrator": "RK4"},
    "stiff, implicitfast": {**_STIFF, "integrator": "implicitfast"},
    "stiff, PGS": {**_STIFF, "solver": "PGS"},
    "stiff, CG": {**_STIFF, "solver": "CG"},
    "stiff, 3 iterations": {**_STIFF, "iterations": 3},
}
_PEER_INTEGRATORS = ("Euler", "implicitfast", "implicit", "RK4")
# contact frequency times step, for which the peer's rebounds are tuned
BOUNCES = (0.03, 0.1, 0.3)


def _steps(trial: Trial) -> list[float]:
    return [step for step in STEPS if step <= trial.longest]


def ours(trial: Trial) -> Iterator[Setting]:
    """Our settings for a trial: the presets, then every curve."""
    for name, fidelity in PRESETS.items():
        yield Setting(OURS, "presets", name, fidelity)
    curves = _ROTATION_CURVES if trial.joints else _CONTACT_CURVES
    for curve, fidelity in curves.items():
        if fidelity.time_control in FIND_IMPACTS and not trial.events:
            continue
        for step in (*_steps(trial), FINEST):
            yield Setting(OURS, curve, milliseconds(step), replace(fidelity, substep=step))
    if trial.joints and not trial.scene.joints:
        for tolerance in TOLERANCES:
            fidelity = Fidelity(integrator="adaptive", tolerance=tolerance, substep=1.0)
            yield Setting(OURS, "adaptive", f"tolerance {tolerance:g}", fidelity)


def peers(
    trial: Trial, tuned: Callable[[float, float, float], tuple[float, float] | None]
) -> Iterator[Setting]:
    """MuJoCo's settings for a trial.

    Args:
        trial: the trial.
        tuned: solref for a coefficient of restitution, a step in s and a contact frequency times
            step; None if there is none.
    """
    if trial.joints:
        for integrator in _PEER_INTEGRATORS:
            for step in _steps(trial):
                yield Setting(PEER, integrator, milliseconds(step), MujocoOptions(step, integrator))
        return
    for curve, changed in _PEER_CURVES.items():
        for step in _steps(trial):
            options = MujocoOptions(step, **changed)
            if curve.startswith("stiff"):  # twice the step is the shortest that it accepts
                options = replace(options, solref=(2.0 * step, 1.0))
            yield Setting(PEER, curve, milliseconds(step), options)
    if trial.restitution is None:
        return
    for ratio in BOUNCES:
        for step in _steps(trial):
            solref = tuned(trial.restitution, step, ratio)
            if solref is not None:
                options = MujocoOptions(step, solref=solref, solimp=(0.999, 0.999, 0.001))
                name = f"tuned to e, ωh = {ratio:g}"
                yield Setting(PEER, name, milliseconds(step), options)


def options_text(options: Fidelity | MujocoOptions) -> str:
    """Options as Python text, without the defaults."""
    kind = type(options)
    changed = [
        f"{field.name}={getattr(options, field.name)!r}"
        for field in fields(options)
        if getattr(options, field.name) != field.default
    ]
    return f"{kind.__name__}({', '.join(changed)})"

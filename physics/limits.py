"""Steps that a scene can't be simulated with are refused, by name, before the first of them."""

import math
from dataclasses import replace

from physics import stability
from physics.features import Features
from physics.fidelity import Fidelity
from physics.model import Model, build
from physics.scene import Scene


def check_step(scene: Scene, fidelity: Fidelity, model: Model, features: Features) -> None:
    """Refuses a substep that is too long for what a scene names, or for the scene itself.

    Raises:
        ValueError: a Material.stiffness or Drive.frequency that makes it unstable, with what binds
            it and the largest safe step; a body that would sink into the ground.
    """
    _check_sink(scene, fidelity, model)
    _check_servos(scene, fidelity, model)
    _check_stiffness(scene, fidelity, model, features)


def _below(x: float) -> str:
    """Three digits of a positive number, rounded down: what is told as safe must be."""
    unit = 10.0 ** (math.floor(math.log10(x)) - 2)
    return f"{math.floor(x / unit * (1.0 - 1e-12)) * unit:.3g}"


def _check_sink(scene: Scene, fidelity: Fidelity, model: Model) -> None:
    """A step so long that what lies on a static would sink into it is a slip of the pen."""
    h, gravity, bodies = fidelity.substep, math.hypot(*scene.gravity), len(scene.bodies)
    if _given_stiffness(scene):
        return
    for side in model.side:
        i = int(side["owner"])
        if i >= bodies or side["surface"] < len(model.mover):
            continue
        width = scene.bodies[i].shape.width
        sink = gravity * float(side["pair_mass"] / side["stiffness"])
        if sink > 0.5 * width:
            longest = _below(h * math.sqrt(0.5 * width / sink))
            raise ValueError(
                f"Fidelity.substep {h:g} s is too long for body {i}, which is {width:g} m wide and "
                f"would sink by {sink:.3g} m at rest: at most {longest} s fit it; or build the "
                "World with allow_unstable=True"
            )


def _check_servos(scene: Scene, fidelity: Fidelity, model: Model) -> None:
    h, bodies = fidelity.substep, len(scene.bodies)
    for i, drive in enumerate(scene.tools):
        longest = stability.of_servo(model.mover[bodies + i])
        if h >= longest:
            raise ValueError(
                f"Drive.frequency {drive.frequency:g} rad/s of tool {i} makes the substep of "
                f"{h:g} s unstable: the largest safe step is {_below(longest)} s; lower the "
                "frequency, shorten Fidelity.substep, or build the World with allow_unstable=True"
            )


def _check_stiffness(scene: Scene, fidelity: Fidelity, model: Model, features: Features) -> None:
    given = _given_stiffness(scene)
    if not given:
        return
    h = fidelity.substep
    step, mover = _safe_step(scene, fidelity, model, features)
    if h > step:
        for _ in range(8):  # friction's damping depends on the step as well, a little
            model, _ = build(scene, replace(fidelity, substep=step))
            step, mover = _safe_step(scene, fidelity, model, features)
        raise ValueError(
            f"Material.stiffness {max(given):g} N/m makes the substep of {h:g} s unstable: {mover} "
            f"binds, and the largest safe step is {_below(step)} s; lower the stiffness, shorten "
            "Fidelity.substep, or build the World with allow_unstable=True"
        )


def cause_of_divergence(
    scene: Scene, fidelity: Fidelity, model: Model, features: Features, h: float
) -> str:
    """Why worlds became non-finite at a substep of h s, as far as a scene tells."""
    step, mover = _safe_step(scene, fidelity, model, features)
    if h > step and _given_stiffness(scene):
        return (
            f"the substep of {h:g} s is longer than the largest safe one, {_below(step)} s, which "
            f"{mover} sets"
        )
    return "a state, speed or force too large for double precision"


def _given_stiffness(scene: Scene) -> list[float]:
    """Stiffness in N/m of the materials that name one."""
    solids = (*scene.bodies, *scene.statics, *scene.tools)
    return [x.material.stiffness for x in solids if x.material.stiffness is not None]


def _safe_step(
    scene: Scene, fidelity: Fidelity, model: Model, features: Features
) -> tuple[float, str]:
    """A step in s that is safe in any state, and the name of the mover that binds it."""
    step, i = stability.of_scene(scene, model, features, fidelity.spacing)
    bodies = len(scene.bodies)
    return step, f"body {i}" if i < bodies else f"tool {i - bodies}"

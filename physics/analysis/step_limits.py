"""Steps that a scene can't be simulated with are refused, by name, before the first of them."""

import math
from dataclasses import replace

import numpy as np

from physics.analysis import stability
from physics.model.build import build
from physics.model.features import Features
from physics.model.pairs import spacing
from physics.model.tables import Model
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters, with_parameters
from physics.scene.scene import Ground, Scene
from physics.scene.shapes import Sphere


def check_step(scene: Scene, fidelity: Fidelity, model: Model, features: Features) -> None:
    """Refuses a substep that is too long for what a scene names, or for the scene itself.

    Raises:
        ValueError: a Material.stiffness or Drive.frequency that makes it unstable, with what binds
            it and the largest safe step; a body that would sink into the ground.
    """
    _check_sink(scene, fidelity, model)
    _check_servos(scene, fidelity, model)
    _check_stiffness(scene, fidelity, model, features)


def check_range(scene: Scene, fidelity: Fidelity, low: Parameters, high: Parameters) -> None:
    """As `check_step`, for all parameters between two ends [1, bodies].

    Stability is looked for at the ends: all bodies at one, and each in turn at the other. Without a
    stiffness that materials name it follows from the masses, and only the smallest can sink.
    """
    _check_spacing(scene, fidelity, low, high, "")
    if not _given_stiffness(scene):
        smallest = Parameters.of(scene)._replace(size=low.size)
        _check_built(scene, fidelity, smallest, "size")
        return
    bodies = len(scene.bodies)
    for restitution in {low.restitution.tobytes(): low, high.restitution.tobytes(): high}.values():
        for most, least in ((low, high), (high, low)):
            for i in range(-1, bodies):  # body i at the other end
                at = np.arange(bodies) == i
                mass, size = (
                    np.where(at, getattr(least, name), getattr(most, name))
                    for name in ("mass", "size")
                )
                corner = Parameters(mass, high.friction, restitution.restitution, size)
                _check_built(scene, fidelity, corner, "mass, size and restitution")


def check_world(scene: Scene, fidelity: Fidelity, p: Parameters, world: int) -> None:
    """As `check_step`, for the parameters [1, bodies] of one world."""
    _check_spacing(scene, fidelity, p, p, f" in world {world}")
    _check_built(scene, fidelity, p, f"the parameters of world {world},")


def _check_built(scene: Scene, fidelity: Fidelity, p: Parameters, what: str) -> None:
    built = with_parameters(scene, p)
    try:
        check_step(built, fidelity, *build(built, fidelity))
    except ValueError as error:
        values = ", ".join(
            f"body {i}: mass {p.mass[0, i]:g} kg, size {p.size[0, i]:g}, "
            f"restitution {p.restitution[0, i]:g}"
            for i in range(len(scene.bodies))
        )
        raise ValueError(f"{what} can't be had ({values}): {error}") from None


def _check_spacing(
    scene: Scene, fidelity: Fidelity, low: Parameters, high: Parameters, where: str
) -> None:
    """Samples stay what they are in the scene: a body that shrinks could fall between them."""
    largest = [*high.size[0], *(1.0 for _ in (*scene.tools, *scene.statics))]
    solids = [*scene.bodies, *scene.tools, *scene.statics]
    for i, solid in enumerate(solids):
        if isinstance(solid, Ground) or isinstance(solid.shape, Sphere):
            continue  # a plane has no samples, and the one of a sphere is exact
        apart = float(largest[i]) * spacing(solid.shape, scene, fidelity)
        for j, body in enumerate(scene.bodies):
            width = float(low.size[0, j]) * body.shape.width
            if i != j and apart > width * (1.0 + 1e-9):
                raise ValueError(
                    f"size {low.size[0, j]:g} makes body {j}{where} {width:g} m wide, and the "
                    f"samples of solid {i} can lie {apart:g} m apart: it would fall between them; "
                    "keep sizes closer together, or choose a smaller Fidelity.spacing"
                )


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

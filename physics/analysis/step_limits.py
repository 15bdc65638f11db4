"""Checks before the first step that the substep is short enough for the scene."""

import math
from dataclasses import replace

import numpy as np

from physics.analysis import field_limits, stability
from physics.analysis.time_control_limits import check_time_control
from physics.model.build import build
from physics.model.features import Features
from physics.model.pairs import spacing
from physics.model.tables import Model
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters, with_parameters
from physics.scene.scene import Scene
from physics.scene.shapes import Sphere
from physics.scene.solids import Ground

# largest sink of a body at rest, as a fraction of its width: its centre stays above the surface
_DEEPEST = 0.5


def check_step(scene: Scene, fidelity: Fidelity, model: Model, features: Features) -> None:
    """Raises an error if the substep is too long for a scene.

    Raises:
        ValueError: a Material.stiffness or Drive.frequency makes it unstable (the message names the
            solid that limits it and the largest safe step), or a spring or drag of `Scene.fields`
            does, or a body would sink into the ground.
    """
    sides = np.stack([model.half_pair["owner"], model.half_pair["surface"]], axis=1)
    names = np.array(scene.solid_names)[sides]
    check_time_control(scene, fidelity, model.half_pair, names, features)
    _check_sink(scene, fidelity, model)
    _check_servos(scene, fidelity, model)
    _check_fields(scene, fidelity, model)
    _check_stiffness(scene, fidelity, model, features)


def check_range(scene: Scene, fidelity: Fidelity, low: Parameters, high: Parameters) -> None:
    """As `check_step`, for all parameters between two ends [1, bodies].

    Stability is checked at the ends: all bodies at one end, and each in turn at the other. Where no
    material gives a stiffness it follows from the masses, and only the smallest body can sink.
    """
    _check_spacing(scene, fidelity, low, high, "")
    if not given_stiffness(scene):
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
            f"{scene.solid_names[i]}: mass {p.mass[0, i]:g} kg, size {p.size[0, i]:g}, "
            f"restitution {p.restitution[0, i]:g}"
            for i in range(len(scene.bodies))
        )
        raise ValueError(f"{what} can't be simulated ({values}): {error}") from None


def _check_spacing(
    scene: Scene, fidelity: Fidelity, low: Parameters, high: Parameters, where: str
) -> None:
    """Samples don't scale with other bodies: a body that shrinks could fall between them."""
    largest = [*high.size[0], *(1.0 for _ in (*scene.driven_bodies, *scene.statics))]
    solids = [*scene.bodies, *scene.driven_bodies, *scene.statics]
    for i, solid in enumerate(solids):
        if isinstance(solid, Ground) or isinstance(solid.shape, Sphere):
            continue  # a plane has no samples, and the one of a sphere is exact
        apart = float(largest[i]) * spacing(solid.shape, scene, fidelity)
        for j, body in enumerate(scene.bodies):
            width = float(low.size[0, j]) * body.shape.width
            if i != j and apart > width * (1.0 + 1e-9):
                raise ValueError(
                    f"size {low.size[0, j]:g} makes {scene.solid_names[j]}{where} {width:g} m "
                    f"wide, and the samples of {scene.solid_names[i]} can be {apart:g} m apart: it "
                    "would fall between them; choose sizes that differ less, or a smaller "
                    "Fidelity.spacing"
                )


def _below(x: float) -> str:
    """Three digits of a positive number, rounded down: a step reported as safe must be safe."""
    unit = 10.0 ** (math.floor(math.log10(x)) - 2)
    return f"{math.floor(x / unit * (1.0 - 1e-12)) * unit:.3g}"


def _check_sink(scene: Scene, fidelity: Fidelity, model: Model) -> None:
    """Raises an error if a body at rest would sink into a static by half its width."""
    h, gravity, bodies = fidelity.substep, math.hypot(*scene.gravity), len(scene.bodies)
    if given_stiffness(scene):
        return
    for half_pair in model.half_pair:
        i = int(half_pair["owner"])
        if i >= bodies or half_pair["surface"] < len(model.dynamic):
            continue
        width = scene.bodies[i].shape.width
        sink = gravity * float(half_pair["pair_mass"] / half_pair["stiffness"])
        if sink > _DEEPEST * width:
            longest = _below(h * math.sqrt(_DEEPEST * width / sink))
            raise ValueError(
                f"Fidelity.substep {h:g} s is too long for {scene.solid_names[i]}, which is "
                f"{width:g} m wide and would sink by {sink:.3g} m at rest: use at most {longest} "
                "s, or build the World with allow_unstable=True"
            )


def _check_servos(scene: Scene, fidelity: Fidelity, model: Model) -> None:
    h, bodies = fidelity.substep, len(scene.bodies)
    for i, drive in enumerate(scene.driven_bodies):
        longest = stability.of_servo(model.dynamic[bodies + i])
        if h >= longest:
            raise ValueError(
                f"Drive.frequency {drive.frequency:g} rad/s of {scene.solid_names[bodies + i]} "
                f"makes the substep of {h:g} s unstable: the largest safe step is "
                f"{_below(longest)} s; lower the frequency, shorten Fidelity.substep, or build the "
                "World with allow_unstable=True"
            )


def _check_fields(scene: Scene, fidelity: Fidelity, model: Model) -> None:
    longest, limiting = field_limits.longest_step(scene, model, fidelity.integrator)
    if fidelity.substep > longest:
        raise ValueError(
            f"Scene.fields[{limiting}], {scene.fields[limiting]!r}, makes the substep of "
            f"{fidelity.substep:g} s unstable: the largest safe step is {_below(longest)} s; lower "
            "its stiffness or damping, shorten Fidelity.substep, or build the World with "
            "allow_unstable=True"
        )


def _check_stiffness(scene: Scene, fidelity: Fidelity, model: Model, features: Features) -> None:
    given = given_stiffness(scene)
    if not given:
        return
    h = fidelity.substep
    step, limiting = largest_safe_step(scene, fidelity, model, features)
    if h > step:
        raise ValueError(
            f"Material.stiffness {max(given):g} N/m makes the substep of {h:g} s unstable: "
            f"{limiting} limits it, and the largest safe step is {_below(step)} s; lower the "
            "stiffness, shorten Fidelity.substep, or build the World with allow_unstable=True"
        )


def largest_safe_step(
    scene: Scene, fidelity: Fidelity, model: Model, features: Features
) -> tuple[float, str]:
    """A step in s that is safe in any state, and the name of the dynamic body that limits it.

    Where no material gives a stiffness it counts for contacts as stiff as at the present substep.
    """
    step, limiting = _safe_step(scene, fidelity, model, features)
    if fidelity.substep > step and given_stiffness(scene):
        for _ in range(8):  # the damping of friction depends slightly on the step
            model, _ = build(scene, replace(fidelity, substep=step))
            step, limiting = _safe_step(scene, fidelity, model, features)
    return step, limiting


def cause_of_divergence(
    scene: Scene, fidelity: Fidelity, model: Model, features: Features, h: float
) -> str:
    """The likely cause of worlds becoming non-finite at a substep of h s."""
    step, limiting = _safe_step(scene, fidelity, model, features)
    if h > step and given_stiffness(scene):
        return (
            f"the substep of {h:g} s is longer than the largest safe one, {_below(step)} s, which "
            f"{limiting} limits"
        )
    return "a state, speed or force too large for double precision"


def given_stiffness(scene: Scene) -> list[float]:
    """Stiffness in N/m of the materials that give one."""
    solids = (*scene.bodies, *scene.statics, *scene.driven_bodies)
    return [x.material.stiffness for x in solids if x.material.stiffness is not None]


def _safe_step(
    scene: Scene, fidelity: Fidelity, model: Model, features: Features
) -> tuple[float, str]:
    """A step in s that is safe in any state, and the name of the dynamic body that limits it."""
    step, i = stability.of_scene(scene, model, features, fidelity.spacing)
    return step, scene.solid_names[i]

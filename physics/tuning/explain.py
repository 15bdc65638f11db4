"""explain: what a fidelity models of a scene and what it leaves out, its limits and its cost."""

import math
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from physics.analysis.field_limits import longest_step
from physics.analysis.sinks import rest_depth
from physics.analysis.soft_supports import SoftSupport
from physics.analysis.step_limits import largest_safe_step
from physics.engines import choose_engine
from physics.manybody.limits import neighbourhoods
from physics.model.build import build
from physics.model.features import GENERAL, ISOTROPIC, Features, general
from physics.model.tables import Model
from physics.scene.drives import Drive
from physics.scene.fidelity import NEWTON, PRESETS, Fidelity, resolve
from physics.scene.mesh import Mesh
from physics.scene.scene import Scene
from physics.scene.solids import Body, Ground
from physics.scene.validation import instance
from physics.tuning.candidates import can_touch, safe_speed
from physics.tuning.description import code
from physics.tuning.motion import side_by_side
from physics.tuning.parts_cost import parts_cost
from physics.tuning.standing_text import standing
from physics.world import World

Array = np.ndarray

_TURN = 0.6  # rad in a substep, by which a jointed body may turn, see docs/joints.md
# contact resolutions of impulses at which stacks stand, see docs/physics.md
_STIFF, _NEWTON = PRESETS["solid"].contact_resolution, NEWTON.contact_resolution
_KINDS = 6  # different bodies that are listed
_PAIRS = 12  # different contacts that are listed

_ORDERS = {
    "midpoint": "midpoint rule (kick-drift-kick), second order, symplectic",
    "euler": "semi-implicit Euler, first order, symplectic",
    "rk4": "classical Runge-Kutta, fourth order",
    "adaptive": "Dormand-Prince pair with adaptive steps",
}


def explain(scene: Scene, fidelity: str | Fidelity = "balanced", *, costs: bool = True) -> str:
    """What a fidelity means for a scene, as text.

    It says what is modelled and what is left out, the largest stable step, the stiffness of
    contacts, how deep bodies sink at rest, how early they tip, and what each part costs.

    Args:
        scene: the scene.
        fidelity: a preset's name or a Fidelity.
        costs: measure costs, which takes a second, and up to a minute where kernels are compiled.

    Raises:
        TypeError: the scene is none, or the fidelity.
        ValueError: no preset has this name.
    """
    scene, fidelity = instance("scene", scene, Scene), resolve(fidelity)
    few = _kinds(scene)
    model, features = build(few, fidelity)
    lines = [code(fidelity), f"engine: {choose_engine(scene, fidelity)}"]
    lines += [f"kernel: {_kernel(features)}", "", "Models"]
    lines += [f"  {line}" for line in _modelled(scene, fidelity, features)]
    lines += ["", "Leaves out"]
    lines += [f"  {line}" for line in _left_out(scene, fidelity, features)] or ["  nothing"]
    lines += ["", "Steps"]
    refused, warned = _verdict(scene, fidelity)
    if refused:
        lines.append(f"  a World refuses it: {refused}")
    else:
        lines += [f"  {line}" for line in _steps(scene, few, fidelity, model, features)]
    if len(model.half_pair):
        lines += ["", "Contacts"]
        lines += [f"  {line}" for line in _contacts(few, fidelity, model)]
        lines += [f"  a World warns: {warned}"] if warned else []
        kinds = [_kind(solid) for solid in (*few.bodies, *few.driven_bodies, *few.statics)]
        stands = [f"  {line}" for line in standing(few, fidelity, model, kinds)]
        lines += ["", "Standing", *stands] if stands else []
    if costs and not refused:
        worlds = side_by_side(scene)
        which = "world" if worlds == 1 else "of many worlds"
        lines += ["", f"Cost per substep of one {which}, one thread"]
        lines += [f"  {line}" for line in _costs(scene, fidelity, worlds)]
    return "\n".join(lines)


def _kernel(features: Features) -> str:
    """Which kernels there are for a scene, and in what they differ."""
    more = general(features)
    if more is None:
        return "compiled for this scene; no general kernel has all that it needs"
    pairs = zip(Features._fields, features, more, strict=True)
    unneeded = [name for name, needs, has in pairs if has is True and not needs]
    return f"compiled for this scene, or a general one, which also has: {', '.join(unneeded)}"


def _kinds(scene: Scene) -> Scene:
    """A scene with at most two of each kind of body, without joints and fields on others."""
    if len(scene.bodies) <= 2 * _KINDS:
        return scene
    met: Counter[int] = Counter()
    bodies = []
    for body, kind in zip(scene.bodies, _kinds_of(scene), strict=False):
        met[kind] += 1
        if met[kind] <= 2 and kind < _KINDS:
            bodies.append(body)
    return replace(scene, bodies=bodies, fields=(), joints=())


def _kinds_of(scene: Scene) -> Array:
    """[solids] kind of each, numbered as they come; alike are shape, mass, material and masks."""
    known: dict[tuple[Any, ...], int] = {}
    kinds = []
    for solid in (*scene.bodies, *scene.driven_bodies, *scene.statics):
        form = (solid.height,) if isinstance(solid, Ground) else (solid.shape,)
        mass = getattr(solid, "mass", None)
        key = type(solid), *form, mass, solid.material, solid.group, solid.mask
        kinds.append(known.setdefault(key, len(known)))
    return np.array(kinds)


def _modelled(scene: Scene, fidelity: Fidelity, features: Features) -> Iterator[str]:
    yield f"motion: {_ORDERS[fidelity.integrator]}"
    if features.rotation == GENERAL:
        yield "rotation: all of Euler's equations, gyroscopic terms included"
    elif features.rotation == ISOTROPIC:
        yield "rotation: of bodies with three equal moments of inertia, so without gyroscopic terms"
    if can_touch(scene):
        geometry = "samples against exact surfaces"
        if fidelity.geometry == "particle":
            geometry = "spheres against spheres"
        if fidelity.law == "impulse":
            yield f"contacts: impulses that stop approach, {geometry}; restitution is exact"
            if features.newton:
                yield "solver: Newton's method, for all contacts of a world together"
            else:
                yield "solver: one Gauss-Seidel sweep per substep, contact after contact"
        elif fidelity.damping == "hunt_crossley":
            yield f"contacts: springs with Hunt-Crossley damping, {geometry}"
        else:
            yield f"contacts: springs with linear dashpots, {geometry}"
        if features.friction and features.viscous:
            yield "friction: proportional to slip, up to Coulomb's limit"
        elif features.friction:
            yield "friction: Coulomb's, static and sliding"
        if features.resistance:
            yield "rolling and spinning resistance"
    if scene.drives:
        yield f"drives: {len(scene.driven_bodies)} solids moved by servos with force limits"
    if scene.joints:
        yield f"joints: {len(scene.joints)}, held to round-off"
    if scene.fields:
        names = sorted({type(field).__name__ for field in scene.fields})
        yield f"fields: {', '.join(names)}"
    if features.time_control:
        yield f"time control: {fidelity.time_control}"


def _left_out(scene: Scene, fidelity: Fidelity, features: Features) -> Iterator[str]:
    touching = can_touch(scene)
    if not touching:
        yield "contacts: nothing can touch, none are compiled in"
    if features.rotation not in (GENERAL, ISOTROPIC):
        yield "rotation: nothing can make the bodies turn"
    if touching and not features.friction:
        yield "friction: every pair has the coefficient 0"
    if touching and features.friction and features.viscous:
        yield "static friction: bodies at rest on slopes creep"
    if touching and fidelity.law == "spring" and fidelity.damping == "dashpot":
        yield "restitution that doesn't depend on the moment of first contact within a step"
    if touching and not features.resistance:
        yield "rolling and spinning resistance: every coefficient is 0"
    if touching and fidelity.law == "impulse":
        yield "the course of an impact in time: a collision is over within a substep"
        solids = (*scene.bodies, *scene.driven_bodies, *scene.statics)
        if any(solid.material.stiffness is not None for solid in solids):
            yield "elastic deformation: impulses use Material.stiffness only for soft contacts"
        soft = _STIFF if fidelity.solver == "gauss_seidel" else _NEWTON
        if fidelity.contact_resolution < soft:
            yield (
                f"stiffness under load: contact_resolution={soft:g} suits this solver, at "
                f"{fidelity.contact_resolution:g} stacks are softer"
            )
    speed, thin = safe_speed(scene, fidelity)
    if fidelity.time_control == "fixed" and math.isfinite(speed):
        impulses = "" if fidelity.law == "impulse" else "law='impulse' with "
        yield (
            f"impacts within a step: what is faster than {speed:.3g} m/s can pass through the "
            f"thinnest solid, {1e3 * thin:.3g} mm; {impulses}time_control='swept' prevents it"
        )
    if touching and fidelity.geometry == "shape":
        yield f"sharp edges: boxes are rounded by {100 * fidelity.rounding:.3g} % of a half width"
        if any(isinstance(body.shape, Mesh) for body in scene.bodies):
            yield (
                "sharp edges of meshes: rounded by 1.5 Mesh.cells or more, so that slim ones tip "
                "early; more cells round less"
            )
    if not scene.drives and not scene.joints and not scene.fields:
        yield "drives, joints, fields: there are none"


def _steps(
    scene: Scene, few: Scene, fidelity: Fidelity, model: Model, features: Features
) -> Iterator[str]:
    if fidelity.integrator == "adaptive":
        yield f"chosen by the integrator, for an error of {fidelity.tolerance:g} per second"
        return
    step = fidelity.substep
    longest, name = _largest_step(scene, few, fidelity)
    by_fields = longest_step(few, model, fidelity.integrator)[0] if few.fields else math.inf
    if by_fields < longest:
        longest, name = by_fields, "a field"
    if math.isinf(longest):
        yield f"substep {1e3 * step:.4g} ms"
        if few.joints:
            yield f"a jointed body that turns faster than {_TURN / step:.3g} rad/s loses energy"
        impulses = fidelity.law == "impulse" and len(model.half_pair) > 0
        why = ", contacts with impulses are stable at any step" if impulses else ""
        yield f"largest stable substep: nothing limits it{why}"
    else:
        if step <= longest:
            stable = ": stable whatever touches"
        elif fidelity.law == "spring":
            stable = f": stable unless {name} lies flat on several others at once"
        else:
            stable = ""
        yield f"substep {1e3 * step:.4g} ms{stable}"
        yield f"largest substep that is stable whatever touches: {1e3 * longest:.3g} ms, by {name}"
        solids = (*few.bodies, *few.driven_bodies, *few.statics)
        if all(solid.material.stiffness is None for solid in solids) and len(model.half_pair):
            yield (
                "this limit scales with the substep, because no material gives a stiffness: "
                "contacts are as stiff as the substep allows"
            )


def _largest_step(scene: Scene, few: Scene, fidelity: Fidelity) -> tuple[float, str]:
    """The largest step in s that is stable whatever touches, and the body that limits it."""
    parts = [scene] if few is scene else neighbourhoods(scene, _kinds_of(scene), crowded=True)
    found = (largest_safe_step(part, fidelity, *build(part, fidelity)) for part in parts)
    return min(found, default=(math.inf, ""))


def _verdict(scene: Scene, fidelity: Fidelity) -> tuple[str, str]:
    """Why a World refuses a fidelity, and of which sink it warns; "" if it doesn't."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", SoftSupport)
            World(scene, fidelity)
    except ValueError as error:
        return str(error), ""
    return "", next((str(one.message) for one in caught if one.category is SoftSupport), "")


def _contacts(scene: Scene, fidelity: Fidelity, model: Model) -> Iterator[str]:
    """Per kind of pair: stiffness, phase per step, sink at rest, restitution, friction."""
    solids = (*scene.bodies, *scene.driven_bodies, *scene.statics)
    yield "pair                             N/m   rad per step  sink at rest      e   friction"
    listed: dict[tuple[str, ...], str] = {}
    slowest, pressed = math.inf, ""
    for n, row in enumerate(model.half_pair):
        i, j = int(row["owner"]), int(row["surface"])
        # the load of what rests on it: the lighter of two bodies, or the body on a static
        masses = [float(s.mass or 0.0) for s in (solids[i], solids[j]) if isinstance(s, Body)]
        sink = rest_depth(scene, model, n, min(masses)) if masses else 0.0
        phase = fidelity.substep * math.sqrt(float(row["stiffness"] / row["pair_mass"]))
        kinds = _kind(solids[i]), _kind(solids[j])
        pair = " on ".join(kinds)
        line = (
            f"{pair[:28]:28} {row['stiffness']:9.3g}   {phase:12.3g}  {1e3 * sink:9.3g} mm  "
            f"{row['restitution']:5.3g}   {row['friction']:8.3g}"
        )
        listed.setdefault(tuple(sorted(kinds)), line)
        # springs alone turn a speed into a depth of speed * substep / phase
        widths = [s.shape.width for s in (solids[i], solids[j]) if not isinstance(s, Ground)]
        speed = 0.5 * min(widths) * phase / fidelity.substep
        if speed < slowest:
            slowest, pressed = speed, pair
    yield from list(listed.values())[:_PAIRS]
    if len(listed) > _PAIRS:
        yield f"and {len(listed) - _PAIRS} more"
    yield "a body sinks by its own weight; below others, by theirs too"
    if fidelity.law == "spring":
        yield (
            f"an impact at {slowest:.3g} m/s ({pressed}) presses half of the narrower one in, a "
            "faster one more: impulses don't"
        )


def _kind(solid: Any) -> str:
    if isinstance(solid, Ground):
        return "Ground"
    kind = "Drive" if isinstance(solid, Drive) else type(solid).__name__
    shape = type(solid.shape).__name__
    name = solid.name or f"{kind} {shape}" if kind != "Body" else solid.name or shape
    return f"{name} {solid.mass:.3g} kg" if isinstance(solid, Body) else name


def _costs(scene: Scene, fidelity: Fidelity, worlds: int) -> Iterator[str]:
    parts = parts_cost(scene, fidelity, worlds)
    if math.isinf(parts[-1].cost):
        yield f"unknown, for the scene doesn't stay finite: {parts[-1].note}"
        return
    whole = sum(part.cost for part in parts if part.cost < math.inf)
    for part in parts:
        if math.isinf(part.cost):
            yield f"{part.name:18} can't be simulated without what follows"
        else:
            yield f"{part.name:18} {1e9 * part.cost:8,.0f} ns  {100 * part.cost / whole:4.0f} %"
    if fidelity.integrator != "adaptive":
        yield f"{'all':18} {1e9 * whole:8,.0f} ns, {fidelity.substep / whole:,.0f} simulated s/s"

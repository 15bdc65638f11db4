"""Columns of a model that depend on masses, materials and sizes, for any number of worlds at once.

A scene's own model is the case of one world. All formulas are elementwise over worlds and
half-pairs, so a world's numbers are bitwise the same however many are computed with them.
"""

import numpy as np

from physics.model.normal_damping import damping_coefficients, damping_errors, rest_time
from physics.model.pairs import Layout, pair_stiffness
from physics.model.tangential import SHEAR_RATIO, shear_ratio, tangential_coefficients
from physics.scene.compound import Compound
from physics.scene.drives import Drive
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.shapes import PLANE, Samples, Shape
from physics.scene.solids import Body, Ground

Array = np.ndarray
Columns = dict[str, Array]

# Stiffness per mass of a cube's rocking on a face, relative to bobbing. Plates and rods rock faster
# still and would outrun the time step, so their contacts are made softer by the ratio
_CUBE_ROCKING = 9.0 / 8.0
# Lower bound of the restitution of such slim bodies under the spring law, as a multiple of
# contact_resolution (1 - softness). Damping that ends a landing within one step is too strong for
# rocking that is faster than the landing: the body would gain energy (docs/decisions)
_SLIM_RESTITUTION = 0.24
# Impulse law: damping ratio of a soft contact
SOFT_DAMPING = 1.0
# Newton's method: fraction of an overlap that closes in a step
CLOSING = 0.3
# of the sweeps in steps that Newton's method doesn't solve: omega h, as in the preset "solid"
SWEEP_RESOLUTION = 1.8
# Impulse law: number of steps of free fall whose speed counts as rest
REST_STEPS = 4.0


def _of_solids(bodies: Array, others: list[float]) -> Array:
    """[n, solids]: values [n, bodies] of the bodies, followed by those of the other solids."""
    rest = np.broadcast_to(np.array(others, dtype=float), (len(bodies), len(others)))
    return np.concatenate([bodies, rest], axis=1)


def _inertia(layout: Layout, p: Parameters) -> Array:
    """Principal moments [n, bodies, 3] in kg m^2."""
    moments = np.empty((*p.mass.shape, 3))
    for i, body in enumerate(layout.solids[: layout.bodies]):
        assert isinstance(body, Body)
        square = p.size[:, i] * p.size[:, i]
        moments[:, i] = square[:, None] * body.shape.inertia(p.mass[:, i])
    return moments


def dynamic_columns(layout: Layout, p: Parameters) -> Columns:
    """Columns [n, dynamic bodies, ...] of DYNAMIC, by name."""
    n, drives = len(p.mass), layout.solids[layout.bodies : layout.dynamic_count]
    infinite = np.full((n, len(drives), 3), np.inf)
    inertia = np.concatenate([_inertia(layout, p), infinite], axis=1)
    # a drive's carriage holds its weight. + 0.0 turns -0.0 into 0.0
    weight = np.zeros((n, layout.dynamic_count, 3))
    weight[:, : layout.bodies] = p.mass[:, :, None] * layout.gravity + 0.0
    mass = [d.mass for d in drives if isinstance(d, Drive)]
    shapes = [s.shape for s in layout.solids[: layout.dynamic_count] if not isinstance(s, Ground)]
    core = [_core_reach(shape, layout.fidelity.geometry == "shape") for shape in shapes]
    return {
        "core_reach": _of_solids(p.size, [1.0] * len(drives)) * np.array(core),
        "inverse_mass": 1.0 / _of_solids(p.mass, mass),
        "inertia": inertia,
        "inverse_inertia": 1.0 / inertia,
        "weight": weight,
    }


def contact_columns(
    fidelity: Fidelity,
    gravity: Array,
    pairs: tuple[Array, Array],
    given: Array,
    mass: Array,
    friction: Array,
    restitution: Array,
    modes: Array,
    leverage: Array,
) -> Columns:
    """Columns [n, pairs] of HALF_PAIR that describe the contact law, by name.

    Args:
        fidelity: of the physics.
        gravity: [3] m/s^2.
        pairs: two arrays [pairs] of solids.
        given: [pairs] N/m, stiffness of the materials, NaN: it follows from the fidelity.
        mass: [n, solids] kg, as the next two.
        friction: of each solid.
        restitution: likewise.
        modes: [solids, 2] see `Layout.modes`.
        leverage: [solids] see `Layout.leverage`.
    """
    a, b = pairs
    restitution = np.maximum(restitution[:, a], restitution[:, b])
    friction = np.sqrt(friction[:, a] * friction[:, b])
    h, omega = fidelity.substep, fidelity.contact_resolution / fidelity.substep
    g = float(np.sqrt(np.sum(gravity**2)))
    inverse = 1.0 / mass
    pair_mass = 1.0 / (inverse[:, a] + inverse[:, b])
    along, across = modes[:, 0], modes[:, 1]
    soft = np.minimum(1.0, _CUBE_ROCKING / np.maximum(along[a], along[b]))
    stiffness = np.where(np.isnan(given), pair_mass * omega**2 * soft, given)
    # effective mass of a tangential force at the surface, rotation included
    shear = 1.0 / (mass / across)
    shear_mass = 1.0 / (shear[:, a] + shear[:, b])
    shear_stiffness, shear_damping = tangential_coefficients(
        stiffness,
        pair_mass,
        shear_mass,
        leverage[a] + leverage[b],
        shear_ratios(fidelity, given),
        h,
    )
    spring = shear_stiffness * (fidelity.friction != "viscous")
    loads = _shear_loads(spring, shear_damping, shear[:, a], shear[:, b], h)
    for name in ("owner_shear_load", "surface_shear_load"):
        loads[name] = loads[name] * (friction > 0.0)
    if fidelity.law == "impulse":
        softest = pair_mass * (SWEEP_RESOLUTION / h) ** 2 * soft
        newton = fidelity.solver == "newton"
        sweep_stiffness = np.minimum(stiffness, softest) if newton else stiffness
        sweep_damping = 2.0 * SOFT_DAMPING * np.sqrt(sweep_stiffness * pair_mass)
        damping = stiffness * h * (1.0 / CLOSING - 1.0) if newton else sweep_damping
        damping_error = np.zeros(stiffness.shape)
        span = np.full(stiffness.shape, REST_STEPS * h)
    else:
        floor = _SLIM_RESTITUTION * fidelity.contact_resolution * (1.0 - soft)
        reached = np.maximum(restitution, floor)
        damping = damping_coefficients(reached, fidelity.damping)
        damping_error = damping_errors(reached, damping, fidelity.damping)
        sweep_stiffness, sweep_damping = stiffness, np.zeros(stiffness.shape)
        span = rest_time(damping, np.sqrt(stiffness / pair_mass))
    return {
        "stiffness": stiffness,
        "damping": damping,
        "sweep_stiffness": sweep_stiffness,
        "sweep_damping": sweep_damping,
        "damping_error": damping_error,
        "restitution": restitution,
        "rest_time": span,
        "rest_speed": span * g,
        "pair_mass": pair_mass,
        "shear_stiffness": shear_stiffness,
        "shear_damping": shear_damping,
        **loads,
        "friction": friction,
    }


def _shear_loads(spring: Array, damping: Array, one: Array, two: Array, h: float) -> Columns:
    """Largest eigenvalues of a step's friction on two bodies, see `spring.mass_splitting`.

    `one` and `two` are their inverse masses. Likewise for resistance and inverse inertia.
    """
    load, coupling = h * (damping + 0.5 * h * spring), np.sqrt(one * two)
    part = 0.5 * h * spring / np.maximum(damping + 0.5 * h * spring, np.finfo(float).tiny)
    return {
        "owner_shear_load": load * (one + coupling),
        "surface_shear_load": load * (two + coupling),
        "spring_part": part,
    }


def shear_ratios(fidelity: Fidelity, given: Array) -> Array:
    """Ratio of shear to normal stiffness of pairs; `given` as in `contact_columns`."""
    return np.where(np.isnan(given), shear_ratio(fidelity.contact_resolution), SHEAR_RATIO)


def half_pair_columns(layout: Layout, p: Parameters) -> Columns:
    """Columns [n, half-pairs, ...] of HALF_PAIR, by name."""
    solids, half_pairs, fidelity = layout.solids, layout.half_pairs, layout.fidelity
    rest = solids[layout.bodies :]
    a = np.array([half_pair.owner for half_pair in half_pairs], dtype=int)
    b = np.array([half_pair.other for half_pair in half_pairs], dtype=int)

    masses = [s.mass if isinstance(s, Drive) else np.inf for s in rest]
    mass = _of_solids(p.mass, masses)
    size = _of_solids(p.size, [1.0] * len(rest))
    friction = _of_solids(p.friction, [s.material.friction for s in rest])
    restitution = _of_solids(p.restitution, [s.material.restitution for s in rest])
    given = np.array([pair_stiffness(solids[i].material, solids[j].material)
                      for i, j in zip(a, b, strict=True)])  # fmt: skip
    contact = contact_columns(
        fidelity, layout.gravity, (a, b), given, mass, friction, restitution, layout.modes,
        layout.leverage,
    )  # fmt: skip
    h, omega = fidelity.substep, fidelity.contact_resolution / fidelity.substep
    inverse = 1.0 / mass

    least = _of_solids(_inertia(layout, p).min(axis=-1), [np.inf] * len(rest))
    turns = (a < layout.bodies) | (b < layout.bodies)  # a drive on the ground never rotates
    turning = np.where(turns, 1.0 / least[:, a] + 1.0 / least[:, b], 1.0)
    twist_stiffness, twist_damping = tangential_coefficients(
        omega**2 / turning,
        1.0 / turning,
        1.0 / turning,
        np.zeros(len(half_pairs)),
        np.array(SHEAR_RATIO),
        h,
    )

    twist_stiffness = np.where(turns, twist_stiffness, 1.0)
    twist_damping = np.where(turns, twist_damping, 0.0)
    one, two = 1.0 / least[:, a], 1.0 / least[:, b]
    resisting = _shear_loads(twist_stiffness, twist_damping, one, two, h)
    resistance = np.array([
        s.material.rolling_resistance + s.material.spinning_resistance
        for s in solids
    ])  # fmt: skip
    resists = resistance[a] + resistance[b] > 0.0
    for name in ("owner_shear_load", "surface_shear_load"):
        contact[name] = contact[name] + np.where(resists, resisting[name], 0.0)

    # only the widths of dynamic bodies limit the skin
    widths = np.array([np.inf if isinstance(s, Ground) else s.shape.width for s in solids]) * size
    moving = np.where(np.arange(len(solids)) < layout.dynamic_count, widths, np.inf)
    reach = np.array([0.0 if isinstance(s, Ground) else s.shape.reach for s in solids]) * size
    owner_reach, surface_reach = reach[:, a], reach[:, b]
    for k, half_pair in enumerate(half_pairs):
        if fidelity.geometry == "particle":
            far = _particle_reach(half_pair.samples)
            owner_reach[:, k] = np.maximum(owner_reach[:, k], far * size[:, half_pair.owner])
            if half_pair.partners is not None:
                far = _particle_reach(half_pair.partners)
                surface_reach[:, k] = np.maximum(
                    surface_reach[:, k], far * size[:, half_pair.other]
                )
        if half_pair.part >= 0:  # about the part's own centre
            part = layout.parts[half_pair.part][1]
            surface_reach[:, k] = part.shape.reach * size[:, half_pair.other]
    # Where a narrow face touches a wide one, few samples of the wide one are in contact, so the
    # narrow one's carry more of the load; equal faces carry half each. Which face touches isn't
    # known: a solid counts as the cube of its volume
    shared = np.array([half_pair.both_sampled for half_pair in half_pairs], dtype=bool)
    volumes = np.array([1.0 if isinstance(s, Ground) else s.shape.volume for s in solids])
    breadth = np.cbrt(volumes) * size
    own = np.where(shared, breadth[:, a], 1.0)
    other = np.where(shared, breadth[:, b], 1.0)
    own, other = own * own, other * other
    sampled = np.array([half_pair.samples.radius for half_pair in half_pairs])
    rounded = np.array([half_pair.surface.radius for half_pair in half_pairs])
    cores = np.array([half_pair.surface.parameters for half_pair in half_pairs]).reshape(-1, 3)
    plane = np.array([half_pair.surface.kind == PLANE for half_pair in half_pairs], dtype=bool)
    return {
        "core": cores * np.where(plane, 1.0, size[:, b])[:, :, None],
        "owner_radius": sampled * size[:, a],
        "radius": sampled * size[:, a] + rounded * size[:, b],
        "owner_reach": owner_reach,
        "surface_reach": surface_reach,
        "owner_size": size[:, a],
        "surface_size": size[:, b],
        "load_share": np.where(shared, other / (own + other), 1.0),
        "skin": fidelity.skin * np.minimum(moving[:, a], moving[:, b]),
        "free_motion": 0.5 * fidelity.courant * np.minimum(widths[:, a], widths[:, b]),
        **contact,
        "owner_inverse_mass": inverse[:, a],
        "surface_inverse_mass": inverse[:, b],
        "overlap_share": _overlap_share(layout, mass, a, b),
        "surface_centre": _surface_centres(layout, size[:, b]),
        "surface_inverse_inertia": _surface_inverse_inertia(layout, p),
        "twist_stiffness": twist_stiffness,
        "twist_damping": twist_damping,
    }


def _overlap_share(layout: Layout, mass: Array, a: Array, b: Array) -> Array:
    """[n, half-pairs]: part of the overlap by which the owner yields, see `contact_point`."""
    bodies = np.arange(len(layout.solids)) < layout.bodies
    inverse = np.where(bodies, 1.0 / mass, 0.0)  # nothing else rotates
    least = np.finfo(float).tiny  # neither is a body: the point doesn't matter
    return np.asarray(inverse[:, b] / np.maximum(inverse[:, a] + inverse[:, b], least))


def _surface_centres(layout: Layout, size: Array) -> Array:
    """[n, half-pairs, 3] m: centre of mass of a compound in the frame of its part."""
    centres = np.zeros((*size.shape, 3))
    for k, half_pair in enumerate(layout.half_pairs):
        if half_pair.part >= 0:
            part = layout.parts[half_pair.part][1]
            centres[:, k] = -size[:, k, None] * (part.rotation.T @ np.array(part.position))
    return centres


def _surface_inverse_inertia(layout: Layout, p: Parameters) -> Array:
    """[n, half-pairs, 3] 1/(kg m^2): inverse moments of the surface's body, in the surface's frame.

    Zero except where the owner has a single sample, as a sphere does. That sample has all of the
    pair's damping at one point, however far from the surface's centre of mass, so the law needs the
    effective mass there; many samples have a small part each. Where a part is rotated within its
    compound the tensor A isn't diagonal; m . A m is then replaced by its upper bound
    sum_i m_i^2 sum_j |A_ij|, so the damping is never too strong.
    """
    inverse = 1.0 / _inertia(layout, p)
    columns = np.zeros((len(inverse), len(layout.half_pairs), 3))
    for k, half_pair in enumerate(layout.half_pairs):
        if half_pair.other < layout.bodies and len(half_pair.samples.weights) == 1:
            part = half_pair.part
            rotation = np.eye(3) if part < 0 else layout.parts[part][1].rotation
            tensor = np.einsum("ki,nk,kj->nij", rotation, inverse[:, half_pair.other], rotation)
            columns[:, k] = np.abs(tensor).sum(axis=-1)
    return columns


def _core_reach(shape: Shape, rounded: bool) -> float:
    """Largest distance in m from the centre of a point that rotation moves.

    A rounded surface rotates in place, so the rounding radius doesn't count.
    """
    if isinstance(shape, Compound) and shape.only is not None:
        shape = shape.only
    if isinstance(shape, Compound) or not rounded:
        return shape.reach
    return shape.reach - shape.surface(0.0).radius


def _particle_reach(samples: Samples) -> float:
    """Largest distance in m from the centre of the samples' balls, which may leave the shape."""
    return float(np.linalg.norm(samples.positions, axis=1).max(initial=0.0)) + samples.radius


def compound_part_columns(layout: Layout, p: Parameters) -> Columns:
    """Columns [n, parts, ...] of COMPOUND_PART, by name."""
    owners = np.array([solid for solid, _ in layout.parts], dtype=int)
    places = np.array([part.position for _, part in layout.parts]).reshape(-1, 3)
    size = _of_solids(p.size, [1.0] * (len(layout.solids) - layout.bodies))
    return {"position": size[:, owners, None] * places}

"""The numbers of a model that follow from masses, materials and sizes: of any worlds at once.

A scene's own model is the case of one world. Everything is elementwise over worlds and sides, so a
world's numbers don't depend, to the last bit, on how many are worked out with them.
"""

import numpy as np

from physics.model.normal_damping import damping_coefficients, rest_speed
from physics.model.pairs import Layout, leverage, pair_stiffness
from physics.model.tangential import SHEAR_RATIO, shear_ratio, tangential_coefficients
from physics.scene.compound import Compound
from physics.scene.parameters import Parameters
from physics.scene.scene import Body, Drive, Ground
from physics.scene.shapes import PLANE, Shape

Array = np.ndarray
Columns = dict[str, Array]
# How much faster a cube rocks on its face than it bobs, in stiffness by mass. A plate rocks twice
# as fast again, and would outrun the step: its contacts are that much softer
_CUBE = 9.0 / 8.0
# Floor of the restitution of such bodies by springs, times 1 - soft and contact_resolution. Damping
# that ends a landing within a step is too strong for rocking that is faster than the landing: a
# thin rod, or a plate, rose to six times its energy at e = 0, and one that landed flat rebounded
# with up to 1.3 v. The shorter a step is for the contact, the stronger the damping may be
_THIN = 0.24
# of the impulse law: the damping ratio of a soft contact, and the steps of free fall whose speed
# counts as rest
SOFT_DAMPING, REST_STEPS = 1.0, 4.0


def _of_solids(bodies: Array, others: list[float]) -> Array:
    """[n, solids]: a value [n, bodies] of the bodies, beside those of the other solids."""
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


def of_movers(layout: Layout, p: Parameters) -> Columns:
    """Columns [n, movers, ...] of MOVER, by name: bodies, then drives."""
    n, drives = len(p.mass), layout.solids[layout.bodies : layout.movers]
    endless = np.full((n, len(drives), 3), np.inf)
    inertia = np.concatenate([_inertia(layout, p), endless], axis=1)
    # the carriage carries a drive; without a negative zero, which sums would lose
    weight = np.zeros((n, layout.movers, 3))
    weight[:, : layout.bodies] = p.mass[:, :, None] * layout.gravity + 0.0
    mass = [d.mass for d in drives if isinstance(d, Drive)]
    shapes = [s.shape for s in layout.solids[: layout.movers] if not isinstance(s, Ground)]
    core = [_core_reach(shape, layout.fidelity.geometry == "shape") for shape in shapes]
    return {
        "core_reach": _of_solids(p.size, [1.0] * len(drives)) * np.array(core),
        "inverse_mass": 1.0 / _of_solids(p.mass, mass),
        "inertia": inertia,
        "inverse_inertia": 1.0 / inertia,
        "weight": weight,
    }


def of_sides(layout: Layout, p: Parameters) -> Columns:
    """Columns [n, sides, ...] of SIDE, by name."""
    solids, sides, fidelity = layout.solids, layout.sides, layout.fidelity
    rest = solids[layout.bodies :]
    a = np.array([side.owner for side in sides], dtype=int)
    b = np.array([side.other for side in sides], dtype=int)

    masses = [s.mass if isinstance(s, Drive) else np.inf for s in rest]
    mass = _of_solids(p.mass, masses)
    size = _of_solids(p.size, [1.0] * len(rest))
    friction = _of_solids(p.friction, [s.material.friction for s in rest])
    restitution = _of_solids(p.restitution, [s.material.restitution for s in rest])
    restitution = np.maximum(restitution[:, a], restitution[:, b])
    friction = np.sqrt(friction[:, a] * friction[:, b])
    given = np.array([pair_stiffness(solids[i].material, solids[j].material)
                      for i, j in zip(a, b, strict=True)])  # fmt: skip

    h, omega = fidelity.substep, fidelity.contact_resolution / fidelity.substep
    g = float(np.sqrt(np.sum(layout.gravity**2)))
    inverse = 1.0 / mass
    pair_mass = 1.0 / (inverse[:, a] + inverse[:, b])
    along, across = layout.modes[:, 0], layout.modes[:, 1]
    soft = np.minimum(1.0, _CUBE / np.maximum(along[a], along[b]))
    stiffness = np.where(np.isnan(given), pair_mass * omega**2 * soft, given)
    # mass that a tangential force at the surface feels, turning included
    shear = 1.0 / (mass / across)
    shear_mass = 1.0 / (shear[:, a] + shear[:, b])
    levers = np.array([leverage(solid) for solid in solids])
    shear_stiffness, shear_damping = tangential_coefficients(
        stiffness,
        pair_mass,
        shear_mass,
        levers[a] + levers[b],
        np.where(np.isnan(given), shear_ratio(fidelity.contact_resolution), SHEAR_RATIO),
        h,
    )

    least = _of_solids(_inertia(layout, p).min(axis=-1), [np.inf] * len(rest))
    turns = (a < layout.bodies) | (b < layout.bodies)  # a tool that meets the ground never does
    turning = np.where(turns, 1.0 / least[:, a] + 1.0 / least[:, b], 1.0)
    twist_stiffness, twist_damping = tangential_coefficients(
        omega**2 / turning,
        1.0 / turning,
        1.0 / turning,
        np.zeros(len(sides)),
        np.array(SHEAR_RATIO),
        h,
    )

    if fidelity.law == "impulse":
        damping = 2.0 * SOFT_DAMPING * np.sqrt(stiffness * pair_mass)
        slowest = np.full(stiffness.shape, REST_STEPS * g * h)
    else:
        floor = _THIN * fidelity.contact_resolution * (1.0 - soft)
        damping = damping_coefficients(np.maximum(restitution, floor), fidelity.damping)
        slowest = rest_speed(damping, g, np.sqrt(stiffness / pair_mass))

    # grounds have no width that counts, and statics none that limits the skin
    widths = np.array([np.inf if isinstance(s, Ground) else s.shape.width for s in solids]) * size
    moving = np.where(np.arange(len(solids)) < layout.movers, widths, np.inf)
    reach = np.array([0.0 if isinstance(s, Ground) else s.shape.reach for s in solids]) * size
    # of a compound's part, about its own centre
    surface_reach = reach[:, b]
    for k, side in enumerate(sides):
        if side.part >= 0:
            surface_reach[:, k] = layout.parts[side.part][1].shape.reach * size[:, side.other]
    # of a wide face few samples lie where a narrow one touches it, so the narrow one's bear the
    # more: half and half of equal ones. Which of its faces a solid touches with isn't known: it
    # counts as the cube of its volume
    shared = np.array([side.shared for side in sides], dtype=bool)
    volumes = np.array([1.0 if isinstance(s, Ground) else s.shape.volume for s in solids])
    breadth = np.cbrt(volumes) * size
    own = np.where(shared, breadth[:, a], 1.0)
    other = np.where(shared, breadth[:, b], 1.0)
    own, other = own * own, other * other
    sampled = np.array([side.samples.radius for side in sides])
    rounded = np.array([side.surface.radius for side in sides])
    cores = np.array([side.surface.parameters for side in sides]).reshape(-1, 3)
    plane = np.array([side.surface.kind == PLANE for side in sides], dtype=bool)
    return {
        "core": cores * np.where(plane, 1.0, size[:, b])[:, :, None],
        "owner_radius": sampled * size[:, a],
        "radius": sampled * size[:, a] + rounded * size[:, b],
        "owner_reach": reach[:, a],
        "surface_reach": surface_reach,
        "owner_size": size[:, a],
        "surface_size": size[:, b],
        "share": np.where(shared, other / (own + other), 1.0),
        "skin": fidelity.skin * np.minimum(moving[:, a], moving[:, b]),
        "stiffness": stiffness,
        "damping": damping,
        "restitution": restitution,
        "rest_speed": slowest,
        "pair_mass": pair_mass,
        "owner_inverse_mass": inverse[:, a],
        "surface_inverse_mass": inverse[:, b],
        "surface_centre": _surface_centres(layout, size[:, b]),
        "yielding": _yielding(layout, p),
        "shear_stiffness": shear_stiffness,
        "shear_damping": shear_damping,
        "friction": friction,
        "twist_stiffness": np.where(turns, twist_stiffness, 1.0),
        "twist_damping": np.where(turns, twist_damping, 0.0),
    }


def _surface_centres(layout: Layout, size: Array) -> Array:
    """[n, sides, 3] m: a part's frame lies apart from the centre of its compound."""
    centres = np.zeros((*size.shape, 3))
    for k, side in enumerate(layout.sides):
        if side.part >= 0:
            part = layout.parts[side.part][1]
            centres[:, k] = -size[:, k, None] * (part.rotation.T @ np.array(part.position))
    return centres


def _yielding(layout: Layout, p: Parameters) -> Array:
    """[n, sides, 3] 1/(kg m^2): inverse moments of the surface's body, in the surface's frame.

    Only a sphere meets a body with all of the pair's damping at one point, however far from the
    body's centre: it must know how easily the body turns there. Of others each of many samples has
    a small share. Where a part lies askew in its compound, the tensor A there isn't diagonal: for
    m . A m stands the bound sum_i m_i^2 sum_j |A_ij|, which never damps too much.
    """
    inverse = 1.0 / _inertia(layout, p)
    yielding = np.zeros((len(inverse), len(layout.sides), 3))
    for k, side in enumerate(layout.sides):
        if side.other < layout.bodies and len(side.samples.weights) == 1:
            turn = np.eye(3) if side.part < 0 else layout.parts[side.part][1].rotation
            tensor = np.einsum("ki,nk,kj->nij", turn, inverse[:, side.other], turn)
            yielding[:, k] = np.abs(tensor).sum(axis=-1)
    return yielding


def _core_reach(shape: Shape, rounded: bool) -> float:
    """Farthest point in m from a shape's centre that turning moves: roundings turn in place."""
    if isinstance(shape, Compound) and shape.only is not None:
        shape = shape.only
    if isinstance(shape, Compound) or not rounded:
        return shape.reach
    return shape.reach - shape.surface(0.0).radius


def of_parts(layout: Layout, p: Parameters) -> Columns:
    """Columns [n, parts, ...] of PART, by name."""
    owners = np.array([solid for solid, _ in layout.parts], dtype=int)
    places = np.array([part.position for _, part in layout.parts]).reshape(-1, 3)
    size = _of_solids(p.size, [1.0] * (len(layout.solids) - layout.bodies))
    return {"position": size[:, owners, None] * places}

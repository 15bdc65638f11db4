"""Model: the constants of a scene at a fidelity, as arrays that kernels read.

Movers are the bodies, then the drives. Solids are the movers, then the statics. A pair of solids
meets through one or two sides: the samples of an owner against the surface of another.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from physics.features import GENERAL, ISOTROPIC, NO_ROTATION, Features
from physics.fidelity import Fidelity
from physics.landing import fastest
from physics.scene import NO_TURN, Body, Drive, Ground, Material, Scene, Static
from physics.shapes import BOX, CAPSULE, PARTICLES, PLANE, SPHERE, Box, Samples, Sphere, Surface
from physics.stages.friction import tangential_coefficients
from physics.stages.normal_force import damping_coefficient, rest_speed

Array = np.ndarray
# How much faster a cube rocks on its face than it bobs, in stiffness by mass. A plate rocks twice
# as fast again, and would outrun the step: its contacts are that much softer
_CUBE = 9.0 / 8.0
# of the impulse law: the damping ratio of a soft contact, and the steps of free fall whose speed
# counts as rest
SOFT_DAMPING, REST_STEPS = 1.0, 4.0
Solid = Body | Drive | Static | Ground


# one row a mover: bodies, then drives. A drive has no inertia: it never turns
MOVER = np.dtype(
    [
        ("turns", "i8"),  # 1 for a body, 0 for a drive
        ("reach", "f8"),  # m, farthest surface point from the centre
        ("inverse_mass", "f8"),  # 1/kg
        ("inertia", "f8", (3,)),  # kg m^2, principal moments; infinite for drives
        ("inverse_inertia", "f8", (3,)),  # 1/(kg m^2); 0 for drives
        ("weight", "f8", (3,)),  # N; 0 for drives, whose carriage carries them
        ("servo_stiffness", "f8"),  # N/m
        ("servo_damping", "f8"),  # N s/m
        ("force_limit", "f8"),  # N along each axis
        ("twin", "i8"),  # the other finger of a gripper, or -1
        ("grip_limit", "f8"),  # N between the two
    ],
    align=True,
)

# one row a side: the samples of an owner against the surface of another solid
SIDE = np.dtype(
    [
        ("owner", "i8"),  # solid that carries the samples
        ("surface", "i8"),  # solid whose surface they meet
        ("kind", "i8"),  # of that surface
        ("mirror", "i8"),  # the side of the same pair the other way round, or -1
        ("first_sample", "i8"),  # into Model.sample
        ("sample_count", "i8"),
        ("first_partner", "i8"),  # likewise, the particles of a particle surface
        ("partner_count", "i8"),
        ("first_slot", "i8"),  # room for candidates
        ("slot_count", "i8"),
        ("sharp", "i8"),  # 1: corners and edges of a box, which faces push out
        ("core", "f8", (3,)),  # m, parameters of the surface's core
        ("owner_radius", "f8"),  # m, of the samples
        ("radius", "f8"),  # m, of the samples and the surface's rounding together
        ("owner_reach", "f8"),  # m
        ("surface_reach", "f8"),  # m
        ("skin", "f8"),  # m
        ("stiffness", "f8"),  # N/m of a whole face
        ("damping", "f8"),  # the law's coefficient
        ("restitution", "f8"),
        ("rest_speed", "f8"),  # m/s, floor of the impact speed
        ("pair_mass", "f8"),  # kg, reduced mass
        ("shear_stiffness", "f8"),  # N/m
        ("shear_damping", "f8"),  # N s/m
        ("friction", "f8"),
        ("rolling", "f8"),  # m, of the resistance against it
        ("spinning", "f8"),  # m, likewise
        ("twist_stiffness", "f8"),  # N m
        ("twist_damping", "f8"),  # N m s
    ],
    align=True,
)


class Model(NamedTuple):
    """The constants of a scene.

    Attributes:
        mover: [m] of MOVER.
        side: [k] of SIDE.
        static: [s, 7] position m and quaternion x y z w of the statics.
        sample: [p, 4] x y z in m in the owner's frame, and weight.
    """

    mover: Array
    side: Array
    static: Array
    sample: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays: once for all worlds."""
        return sum(array.nbytes for array in self)


class Side(NamedTuple):
    """The samples of solid `owner` against the surface of solid `other`."""

    owner: int
    other: int
    samples: Samples
    surface: Surface
    partners: Samples | None


def _pair_material(a: Material, b: Material) -> tuple[float, float, float | None]:
    """Friction, restitution and stiffness of two surfaces in contact."""
    given = [m.stiffness for m in (a, b) if m.stiffness is not None]
    stiffness = 1.0 / sum(1.0 / k for k in given) if given else None
    return math.sqrt(a.friction * b.friction), max(a.restitution, b.restitution), stiffness


def _resistance(a: Material, b: Material) -> tuple[float, float]:
    """Lengths in m of the resistance against rolling and spinning."""
    rolling = max(a.rolling_resistance, b.rolling_resistance)
    return rolling, max(a.spinning_resistance, b.spinning_resistance)


def _least_inertia(solid: Solid) -> float:
    """Smallest principal moment in kg m^2; infinite for what doesn't turn."""
    if not isinstance(solid, Body):
        return math.inf
    assert solid.mass is not None
    return float(solid.shape.inertia(solid.mass).min())


def _spacing(solid: Solid, scene: Scene, fidelity: Fidelity) -> float:
    """Sample spacing in m, for the smallest body: it would fall between coarser samples."""
    if isinstance(solid, Ground):
        return math.inf
    widths = [body.shape.width for body in scene.bodies]
    return fidelity.spacing * min([solid.shape.width, *widths])


def _sides(scene: Scene, fidelity: Fidelity) -> Iterator[Side]:
    """All sides through which the scene's solids can meet, in a fixed order."""
    solids: list[Solid] = [*scene.bodies, *scene.tools, *scene.statics]
    movers = len(scene.bodies) + len(scene.tools)

    def rounding(solid: Body | Drive | Static) -> float:
        return fidelity.rounding * solid.shape.width / 2.0

    def samples(solid: Body | Drive | Static) -> Samples:
        spacing = _spacing(solid, scene, fidelity)
        if fidelity.geometry == "particle" and isinstance(solid, Body):
            return solid.shape.particles(spacing)
        return solid.shape.samples(spacing, rounding(solid))

    # a gripper's servo keeps its fingers apart
    first_tool = len(scene.bodies)
    twins = {(first_tool + first, first_tool + first + 1) for first, _ in scene.grippers}
    for i, a in enumerate(solids[:movers]):
        assert not isinstance(a, Static | Ground)
        for j in range(i + 1, len(solids)):
            b = solids[j]
            if (i, j) in twins:
                continue
            if isinstance(b, Ground):
                plane = Surface(PLANE, (b.height, 0.0, 0.0), 0.0)
                yield Side(i, j, samples(a), plane, None)
                continue
            bodies = isinstance(a, Body) and isinstance(b, Body)
            if fidelity.geometry == "particle" and bodies:
                pa, pb = samples(a), samples(b)
                yield Side(i, j, pa, Surface(PARTICLES, (0.0, 0.0, 0.0), pb.radius), pb)
                continue
            forward = Side(i, j, samples(a), b.shape.surface(rounding(b)), None)
            backward = Side(j, i, samples(b), a.shape.surface(rounding(a)), None)
            if fidelity.geometry == "particle" and isinstance(a, Body):
                yield forward  # particles leave no gap for a tool to slip through
            elif isinstance(a.shape, Sphere):
                yield forward  # the centre of a sphere is exact
            elif isinstance(b.shape, Sphere):
                yield backward
            else:
                # of a wide face few samples lie where a narrow one touches it, so the narrow one's
                # bear the more: half and half of equal ones
                area, other = a.shape.width**2, b.shape.width**2
                for side, share in ((forward, other), (backward, area)):
                    weights = share / (area + other) * side.samples.weights
                    yield side._replace(samples=side.samples._replace(weights=weights))


def _capacity(side: Side) -> int:
    """Candidates that a side has room for: all its samples, or eight partners to each particle."""
    n = len(side.samples.weights)
    if side.partners is None:
        return n
    m = len(side.partners.weights)
    return min(n * m, 8 * max(n, m))


def _fastest(solid: Solid) -> tuple[float, float]:
    """See `landing.fastest`, at one spacing for all fidelities; 1 for what doesn't turn."""
    if not isinstance(solid, Body):
        return 1.0, 1.0
    return fastest(solid.shape, 0.5 * solid.shape.width)


def _shear_mass(solid: Solid, across: float) -> float:
    """Mass in kg that a tangential force at the surface feels, turning included."""
    if isinstance(solid, Static | Ground):
        return math.inf
    assert solid.mass is not None
    return solid.mass / across


def _leverage(solid: Solid) -> float:
    """See `tangential_coefficients`: of a box that lies on its widest face; balls don't rock."""
    if not isinstance(solid, Body) or not isinstance(solid.shape, Box):
        return 0.0
    height, *sides = sorted(solid.shape.half_extents)
    # three quarters of a face's weight lie on the two edges across the motion, one on its middle
    return sum(height**2 / (0.75 * side**2) for side in sides) / 2.0


def _mover_row(solid: Solid, gravity: Array) -> tuple[object, ...]:
    """A row of MOVER."""
    assert isinstance(solid, Body | Drive)
    assert solid.mass is not None
    reach = solid.shape.reach
    if isinstance(solid, Body):
        inertia = solid.shape.inertia(solid.mass)
        weight = solid.mass * gravity + 0.0  # without a negative zero, which sums would lose
        servo = 0.0, 0.0, 0.0, -1, 0.0
        return 1, reach, 1.0 / solid.mass, inertia, 1.0 / inertia, weight, *servo
    stiffness = solid.mass * solid.frequency**2
    damping = 2.0 * solid.damping_ratio * solid.mass * solid.frequency
    endless, zero = np.full(3, np.inf), np.zeros(3)
    limit = solid.force_limit
    servo = stiffness, damping, limit, -1, 0.0
    return 0, reach, 1.0 / solid.mass, endless, zero, zero, *servo


def _mover_rows(scene: Scene, gravity: Array) -> Array:
    """All rows of MOVER."""
    movers: list[Solid] = [*scene.bodies, *scene.tools]
    rows = np.array([_mover_row(m, gravity) for m in movers], dtype=MOVER)
    for index, gripper in scene.grippers:
        first = len(scene.bodies) + index
        rows["twin"][first : first + 2] = first + 1, first
        rows["grip_limit"][first : first + 2] = gripper.grip_limit
    return rows


def build(scene: Scene, fidelity: Fidelity) -> tuple[Model, Features]:
    """The arrays and the features of a scene at a fidelity."""
    solids: list[Solid] = [*scene.bodies, *scene.tools, *scene.statics]
    gravity = np.array(scene.gravity)
    g = float(np.sqrt(np.sum(gravity**2)))
    omega = fidelity.contact_resolution / fidelity.substep

    sides = list(_sides(scene, fidelity))
    modes = [_fastest(solid) for solid in solids]
    side = np.zeros(len(sides), dtype=SIDE)
    samples: list[Array] = [np.zeros((0, 4))]
    slots = 0

    def add(some: Samples) -> tuple[int, int]:
        first = sum(len(block) for block in samples)
        samples.append(np.column_stack([some.positions, some.weights]))
        return first, len(some.weights)

    ways = {(pair.owner, pair.other): k for k, pair in enumerate(sides)}
    for row, pair in zip(side, sides, strict=True):
        a, b = solids[pair.owner], solids[pair.other]
        friction, restitution, stiffness = _pair_material(a.material, b.material)
        movers = [x for x in (a, b) if isinstance(x, Body | Drive)]
        pair_mass = 1.0 / sum(1.0 / x.mass for x in movers if x.mass)
        (along_a, across_a), (along_b, across_b) = modes[pair.owner], modes[pair.other]
        if stiffness is None:
            stiffness = pair_mass * omega**2 * min(1.0, _CUBE / max(along_a, along_b))
        shear_mass = 1.0 / (1.0 / _shear_mass(a, across_a) + 1.0 / _shear_mass(b, across_b))
        row["shear_stiffness"], row["shear_damping"] = tangential_coefficients(
            stiffness, pair_mass, shear_mass, _leverage(a) + _leverage(b), fidelity.substep
        )
        turning = 1.0 / _least_inertia(a) + 1.0 / _least_inertia(b)
        row["twist_stiffness"] = 1.0  # a tool that meets the ground turns no more than that
        if turning > 0.0:
            row["rolling"], row["spinning"] = _resistance(a.material, b.material)
            row["twist_stiffness"], row["twist_damping"] = tangential_coefficients(
                omega**2 / turning, 1.0 / turning, 1.0 / turning, 0.0, fidelity.substep
            )
        damping = damping_coefficient(restitution, fidelity.damping)
        row["owner"], row["surface"], row["kind"] = pair.owner, pair.other, pair.surface.kind
        row["mirror"] = ways.get((pair.other, pair.owner), -1)
        row["first_sample"], row["sample_count"] = add(pair.samples)
        if pair.partners is not None:
            row["first_partner"], row["partner_count"] = add(pair.partners)
        row["first_slot"], row["slot_count"] = slots, _capacity(pair)
        slots += int(row["slot_count"])
        particles = fidelity.geometry == "particle" and isinstance(a, Body)
        row["sharp"] = not isinstance(a, Ground) and isinstance(a.shape, Box) and not particles
        row["core"] = pair.surface.parameters
        row["owner_radius"] = pair.samples.radius
        row["radius"] = pair.samples.radius + pair.surface.radius
        row["owner_reach"], row["surface_reach"] = (
            0.0 if isinstance(x, Ground) else x.shape.reach for x in (a, b)
        )
        row["skin"] = fidelity.skin * min(x.shape.width for x in movers)
        row["stiffness"], row["pair_mass"], row["friction"] = stiffness, pair_mass, friction
        row["damping"] = damping
        row["rest_speed"] = rest_speed(damping, g, math.sqrt(stiffness / pair_mass))
        row["restitution"] = restitution
        if fidelity.law == "impulse":
            row["damping"] = 2.0 * SOFT_DAMPING * math.sqrt(stiffness * pair_mass)
            row["rest_speed"] = REST_STEPS * g * fidelity.substep

    poses = [
        (0.0, 0.0, 0.0, *NO_TURN) if isinstance(s, Ground) else (*s.position, *s.orientation)
        for s in scene.statics
    ]
    model = Model(
        mover=_mover_rows(scene, gravity),
        side=side,
        static=np.array(poses, dtype=float).reshape(-1, 7),
        sample=np.concatenate(samples),
    )
    return model, _features(scene, fidelity, model)


def _features(scene: Scene, fidelity: Fidelity, model: Model) -> Features:
    """What of the engine this scene needs."""
    impulse = fidelity.law == "impulse" and len(model.side) > 0
    kinds = set(model.side["kind"].tolist())
    friction = bool(np.any(model.side["friction"] > 0.0))
    # a ball without friction is never turned, and one that doesn't spin needs no orientation
    inert = all(isinstance(b.shape, Sphere) and not any(b.angular_velocity) for b in scene.bodies)
    moments = model.mover["inertia"][: len(scene.bodies)]
    # impulses need every body's tensor in the world frame anyway
    isotropic = bool(np.all(moments == moments[:, :1])) and not impulse
    resistance = bool(np.any(model.side["rolling"] + model.side["spinning"] > 0.0))
    rotation = (
        NO_ROTATION
        if inert and not (friction or resistance)
        else ISOTROPIC
        if isotropic
        else GENERAL
    )
    return Features(
        impulse=impulse,
        dashpot=not impulse and fidelity.damping == "dashpot" and len(model.side) > 0,
        friction=friction,
        viscous=friction and fidelity.friction == "viscous",
        resistance=resistance,
        rotation=rotation,
        plane=PLANE in kinds,
        sphere=SPHERE in kinds,
        box=BOX in kinds,
        capsule=CAPSULE in kinds,
        particles=PARTICLES in kinds,
        drives=bool(scene.drives),
        gripper=bool(scene.grippers),
    )

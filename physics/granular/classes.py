"""Classes of bodies: those of the same material and shape, up to size; and the tables of contacts.

Contact coefficients depend on the two classes and the two masses. The table has what depends on the
classes, computed by the formulas that serve all scenes, with masses of 1 kg.
"""

from typing import NamedTuple

import numpy as np

from physics.granular.support import MOST_CLASSES
from physics.granular.tables import CONTACT, STATIC, Constants
from physics.model.build import build_dynamic
from physics.model.coefficients import contact_columns, shear_ratios
from physics.model.pairs import pair_stiffness
from physics.model.rocking import fastest_modes, rocking_leverage
from physics.rotation import rotation_matrix
from physics.scene.fidelity import Fidelity
from physics.scene.material import Material
from physics.scene.particles import Particles
from physics.scene.scene import Scene
from physics.scene.shapes import PLANE, Sphere
from physics.scene.solids import Body, Ground
from physics.scene.validation import IDENTITY

Array = np.ndarray

# fraction of the radius below which particles count as at the same place
_SAME = 1e-9
# smallest and largest skin, in mean radii
_SKINS = (0.1, 2.0)


class Bodies(NamedTuple):
    """The bodies of a scene, in its order.

    Attributes:
        dynamic: [bodies] of DYNAMIC.
        class_of: [bodies] class of each.
        weight: [bodies] of each particle, see `Samples.weights`.
        is_ball: [bodies] whether it is a Sphere.
        particles: [bodies] how many each has.
        local: [n, 4] x y z in the body's frame and radius, in m, of each particle; of those of one
            body if all are equal.
        equal: whether all have the same shape, mass and material.
    """

    dynamic: Array
    class_of: Array
    weight: Array
    is_ball: Array
    particles: Array
    local: Array
    equal: bool

    @property
    def points(self) -> Array:
        """[n, 4] like `local`, of every particle."""
        return np.tile(self.local, (len(self.particles), 1)) if self.equal else self.local

    @property
    def radii(self) -> Array:
        """[n] m, of every particle."""
        radii = self.local[:, 3]
        return np.tile(radii, len(self.particles)) if self.equal else radii

    @property
    def reach(self) -> Array:
        """[bodies] m, from the centre to the farthest point of the surface."""
        outermost = np.sqrt(np.sum(self.local[:, :3] ** 2, axis=1)) + self.local[:, 3]
        if self.equal:
            return np.full(len(self.particles), outermost.max())
        return np.maximum.reduceat(outermost, np.cumsum(self.particles) - self.particles)


def _distinct(scene: Scene) -> tuple[list[Body], Array]:
    """Bodies [k] that differ in shape, mass or material; and which of them each body equals."""
    found: dict[tuple[int, float | None, int], int] = {}
    of_shape: dict[object, int] = {}
    examples: list[Body] = []
    which = np.empty(len(scene.bodies), dtype=int)
    known: dict[int, int] = {}  # hashing thousands of equal shapes takes long
    for i, body in enumerate(scene.bodies):
        numbers = []
        for part in (body.shape, body.material):
            if id(part) not in known:
                known[id(part)] = of_shape.setdefault(part, len(of_shape))
            numbers.append(known[id(part)])
        key = (numbers[0], body.mass, numbers[1])
        if key not in found:
            found[key] = len(examples)
            examples.append(body)
        which[i] = found[key]
    return examples, which


def _points(shape: Sphere | Particles) -> Array:
    """Particles [n, 4]: x y z and radius, m."""
    points = shape.points if isinstance(shape, Particles) else np.zeros((1, 3))
    return np.column_stack([points, np.full(len(points), shape.radius)])


def _family(body: Body) -> tuple[object, ...]:
    """What bodies of a class have in common."""
    shape = body.shape
    if isinstance(shape, Particles):
        places = np.round(shape.points / (_SAME * shape.radius)).astype(np.int64)
        return places.tobytes(), body.material
    return None, body.material


def bodies_of(scene: Scene, fidelity: Fidelity) -> tuple[Bodies, list[Body]]:
    """The bodies of a scene, and one body of each class.

    Raises:
        ValueError: more classes than there is room for.
    """
    examples, which = _distinct(scene)
    classes: dict[tuple[object, ...], int] = {}
    first: list[Body] = []
    class_of = np.empty(len(examples), dtype=int)
    for k, body in enumerate(examples):
        family = _family(body)
        if family not in classes:
            classes[family] = len(first)
            first.append(body)
        class_of[k] = classes[family]
    if len(first) > MOST_CLASSES:
        raise ValueError(
            f"Scene.bodies must have at most {MOST_CLASSES} different shapes (up to size) and "
            f"materials in a heap of particles, got {len(first)}"
        )
    shapes = [body.shape for body in examples]
    weights = [shape.samples(shape.width, 0.0).weights[0] for shape in shapes]
    points = [_points(shape) for shape in shapes]  # type: ignore[arg-type]
    counts = np.array([len(one) for one in points])
    starts = np.concatenate([[0], np.cumsum(counts)])
    local = np.concatenate(points)
    if len(examples) > 1:
        local = local[np.repeat(starts[which], counts[which]) + _count_up(counts[which])]
    return Bodies(
        dynamic=build_dynamic(scene, fidelity, examples)[which],
        class_of=class_of[which],
        weight=np.array(weights)[which],
        is_ball=np.array([isinstance(shape, Sphere) for shape in shapes])[which],
        particles=counts[which],
        local=local,
        equal=len(examples) == 1,
    ), first


def _count_up(counts: Array) -> Array:
    """0, 1, ... count - 1 for each count."""
    ends = np.cumsum(counts)
    return np.arange(ends[-1]) - np.repeat(ends - counts, counts)


def constants_of(scene: Scene, fidelity: Fidelity, classes: list[Body], radii: Array) -> Constants:
    """The tables of contacts; `radii`: [n] m, of all particles."""
    solids = [*classes, *scene.statics]
    n, count = len(classes), len(scene.statics)
    a = np.repeat(np.arange(n), n + count)
    b = np.tile(np.arange(n + count), n)
    modes, leverage = np.ones((n + count, 2)), np.zeros(n + count)
    for k, body in enumerate(classes):
        modes[k] = fastest_modes(body.shape, 0.5 * body.shape.width)
        leverage[k] = rocking_leverage(body.shape)
    materials = [solid.material for solid in solids]
    given = _given_stiffness(materials)[a, b]
    mass = np.array([[1.0] * n + [np.inf] * count])
    columns = contact_columns(
        fidelity,
        np.array(scene.gravity),
        (a, b),
        given,
        mass,
        np.array([[m.friction for m in materials]]),
        np.array([[m.restitution for m in materials]]),
        modes,
        leverage,
    )
    rows = np.zeros(len(a), CONTACT)
    rows["unit_stiffness"] = (columns["stiffness"] / columns["pair_mass"])[0]
    rows["stiffness"] = np.where(np.isnan(given), 0.0, given)
    rows["damping"] = columns["damping"][0]
    rows["friction"] = columns["friction"][0]
    rows["shear_ratio"] = shear_ratios(fidelity, given)
    rows["leverage"] = leverage[a] + leverage[b]
    rows["first_compliance"] = modes[a, 1]
    rows["second_compliance"] = np.where(b < n, modes[b, 1], 0.0)
    table = rows.reshape(n, n + count)
    return Constants(
        contact=np.ascontiguousarray(table[:, :n]),
        static_contact=np.ascontiguousarray(table[:, n:]),
        static=_statics(scene, fidelity),
        skins=np.array(_SKINS) * float(radii.mean()),
        step=fidelity.substep,
    )


def _given_stiffness(materials: list[Material]) -> Array:
    """[solids, solids] N/m of the materials, NaN where neither gives one."""
    kinds = list(dict.fromkeys(materials))
    table = np.array([[pair_stiffness(one, other) for other in kinds] for one in kinds])
    which = np.array([kinds.index(material) for material in materials])
    return np.asarray(table[np.ix_(which, which)])


def _statics(scene: Scene, fidelity: Fidelity) -> Array:
    """Rows of STATIC."""
    rows = np.zeros(len(scene.statics), STATIC)
    for row, solid in zip(rows, scene.statics, strict=True):
        turn = IDENTITY
        if isinstance(solid, Ground):
            row["kind"], row["core"] = PLANE, (solid.height, 0.0, 0.0)
        else:
            surface = solid.shape.surface(0.5 * fidelity.rounding * solid.shape.width)
            row["kind"], row["core"] = surface.kind, surface.parameters
            row["radius"], row["position"], turn = (
                surface.radius,
                solid.position,
                solid.orientation,
            )
        row["rotation"] = rotation_matrix(np.array(turn)).ravel()
    return rows

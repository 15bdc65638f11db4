"""Layout: what of a scene's contacts stays as it is when masses, materials and sizes change.

Solids are the movers, then the statics. A pair of solids meets through one or two sides: the
samples of an owner against the surface of another.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from physics.model.rocking import fastest
from physics.scene.compound import Compound, Group
from physics.scene.fidelity import Fidelity
from physics.scene.part import Part
from physics.scene.scene import Body, Drive, Ground, Material, Scene, Static
from physics.scene.shapes import PARTICLES, PLANE, Box, Samples, Shape, Sphere, Surface

Array = np.ndarray
Solid = Body | Drive | Static | Ground


class Side(NamedTuple):
    """The samples of solid `owner` against the surface of solid `other`.

    With `shared`, both of a pair carry samples, and bear a part of its load each. A `part` is that
    of `Layout.parts` whose surface it is, -1 where it is the solid's own. Of `sharp`, see
    `surfaces.box_distance`.
    """

    owner: int
    other: int
    samples: Samples
    surface: Surface
    partners: Samples | None
    shared: bool = False
    part: int = -1
    sharp: bool = False

    @property
    def capacity(self) -> int:
        """Candidates that it has room for: all its samples, or eight partners to each particle."""
        n = len(self.samples.weights)
        if self.partners is None:
            return n
        m = len(self.partners.weights)
        return min(n * m, 8 * max(n, m))


class Layout(NamedTuple):
    """Solids and sides of a scene at a fidelity.

    Attributes:
        solids: movers, then statics.
        movers: how many of them move.
        bodies: how many of these are bodies, which come first.
        sides: in a fixed order.
        parts: of compounds, and the solid that each belongs to; none if no side meets any.
        modes: [solids, 2] see `landing.fastest`; 1 for what doesn't turn.
        gravity: [3] m/s^2.
        fidelity: of the physics.
    """

    solids: tuple[Solid, ...]
    movers: int
    bodies: int
    sides: tuple[Side, ...]
    parts: tuple[tuple[int, Part], ...]
    modes: Array
    gravity: Array
    fidelity: Fidelity

    @classmethod
    def of(cls, scene: Scene, fidelity: Fidelity) -> "Layout":
        """The layout of a scene."""
        solids: tuple[Solid, ...] = (*scene.bodies, *scene.tools, *scene.statics)
        parts = tuple((i, part) for i, solid in enumerate(solids) for part in _parts(solid))
        sides = tuple(_sides(scene, fidelity, parts))
        return cls(
            solids=solids,
            movers=len(scene.bodies) + len(scene.tools),
            bodies=len(scene.bodies),
            sides=sides,
            parts=parts if any(side.part >= 0 for side in sides) else (),
            modes=np.array([_fastest(solid) for solid in solids]).reshape(-1, 2),
            gravity=np.array(scene.gravity),
            fidelity=fidelity,
        )


def spacing(shape: Shape, scene: Scene, fidelity: Fidelity) -> float:
    """Sample spacing in m, for the smallest body: it would fall between coarser samples."""
    widths = [body.shape.width for body in scene.bodies]
    return fidelity.spacing * min([shape.width, *widths])


def pair_stiffness(a: Material, b: Material) -> float:
    """Stiffness in N/m of two surfaces in contact that name one; NaN where neither does."""
    given = [m.stiffness for m in (a, b) if m.stiffness is not None]
    return 1.0 / sum(1.0 / k for k in given) if given else math.nan


def leverage(solid: Solid) -> float:
    """See `tangential_coefficients`: of a box that lies on its widest face; balls don't rock."""
    shape = _plain(solid.shape) if isinstance(solid, Body) else None
    if isinstance(shape, Compound):
        return _leverage_of_samples(*shape.samples(0.5 * shape.width, 0.0))
    if not isinstance(shape, Box):
        return 0.0
    height, *sides = sorted(shape.half_extents)
    # three quarters of a face's weight lie on the two edges across the motion, one on its middle
    return sum(height**2 / (0.75 * side**2) for side in sides) / 2.0


def _leverage_of_samples(positions: Array, weights: Array, radii: Array) -> float:
    """As `leverage`, of a solid with samples: the least of its six sides that can be lain on."""
    found, least = [], (1e-6 * np.abs(positions).max()) ** 2  # of what is no line but round-off
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for height in (positions[:, axis] + radii, -positions[:, axis] + radii):
            lowest = height >= height.max() - 1e-6 * np.abs(height).max()
            share = weights[lowest] / weights[lowest].sum()
            places = positions[lowest][:, others]
            spread = share @ (places - share @ places) ** 2
            if np.all(spread > least):
                found.append(float(height.max() ** 2 * np.mean(1.0 / spread)))
    return min(found, default=0.0)


def _plain(shape: Shape) -> Shape:
    """The shape itself; of a Compound of one part that lies as it does, the part's."""
    only = shape.only if isinstance(shape, Compound) else None
    return shape if only is None else only


def _parts(solid: Solid) -> tuple[Part, ...]:
    """The parts of a compound that have a surface each; of other solids none."""
    if isinstance(solid, Ground):
        return ()
    shape = _plain(solid.shape)
    return tuple(shape.parts) if isinstance(shape, Compound) else ()  # type: ignore[arg-type]


def _fastest(solid: Solid) -> tuple[float, float]:
    """At one spacing for all fidelities."""
    if not isinstance(solid, Body):
        return 1.0, 1.0
    return fastest(solid.shape, 0.5 * solid.shape.width)


def _sides(scene: Scene, fidelity: Fidelity, parts: tuple[tuple[int, Part], ...]) -> Iterator[Side]:
    """All sides through which the scene's solids can meet, in a fixed order."""
    solids: list[Solid] = [*scene.bodies, *scene.tools, *scene.statics]
    movers = len(scene.bodies) + len(scene.tools)

    def rounding(solid: Body | Drive | Static) -> float:
        return fidelity.rounding * solid.shape.width / 2.0

    def particles(solid: Body | Drive | Static) -> Samples:
        return solid.shape.particles(spacing(solid.shape, scene, fidelity))

    def groups(solid: Body | Drive | Static) -> tuple[Group, ...]:
        if fidelity.geometry == "particle" and isinstance(solid, Body):
            return (Group(particles(solid), False),)
        shape, apart = solid.shape, spacing(solid.shape, scene, fidelity)
        if isinstance(shape, Compound):
            return shape.groups(apart, rounding(solid))
        return (Group(shape.samples(apart, rounding(solid)), isinstance(shape, Box)),)

    def meetings(owner: int, other: int) -> list[Side]:
        """The samples of one solid against all surfaces of another."""
        a, b = solids[owner], solids[other]
        assert not isinstance(a, Ground)
        assert not isinstance(b, Ground)
        theirs = [(k, part) for k, (solid, part) in enumerate(parts) if solid == other]
        surfaces = [(k, part.shape.surface(rounding(b))) for k, part in theirs]
        if not surfaces:
            surfaces = [(-1, b.shape.surface(rounding(b)))]
        return [
            Side(owner, other, some, surface, None, part=k, sharp=sharp)
            for some, sharp in groups(a)
            for k, surface in surfaces
        ]

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
                for some, sharp in groups(a):
                    yield Side(i, j, some, plane, None, sharp=sharp)
                continue
            bodies = isinstance(a, Body) and isinstance(b, Body)
            if fidelity.geometry == "particle" and bodies:
                pa, pb = particles(a), particles(b)
                yield Side(i, j, pa, Surface(PARTICLES, (0.0, 0.0, 0.0), pb.radius), pb)
                continue
            if fidelity.geometry == "particle" and isinstance(a, Body):
                yield from meetings(i, j)  # particles leave no gap for a tool to slip through
            elif isinstance(_plain(a.shape), Sphere):
                yield from meetings(i, j)  # the centre of a sphere is exact
            elif isinstance(_plain(b.shape), Sphere):
                yield from meetings(j, i)
            else:
                for side in (*meetings(i, j), *meetings(j, i)):
                    yield side._replace(shared=True)

"""Layout: what of a scene's contacts stays as it is when masses, materials and sizes change.

Solids are the movers, then the statics. A pair of solids meets through one or two sides: the
samples of an owner against the surface of another.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from physics.fidelity import Fidelity
from physics.landing import fastest
from physics.scene import Body, Drive, Ground, Material, Scene, Static
from physics.shapes import PARTICLES, PLANE, Box, Samples, Shape, Sphere, Surface

Array = np.ndarray
Solid = Body | Drive | Static | Ground


class Side(NamedTuple):
    """The samples of solid `owner` against the surface of solid `other`.

    With `shared`, both of a pair carry samples, and bear a part of its load each.
    """

    owner: int
    other: int
    samples: Samples
    surface: Surface
    partners: Samples | None
    shared: bool = False

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
        modes: [solids, 2] see `landing.fastest`; 1 for what doesn't turn.
        gravity: [3] m/s^2.
        fidelity: of the physics.
    """

    solids: tuple[Solid, ...]
    movers: int
    bodies: int
    sides: tuple[Side, ...]
    modes: Array
    gravity: Array
    fidelity: Fidelity

    @classmethod
    def of(cls, scene: Scene, fidelity: Fidelity) -> "Layout":
        """The layout of a scene."""
        solids: tuple[Solid, ...] = (*scene.bodies, *scene.tools, *scene.statics)
        return cls(
            solids=solids,
            movers=len(scene.bodies) + len(scene.tools),
            bodies=len(scene.bodies),
            sides=tuple(_sides(scene, fidelity)),
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
    if not isinstance(solid, Body) or not isinstance(solid.shape, Box):
        return 0.0
    height, *sides = sorted(solid.shape.half_extents)
    # three quarters of a face's weight lie on the two edges across the motion, one on its middle
    return sum(height**2 / (0.75 * side**2) for side in sides) / 2.0


def _fastest(solid: Solid) -> tuple[float, float]:
    """At one spacing for all fidelities."""
    if not isinstance(solid, Body):
        return 1.0, 1.0
    return fastest(solid.shape, 0.5 * solid.shape.width)


def _sides(scene: Scene, fidelity: Fidelity) -> Iterator[Side]:
    """All sides through which the scene's solids can meet, in a fixed order."""
    solids: list[Solid] = [*scene.bodies, *scene.tools, *scene.statics]
    movers = len(scene.bodies) + len(scene.tools)

    def rounding(solid: Body | Drive | Static) -> float:
        return fidelity.rounding * solid.shape.width / 2.0

    def samples(solid: Body | Drive | Static) -> Samples:
        apart = spacing(solid.shape, scene, fidelity)
        if fidelity.geometry == "particle" and isinstance(solid, Body):
            return solid.shape.particles(apart)
        return solid.shape.samples(apart, rounding(solid))

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
                yield forward._replace(shared=True)
                yield backward._replace(shared=True)

"""Which solids can touch, and with which samples: what stays when per-world parameters change.

Solids are the dynamic bodies (bodies, then drives), then the statics. A pair of solids touches
through one or two half-pairs: the samples of an owner against the surface of the other solid.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from physics.model.mesh_samples import impact_depth, pressed, sink, stiffest
from physics.model.rocking import fastest_modes, rocking_leverage
from physics.scene.compound import Compound, SampleSet
from physics.scene.cylinder import Cylinder
from physics.scene.drives import Drive
from physics.scene.fidelity import FIND_IMPACTS, Fidelity
from physics.scene.flush_statics import FlushBox, join_flush
from physics.scene.material import Material
from physics.scene.mesh import Mesh
from physics.scene.part import Part
from physics.scene.particles import Particles
from physics.scene.scene import Scene
from physics.scene.shapes import PARTICLES, PLANE, Box, Samples, Shape, Sphere, Surface
from physics.scene.solids import Body, Ground, Static, touch_each_other
from physics.scene.torus import Torus

Array = np.ndarray
Solid = Body | Drive | Static | Ground

# relative to its radius: how far the ball of a mesh may be from the mesh's centre of mass
_OFF_CENTRE = 1e-4


# in sinks: more than twice the difference of the widths of a ball whose faces lie within a sink
_ROUND = 4.0


class HalfPair(NamedTuple):
    """The samples of solid `owner` against the surface of solid `other`.

    Attributes:
        owner: index of a solid.
        other: likewise.
        samples: of the owner.
        surface: of the other solid.
        partners: particles of the surface, if it consists of particles.
        both_sampled: the other solid's samples are tested too, so each carries a share of the load.
        part: index into `Layout.parts` of the compound part whose surface it is, or -1.
        face_normals: see `distances.box_distance`.
        inner: the samples are balls inside a cylinder, which touch where its rims don't.
        crowding: see `mesh_samples.pressed`.
    """

    owner: int
    other: int
    samples: Samples
    surface: Surface
    partners: Samples | None
    both_sampled: bool = False
    part: int = -1
    face_normals: bool = False
    inner: bool = False
    crowding: float = 1.0

    @property
    def capacity(self) -> int:
        """Room for candidates: all samples, or eight partners per particle."""
        n = len(self.samples.weights)
        if self.partners is None:
            return n
        m = len(self.partners.weights)
        return min(n * m, 8 * max(n, m))


class Layout(NamedTuple):
    """Solids and half-pairs of a scene at a fidelity.

    Attributes:
        solids: dynamic bodies, then statics.
        dynamic_count: number of dynamic bodies.
        bodies: how many of them are bodies, which come first.
        half_pairs: in a fixed order.
        parts: (solid, part) of compounds; empty if no half-pair tests any of them.
        modes: [solids, 2] see `rocking.fastest_modes`; 1 for what doesn't rotate.
        leverage: [solids] see `rocking.rocking_leverage`; 0 for what isn't a body.
        rolls: [solids] whether it is a body that can roll.
        gravity: [3] m/s^2.
        fidelity: of the physics.
    """

    solids: tuple[Solid, ...]
    dynamic_count: int
    bodies: int
    half_pairs: tuple[HalfPair, ...]
    parts: tuple[tuple[int, Part], ...]
    modes: Array
    leverage: Array
    rolls: Array
    gravity: Array
    fidelity: Fidelity

    @classmethod
    def of(
        cls,
        scene: Scene,
        fidelity: Fidelity,
        own_spacing: bool = False,
        no_half_pairs: bool = False,
    ) -> "Layout":
        """The layout of a scene.

        `own_spacing`: each solid's width alone sets the spacing of its samples. `no_half_pairs`:
        only the solids.
        """
        statics = join_flush(scene.statics)
        solids: tuple[Solid, ...] = (*scene.bodies, *scene.driven_bodies, *statics)
        touching = solids
        if fidelity.geometry == "shape" and not no_half_pairs:
            touching = tuple(_as_ball(s, scene, fidelity, own_spacing) for s in solids)
        parts = tuple((i, part) for i, solid in enumerate(solids) for part in _parts(solid))
        half_pairs = (
            ()
            if no_half_pairs
            else tuple(_half_pairs(scene, touching, fidelity, parts, own_spacing))
        )
        modes = [(1.0, 1.0)] * len(solids)
        leverage = [0.0] * len(solids)
        rolls = np.zeros(len(solids), dtype=bool)
        for i, body in enumerate(() if no_half_pairs else touching[: len(scene.bodies)]):
            assert isinstance(body, Body)
            modes[i] = fastest_modes(body.shape, 0.5 * body.shape.width)  # for every fidelity
            leverage[i] = rocking_leverage(_single(body.shape))
            rolls[i] = leverage[i] == 0.0 or isinstance(body.shape, Cylinder | Torus)
        return cls(
            solids=solids,
            dynamic_count=len(scene.bodies) + len(scene.driven_bodies),
            bodies=len(scene.bodies),
            half_pairs=half_pairs,
            parts=parts if any(half_pair.part >= 0 for half_pair in half_pairs) else (),
            modes=np.array(modes).reshape(-1, 2),
            leverage=np.array(leverage),
            rolls=rolls,
            gravity=np.array(scene.gravity),
            fidelity=fidelity,
        )


def spacing(shape: Shape, scene: Scene, fidelity: Fidelity) -> float:
    """Sample spacing in m, for the smallest body: it would fall between coarser samples."""
    widths = [body.shape.width for body in scene.bodies]
    return fidelity.spacing * min([shape.width, *widths])


def pair_stiffness(a: Material, b: Material) -> float:
    """Stiffness in N/m of two surfaces in contact; NaN where neither material gives one."""
    given = [m.stiffness for m in (a, b) if m.stiffness is not None]
    return 1.0 / sum(1.0 / k for k in given) if given else math.nan


def _single(shape: Shape) -> Shape:
    """The shape itself; for a Compound of one part in the same pose, that part's shape."""
    only = shape.only if isinstance(shape, Compound) else None
    return shape if only is None else only


def is_floor(solid: Solid, shape: Shape, fidelity: Fidelity) -> bool:
    """Whether the samples of a cylinder or torus turn over a solid.

    Over a ground; and over a static box of which two sides are at least twice as long as the shape,
    so that the shape is rarely beyond the border of the face that it is on. Not where times of
    impact are sought: the bound on the motion of a sample holds for one that is fixed to its solid.
    """
    if fidelity.time_control in FIND_IMPACTS:
        return False
    if isinstance(solid, Static) and isinstance(solid.shape, Box):
        return sorted(solid.shape.half_extents)[1] >= 2.0 * shape.reach
    return isinstance(solid, Ground)


def _as_ball(solid: Solid, scene: Scene, fidelity: Fidelity, own_spacing: bool) -> Solid:
    """The solid itself; for a mesh that is a ball but for the sink, the same with that ball.

    Its exact surface is smoother than a grid of distances, and faster.
    """
    if isinstance(solid, Ground) or not isinstance(solid.shape, Mesh):
        return solid
    width, depth = solid.shape.width, sink(fidelity)
    # what differs more can't be a ball, and samples take time
    if 2.0 * solid.shape.reach - width > _ROUND * depth:
        return solid
    apart = fidelity.spacing * width if own_spacing else spacing(solid.shape, scene, fidelity)
    rounding = fidelity.rounding * width / 2.0
    centres, _, radius, _ = solid.shape.samples(apart, rounding, depth)
    central = len(centres) == 1 and np.abs(centres).max() < _OFF_CENTRE * radius
    # the ball of one sample is inscribed; less volume than its own means a cavity
    if not central or solid.shape.volume < Sphere(radius).volume:
        return solid
    if isinstance(solid, Body):  # its mass is known by now
        return replace(solid, shape=Sphere(radius), density=None)
    return replace(solid, shape=Sphere(radius))


def _parts(solid: Solid) -> tuple[Part, ...]:
    """What has a surface with a frame: parts of a compound, a `FlushBox`; none for other solids."""
    if isinstance(solid, Ground):
        return ()
    shape = _single(solid.shape)
    if isinstance(shape, FlushBox):
        return (Part(shape),)
    return tuple(shape.parts) if isinstance(shape, Compound) else ()  # type: ignore[arg-type]


def _half_pairs(
    scene: Scene,
    solids: tuple[Solid, ...],
    fidelity: Fidelity,
    parts: tuple[tuple[int, Part], ...],
    own_spacing: bool,
) -> Iterator[HalfPair]:
    """All half-pairs through which the scene's solids can touch, in a fixed order."""
    dynamic_count = len(scene.bodies) + len(scene.driven_bodies)
    of_meshes: dict[tuple[Mesh, float], tuple[Samples, float]] = {}

    def rounding(solid: Body | Drive | Static) -> float:
        return fidelity.rounding * solid.shape.width / 2.0

    def apart(shape: Shape) -> float:
        return fidelity.spacing * shape.width if own_spacing else spacing(shape, scene, fidelity)

    def particles(solid: Body | Drive | Static) -> Samples:
        return solid.shape.particles(apart(solid.shape))

    def sample_sets(
        solid: Body | Drive | Static, other: Solid, least: float = 0.0
    ) -> tuple[SampleSet, ...]:
        """Samples that are inset by the rounding, and by at least `least` m if they can be."""
        if fidelity.geometry == "particle" and isinstance(solid, Body):
            return (SampleSet(particles(solid), False),)
        shape, distance = solid.shape, apart(solid.shape)
        inset = max(rounding(solid), min(least, 0.25 * shape.width))
        if isinstance(shape, Compound):
            return shape.sample_sets(distance, inset)
        samples: tuple[Samples, ...]
        if isinstance(shape, Cylinder | Torus) and not is_floor(other, shape, fidelity):
            samples = shape.fixed_samples(distance, inset)
        elif isinstance(shape, Mesh):
            samples = (shape.samples(distance, inset, sink(fidelity)),)
        else:
            samples = (shape.samples(distance, inset),)
        if isinstance(shape, Cylinder):  # the balls inside it have no faces
            return tuple(SampleSet(one, one.radius == inset) for one in samples)
        return tuple(SampleSet(one, isinstance(shape, Box | Mesh)) for one in samples)

    def pressed_sets(
        solid: Body | Drive | Static, other: Solid, least: float = 0.0
    ) -> Iterator[tuple[Samples, bool, float]]:
        """The same with their `crowding`; where springs could be unstable weights are lowered."""
        shape = solid.shape
        for samples, flat in sample_sets(solid, other, least):
            if isinstance(shape, Mesh) and fidelity.law == "spring":
                if (shape, least) not in of_meshes:  # a mesh has one set of samples
                    depth, most = impact_depth(shape, fidelity), stiffest(shape, fidelity)
                    of_meshes[shape, least] = pressed(shape, samples, depth, most)
                samples, crowding = of_meshes[shape, least]
                yield samples, flat, crowding
            else:
                yield samples, flat, 1.0

    def between(owner: int, other: int) -> list[HalfPair]:
        """The samples of one solid against all surfaces of another."""
        a, b = solids[owner], solids[other]
        assert not isinstance(a, Ground)
        assert not isinstance(b, Ground)
        surfaces = [
            (k, part.shape.surface(rounding(b)))
            for k, (solid, part) in enumerate(parts)
            if solid == other
        ]
        if not surfaces:
            surfaces = [(-1, b.shape.surface(rounding(b)))]
        least = b.shape.edge_radius if isinstance(b.shape, Mesh) else 0.0
        return [
            HalfPair(
                owner, other, samples, surface, None,
                part=k, face_normals=flat, inner=isinstance(a.shape, Cylinder) and not flat,
                crowding=crowding,
            )
            for samples, flat, crowding in pressed_sets(a, b, least)
            for k, surface in surfaces
            if len(samples.weights)  # flush neighbours may leave none
        ]  # fmt: skip

    first_drive = len(scene.bodies)
    # the grip servo keeps the two fingers of a gripper apart
    fingers = {(first_drive + first, first_drive + first + 1) for first, _ in scene.grippers}
    jointed = scene.jointed_pairs
    for i, a in enumerate(solids[:dynamic_count]):
        assert not isinstance(a, Static | Ground)
        for j in range(i + 1, len(solids)):
            b = solids[j]
            if (i, j) in fingers | jointed or not touch_each_other(a, b):
                continue
            if isinstance(b, Ground):
                plane = Surface(PLANE, (b.height, 0.0, 0.0), 0.0)
                for samples, face_normals, crowding in pressed_sets(a, b):
                    yield HalfPair(
                        i, j, samples, plane, None,
                        face_normals=face_normals, crowding=crowding,
                    )  # fmt: skip
                continue
            bodies = isinstance(a, Body) and isinstance(b, Body)
            if fidelity.geometry == "particle" and bodies:
                pa, pb = particles(a), particles(b)
                yield HalfPair(i, j, pa, Surface(PARTICLES, (0.0, 0.0, 0.0), pb.radius), pb)
                continue
            balls = isinstance(a.shape, Particles), isinstance(b.shape, Particles)
            if all(balls):
                pa, pb = particles(a), particles(b)
                yield HalfPair(i, j, pa, b.shape.surface(0.0), pb)
            elif any(balls):  # balls against an exact surface
                yield from between(i, j) if balls[0] else between(j, i)
            elif fidelity.geometry == "particle" and isinstance(a, Body):
                yield from between(i, j)  # particles leave no gap for a drive to slip through
            elif isinstance(_single(a.shape), Sphere):
                yield from between(i, j)  # the centre of a sphere is exact
            elif isinstance(_single(b.shape), Sphere):
                yield from between(j, i)
            else:
                there, back = between(i, j), between(j, i)
                for half_pair in (*there, *back):
                    yield half_pair._replace(both_sampled=bool(there and back))

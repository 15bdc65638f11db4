"""Mesh: a solid that is given by the triangles of its surface."""

import math
import warnings
from dataclasses import InitVar, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from physics.meshes import geometry, hull
from physics.meshes.checks import check_arrays, check_solid_mesh, warn_if_thin
from physics.meshes.distance_grid import DistanceGrid
from physics.meshes.lattice import budgeted, lattice
from physics.meshes.read import merged, read_mesh
from physics.meshes.repair import repaired
from physics.meshes.sides import weights
from physics.orientation import from_matrix
from physics.rotation import multiply, rotate
from physics.scene.shapes import GRID, Samples, Surface
from physics.scene.validation import (
    IDENTITY,
    ZERO,
    Vector,
    choice,
    integer,
    positive,
    unit_quaternion,
    vector,
)

Array = np.ndarray

# cells from an edge within which normals are mixed: its own cell, and half a cell for the sink
_CELLS_INSET = 1.5


@dataclass(frozen=True, repr=False)
class Mesh:
    """A solid bounded by triangles; it may be concave and have cavities.

    Its body frame has the centre of mass as its origin and the principal axes of inertia as its
    axes, whatever the frame of the file. `centre` and `rotation` lead from one to the other, and
    `placed` gives the pose of the body for a pose of the file's frame.

    Args:
        source: path of a file (STL, OBJ, PLY, GLB, ...) or a `trimesh.Trimesh`; needs the extra
            "mesh". Or give vertices and faces.
        vertices: [n, 3] in units of `scale`, in the file's frame; stored as nested tuples.
        faces: [m, 3] indices of vertices, counterclockwise as seen from outside; likewise.
        convex_hull: whether the mesh is replaced by its convex hull, which needs the extra "mesh".
            The surface needn't be closed then.
        repair: whether open meshes are closed: faces are turned to wind alike, and each hole gets
            a lid, see `physics.meshes.repair`. A warning says by how much the volume changes.
        scale: m per unit of the vertices, above zero: 0.001 for a file in millimetres.
        cells: cells of the distance grid along the longest side of the bounding box, at least 8.
        fill: of `Fidelity.geometry` "particle": "shell", particles along the surface, which is all
            that contacts need; or "solid", particles everywhere inside.
        particle_count: largest number of particles; it decides their spacing. None: the spacing
            follows from `Fidelity.spacing`.

    Raises:
        ImportError: `source` needs trimesh.
        TypeError: a field is of the wrong type.
        ValueError: a file that doesn't exist or holds no mesh; a mesh that is open, inverted or
            without a volume; a value out of range. The message says what to do.
    """

    source: InitVar[Any] = None
    vertices: Any = None
    faces: Any = None
    convex_hull: InitVar[bool] = False
    repair: InitVar[bool] = False
    scale: float = 1.0
    cells: int = 48
    fill: str = "shell"
    particle_count: int | None = None

    def __post_init__(self, source: Any, convex_hull: bool, repair: bool) -> None:
        """Reads and checks the mesh."""
        for name, value in (("convex_hull", convex_hull), ("repair", repair)):
            if not isinstance(value, bool):
                raise TypeError(f"Mesh.{name} must be True or False, got {value!r}")
        if convex_hull and repair:
            raise ValueError("Mesh takes either convex_hull or repair, got both: a hull is closed")
        given = (self.vertices is not None, self.faces is not None)
        if given not in ((True, True), (False, False)) or given[0] == (source is not None):
            named = zip(("source", "vertices", "faces"), (source is not None, *given), strict=True)
            got = " and ".join(name for name, there in named if there) or "none of them"
            raise TypeError(f"Mesh takes either a source or vertices and faces, got {got}")
        vertices, faces = read_mesh(source) if source is not None else (self.vertices, self.faces)
        try:
            points = np.asarray(vertices, dtype=float)
        except (TypeError, ValueError):
            raise TypeError("Mesh.vertices must be numbers of shape (n, 3)") from None
        triangles = np.asarray(faces)
        if triangles.dtype.kind not in "iu":
            raise TypeError(f"Mesh.faces must be integers, got {triangles.dtype}")
        check_arrays(points, triangles)
        added = 0.0
        if convex_hull:
            points, triangles = hull.convex_hull(points)
        elif repair:
            points, triangles, added = repaired(points, triangles)
        check_solid_mesh(*merged(points, triangles))
        object.__setattr__(self, "_added", added)
        if added != 0.0:
            warnings.warn(
                f"Mesh was repaired: lids on its holes make {added:.2%} of its volume",
                stacklevel=3,
            )
        object.__setattr__(self, "vertices", tuple(map(tuple, points.tolist())))
        object.__setattr__(self, "faces", tuple(map(tuple, triangles.tolist())))
        object.__setattr__(self, "scale", positive("Mesh.scale", self.scale))
        object.__setattr__(self, "cells", integer("Mesh.cells", self.cells, low=8))
        choice("Mesh.fill", self.fill, ("shell", "solid"))
        if self.particle_count is not None:
            integer("Mesh.particle_count", self.particle_count, low=1)

    @property
    def volume_change(self) -> float:
        """Fraction of the volume that `repair` added, between lids and the middle of the mesh."""
        return float(self.__dict__.get("_added", 0.0))

    def __repr__(self) -> str:
        """Sizes; vertices and faces would fill pages."""
        change = f", {self.volume_change:.2%} of it by repair" if self.volume_change else ""
        return (
            f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces, volume "
            f"{self.volume:.4g} m^3{change}, cells={self.cells})"
        )

    @cached_property
    def _solid(self) -> geometry.Geometry:
        """At scale 1."""
        return geometry.geometry(self.vertices, self.faces)

    @property
    def centre(self) -> Array:
        """Centre of mass [3] in m in the file's frame: the origin of the body frame."""
        return self.scale * self._solid.centre

    @property
    def rotation(self) -> Array:
        """Rotation matrix [3, 3] from the body frame to the file's: its columns are the axes.

        A point p of the file, in m, is at rotation.T @ (p - centre) in the body frame.
        """
        return self._solid.rotation

    @property
    def triangles(self) -> Array:
        """Corners [m, 3, 3] in m of the triangles in the body frame."""
        return self.scale * self._solid.vertices[self._solid.faces]

    def placed(
        self, position: Vector = ZERO, orientation: Vector = IDENTITY
    ) -> tuple[Vector, Vector]:
        """Position in m and quaternion of a body whose file frame has the given pose.

        `Body(mesh, position=p, orientation=q)` with its result puts the origin of the file at
        `position`, with the file's axes rotated by `orientation`.

        Args:
            position: m, of the file's origin in the world.
            orientation: quaternion x, y, z, w, from the file's frame to the world.

        Raises:
            TypeError, ValueError: not finite numbers; a quaternion of length zero.
        """
        turn = np.array(unit_quaternion("orientation", orientation))
        place = np.array(vector("position", position)) + rotate(turn, self.centre)
        whole = multiply(turn, from_matrix(self.rotation))
        return tuple(place.tolist()), unit_quaternion("orientation", whole)

    @property
    def volume(self) -> float:
        """Volume in m^3."""
        return self.scale**3 * self._solid.volume

    @property
    def width(self) -> float:
        """Smallest distance in m of two parallel planes with the mesh between them."""
        return self.scale * self._solid.width

    @property
    def thickness(self) -> float:
        """Thickness in m of the walls: nine tenths of the surface are thicker."""
        return self.scale * self._solid.thickness

    @property
    def edge_radius(self) -> float:
        """Distance in m from an edge within which the distance grid mixes its faces' normals.

        Samples that touch the mesh are inset by at least as much, so that on a face whose edges
        are in line with their own they have its normal.
        """
        longest = self.scale * float(np.ptp(self._solid.vertices, axis=0).max())
        return _CELLS_INSET * longest / self.cells

    @property
    def reach(self) -> float:
        """Largest distance of a vertex from the centre, in m."""
        return self.scale * float(np.linalg.norm(self._solid.vertices, axis=1).max())

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2, exact for the triangles."""
        return np.multiply.outer(mass, self.scale**2 * self._solid.moments)

    def scaled(self, factor: float) -> "Mesh":
        """The mesh with each length multiplied by `factor`."""
        found = replace(self, scale=factor * self.scale)
        object.__setattr__(found, "_added", self.volume_change)
        return found

    def samples(
        self,
        spacing: float,
        rounding: float,
        sink: float = 0.0,
    ) -> Samples:
        """Samples at corners, edges and round areas, see `physics.meshes.samples` and `support`.

        They are inset by at least `edge_radius`, or a quarter of the walls, unless `rounding` is
        zero, and by more if the mesh is round all over.

        Args:
            spacing: m, largest distance between neighbouring samples.
            rounding: m, radius of edges that are otherwise sharp.
            sink: m, by which a body at rest may be lower than the mesh; 0: any depth.
        """
        if rounding > 0.0:
            rounding = min(max(rounding, self.edge_radius), 0.25 * self.thickness)
        positions, shares, radius = geometry.samples(
            self.vertices,
            self.faces,
            *(x / self.scale for x in (spacing, rounding, sink)),
        )
        return Samples(self.scale * positions, shares, self.scale * radius)

    def particles(self, spacing: float) -> Samples:
        """Points of a cubic lattice inside the mesh, found by depth peeling.

        Their diameter is the spacing, or less where it isn't a fraction of the longest side. Warns
        where walls are thinner than that.

        Args:
            spacing: m; without meaning if the mesh has a `particle_count`.

        Raises:
            ValueError: no point of the lattice is inside the mesh.
        """
        shell, corners = self.fill == "shell", (self._solid.vertices, self._solid.faces)
        longest = float(np.ptp(self._solid.vertices, axis=0).max())
        if self.particle_count is None:
            # along the longest side they fill the mesh exactly
            count = max(math.ceil(longest * self.scale / spacing - 1e-9), 1)
            found = lattice(*corners, longest / count)
        else:
            found = budgeted(*corners, self._solid.volume, self.particle_count, shell)
        apart, longest = self.scale * found.spacing, self.scale * longest
        if not len(found.positions):
            raise ValueError(
                f"Mesh has no particle: its walls, {self.thickness:.3g} m thick, are thinner than "
                f"the spacing of {apart:.3g} m; choose a smaller Fidelity.spacing, or a "
                "particle_count"
            )
        warn_if_thin(self.thickness, apart, longest / apart, "particles (Fidelity.spacing)")
        kept = found.surface if shell else np.ones(len(found.positions), dtype=bool)
        positions, normals = found.positions[kept], found.normals[kept]
        shares = weights(positions, normals, 0.5 * found.spacing)
        return Samples(self.scale * positions, shares, 0.5 * apart)

    def sides(self) -> Array:
        """Normals [k, 3] of flat sides on which it can lie, beside those along its axes."""
        return geometry.resting_sides(self.vertices, self.faces, 0.5 * self._solid.width)

    @property
    def grid(self) -> DistanceGrid:
        """Signed distances in the body frame at scale 1. Warns where walls are thinner than a cell.

        The memory is about 8 cells^3 bytes for a compact shape.
        """
        found = geometry.grid(self.vertices, self.faces, self.cells)
        cell = self.scale * found.cell
        warn_if_thin(self.thickness, cell, self.cells, "the distance grid (Mesh.cells)")
        return found

    def surface(self, rounding: float) -> Surface:
        """The distance grid; edges stay as sharp as its cells are small."""
        half = self.scale * np.abs(self._solid.vertices).max(axis=0)
        return Surface(GRID, (float(half[0]), float(half[1]), float(half[2])), 0.0, self)

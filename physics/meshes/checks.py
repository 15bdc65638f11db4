"""Checks that a mesh is the surface of a solid. Errors say what is wrong and what to do."""

import warnings

import numpy as np

from physics.meshes.parts import inverted_part
from physics.meshes.properties import properties

Array = np.ndarray

# volume, over that of the bounding box, below which a mesh is flat
_FLAT = 1e-9
# mean thickness, over the size, below which it is round-off of single precision
_THINNEST = 1e-6


def check_arrays(vertices: Array, faces: Array) -> None:
    """Raises ValueError unless vertices [n, 3] are finite and faces [m, 3] index them."""
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
        raise ValueError(f"Mesh.vertices must have the shape (n, 3), got {vertices.shape}")
    if not np.all(np.isfinite(vertices)):
        row = int(np.argmin(np.isfinite(vertices).all(axis=1)))
        raise ValueError(f"Mesh.vertices must be finite, got {vertices[row]} at index {row}")
    if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        raise ValueError(f"Mesh.faces must be triangles of shape (m, 3), got {faces.shape}")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError(
            f"Mesh.faces must be indices from 0 to {len(vertices) - 1} of the vertices, got "
            f"{faces.min()} to {faces.max()}"
        )


def check_solid_mesh(vertices: Array, faces: Array) -> None:
    """Raises ValueError unless merged triangles enclose a volume and wind outwards.

    Every edge must be passed as often in one direction as in the other.
    """
    if len(faces) < 4:
        raise ValueError(
            "Mesh must be closed: at least 4 triangles with three different corners each enclose a "
            f"volume, got {len(faces)}"
        )
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    forward = ends[:, 0] < ends[:, 1]
    key = np.where(forward, ends[:, 0], ends[:, 1]) * len(vertices)
    key += np.where(forward, ends[:, 1], ends[:, 0])
    edges, index = np.unique(key, return_inverse=True)
    balance = np.bincount(index, np.where(forward, 1.0, -1.0), len(edges))
    uses = np.bincount(index, minlength=len(edges))
    if np.any(uses % 2):
        count = int(np.count_nonzero(uses % 2))
        raise ValueError(
            f"Mesh must be closed, got {count} open edges: fill its holes in a modelling tool or "
            "by trimesh.repair.fill_holes, or merge vertices that should be one "
            "(trimesh.Trimesh.merge_vertices)"
        )
    if np.any(balance):
        count = int(np.count_nonzero(balance))
        raise ValueError(
            f"Mesh.faces must all wind counterclockwise as seen from outside, got {count} edges "
            "at which two faces disagree: use trimesh.repair.fix_normals"
        )
    volume = properties(vertices, faces).volume
    box = float(np.prod(vertices.max(axis=0) - vertices.min(axis=0)))
    if abs(volume) <= _FLAT * box or box == 0.0:
        raise ValueError(f"Mesh must enclose a volume, got one of {volume:.3g} m^3")
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    size = float(np.ptp(vertices, axis=0).max())
    if 2.0 * abs(volume) <= _THINNEST * size * area:
        raise ValueError(
            f"Mesh must enclose a volume, got one of {volume:.3g} m^3 within an area of "
            f"{area:.3g} m^2: a sheet of {2.0 * abs(volume) / area:.2g} m; give it a thickness"
        )
    if volume < 0.0 and inverted_part(vertices, faces[:, ::-1]) is None:
        raise ValueError(
            f"Mesh.faces must wind counterclockwise as seen from outside, got an inverted mesh "
            f"(volume {volume:.3g} m^3): reverse the faces, faces[:, ::-1] or "
            "trimesh.Trimesh.invert"
        )
    part = inverted_part(vertices, faces)
    if part is not None:
        raise ValueError(
            f"Mesh.faces must wind counterclockwise as seen from outside, got a part of "
            f"{part.faces} faces from {_place(part.low)} to {_place(part.high)} (volume "
            f"{part.volume:.3g} m^3) that is turned inwards and not a cavity in another part: "
            "reverse its faces, faces[:, ::-1], or use trimesh.repair.fix_normals(multibody=True)"
        )


def _place(point: Array) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in point) + ")"


def warn_if_thin(thickness: float, cell: float, cells: float, what: str) -> None:
    """Warns if walls are thinner than a cell: they would have holes, or be missing.

    Args:
        thickness: m, of the thinnest walls.
        cell: m, of a grid or between particles.
        cells: how many the longest axis has.
        what: the cells, and how to make them smaller.
    """
    if thickness < cell:
        needed = int(np.ceil(cells * cell / thickness))
        warnings.warn(
            f"Mesh has walls {thickness:.3g} m thick, thinner than the spacing of {cell:.3g} m of "
            f"{what}; it takes at least {needed} along the longest axis",
            stacklevel=2,
        )

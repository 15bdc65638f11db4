"""Triangle meshes from files, trimesh objects and arrays."""

import os
from typing import Any

import numpy as np

Array = np.ndarray


def read_mesh(source: Any) -> tuple[Array, Array]:
    """Vertices [n, 3] and faces [m, 3] of a file or a `trimesh.Trimesh`.

    Args:
        source: path of a file that trimesh reads (STL, OBJ, PLY, GLB, ...), or a Trimesh. A file
            with several meshes counts as one.

    Raises:
        ImportError: trimesh is not installed.
        TypeError: neither a path nor a Trimesh.
        ValueError: the file does not exist or holds no triangle mesh.
    """
    try:
        import trimesh
    except ImportError:
        raise ImportError(
            "Mesh(path or trimesh.Trimesh) needs trimesh; to install, in a clone: "
            "pip install -c constraints.txt -e '.[mesh]'. "
            "Mesh(vertices=..., faces=...) needs only numpy"
        ) from None
    if isinstance(source, trimesh.Trimesh):
        return np.asarray(source.vertices), np.asarray(source.faces)
    if not isinstance(source, str | os.PathLike):
        raise TypeError(
            f"Mesh.source must be a path or a trimesh.Trimesh, got {source!r} "
            f"({type(source).__name__})"
        )
    if not os.path.isfile(source):
        raise ValueError(f"Mesh.source must be an existing file, got {os.fspath(source)!r}")
    try:
        loaded: Any = trimesh.load_mesh(source)
        # a scene of several meshes, each with its pose
        loaded = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
        vertices, faces = np.asarray(loaded.vertices), np.asarray(loaded.faces)
    except Exception as error:  # each reader of trimesh raises errors of its own
        raise ValueError(
            f"Mesh.source must be a file of triangles, {os.fspath(source)!r} can't be read: {error}"
        ) from error
    if not len(faces):
        raise ValueError(f"Mesh.source must hold triangles, {os.fspath(source)!r} has none")
    return vertices, faces


def merged(vertices: Array, faces: Array) -> tuple[Array, Array]:
    """The same mesh with one vertex per position, without faces that have two equal corners."""
    vertices, index = np.unique(vertices, axis=0, return_inverse=True)
    faces = index.reshape(-1)[faces]
    kept = np.all(faces != np.roll(faces, 1, axis=1), axis=1)
    return vertices, faces[kept]

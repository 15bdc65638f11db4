"""The convex hull of a mesh; by Qhull."""

import numpy as np

Array = np.ndarray


def convex_hull(vertices: Array) -> tuple[Array, Array]:
    """Vertices [n, 3] and faces [m, 3] of the convex hull of points [k, 3].

    Raises:
        ImportError: scipy is not installed.
        ValueError: all points are in a plane.
    """
    try:
        from scipy.spatial import ConvexHull, QhullError
    except ImportError:
        raise ImportError(
            "Mesh(convex_hull=True) needs scipy; to install, in a clone: "
            "pip install -c constraints.txt -e '.[mesh]'"
        ) from None
    try:
        found = ConvexHull(vertices)
    except QhullError:
        raise ValueError(
            f"Mesh.vertices must span a volume for convex_hull, got {len(vertices)} in a plane"
        ) from None
    kept, index = np.unique(found.simplices, return_inverse=True)
    faces, points = index.reshape(-1, 3), vertices[kept]
    a, b, c = np.moveaxis(points[faces], 1, 0)
    inwards = np.einsum("fi,fi->f", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    return points, np.where(inwards[:, None], faces[:, ::-1], faces)

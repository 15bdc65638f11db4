"""Repair of an open mesh: faces that wind consistently, and a lid on each hole.

1. Vertices nearer than round-off of the file become one; of equal triangles one is left.
2. Faces with a common edge are turned until they pass it in opposite directions, and each part
   such that its volume is positive, or is left as it is where it is a cavity.
3. The edges that are passed more often in one direction than in the other form closed curves. A fan
   of triangles from the middle of each curve is its lid. Afterwards the mesh is closed, whatever
   the holes were like.

A lid is a guess, and the guess is good for holes that are small. So what it adds is reported: the
volume between the lids and the middle of the mesh, over the volume of all.
"""

from collections import defaultdict, deque

import numpy as np

from physics.meshes.parts import inverted_part, labels
from physics.meshes.properties import properties
from physics.meshes.read import merged

Array = np.ndarray

# of the size of a mesh, below which vertices are the same: single precision with a margin
_SAME = 1e-6


def repaired(vertices: Array, faces: Array) -> tuple[Array, Array, float]:
    """Vertices [n, 3] and faces [m, 3] of a closed mesh, and the fraction of volume that lids add.

    Args:
        vertices: [k, 3].
        faces: [j, 3].
    """
    size = float(np.ptp(vertices, axis=0).max())
    points = vertices
    if size > 0.0:
        snapped = np.round((vertices - vertices[0]) / (_SAME * size))
        first, index = np.unique(snapped, axis=0, return_index=True, return_inverse=True)[1:]
        points, faces = vertices[first], index.reshape(-1)[faces]
    points, faces = merged(points, faces)
    if not len(faces):
        return points, faces, 0.0
    faces = faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]
    faces = _wound(faces)
    ends, lids = points, []
    for curve in _open_curves(faces):
        middle = len(ends)
        ends = np.concatenate([ends, [points[curve].mean(axis=0)]])
        lids += [(middle, b, a) for a, b in zip(curve, [*curve[1:], curve[0]], strict=True)]
    closed = np.concatenate([faces, np.array(lids, dtype=faces.dtype).reshape(-1, 3)])
    closed, lid = _outwards(ends, closed), np.arange(len(closed)) >= len(faces)
    middle = points[np.unique(faces)].mean(axis=0)
    a, b, c = np.moveaxis(ends[closed] - middle, 1, 0)
    volumes = np.einsum("fi,fi->f", a, np.cross(b, c)) / 6.0
    total = float(volumes.sum())
    return ends, closed, float(volumes[lid].sum()) / total if total != 0.0 else 0.0


def _wound(faces: Array) -> Array:
    """Faces turned such that those with an edge of two faces pass it in opposite directions."""
    at: dict[tuple[int, int], list[int]] = defaultdict(list)
    corners = faces.tolist()
    for f, (a, b, c) in enumerate(corners):
        for u, v in ((a, b), (b, c), (c, a)):
            at[min(u, v), max(u, v)].append(f)
    done = [False] * len(corners)
    for start in range(len(corners)):
        waiting = deque([] if done[start] else [start])
        done[start] = True
        while waiting:
            f = waiting.popleft()
            a, b, c = corners[f]
            for u, v in ((a, b), (b, c), (c, a)):
                both = at[min(u, v), max(u, v)]
                for g in both if len(both) == 2 else ():
                    if not done[g]:
                        done[g] = True
                        x, y, z = corners[g]
                        if (u, v) in ((x, y), (y, z), (z, x)):
                            corners[g] = [z, y, x]
                        waiting.append(g)
    return np.array(corners, dtype=faces.dtype)


def _open_curves(faces: Array) -> list[list[int]]:
    """Closed curves of vertices along the edges that lack a face, in the direction of the faces."""
    excess: dict[tuple[int, int], int] = defaultdict(int)
    for a, b, c in faces.tolist():
        for u, v in ((a, b), (b, c), (c, a)):
            excess[min(u, v), max(u, v)] += 1 if u < v else -1
    onward: dict[int, list[int]] = defaultdict(list)
    for (u, v), count in excess.items():
        for _ in range(abs(count)):
            if count > 0:
                onward[u].append(v)
            else:
                onward[v].append(u)
    curves = []
    for start in list(onward):
        while onward[start]:
            path, seen = [start], {start: 0}
            while True:  # a curve that meets itself is divided there
                v = onward[path[-1]].pop()
                if v in seen:
                    curves.append(path[seen[v] :])
                    for u in path[seen[v] + 1 :]:
                        del seen[u]
                    path = path[: seen[v] + 1]
                    if len(path) == 1:
                        break
                else:
                    seen[v] = len(path)
                    path.append(v)
    return [curve for curve in curves if len(curve) > 2]


def _outwards(vertices: Array, faces: Array) -> Array:
    """Faces with each part that is turned inwards, and is no cavity, turned around."""
    if properties(vertices, faces).volume < 0.0:
        faces = faces[:, ::-1]
    label = labels(faces)
    for _ in range(int(label.max()) + 1):
        found = inverted_part(vertices, faces)
        if found is None:
            break
        faces = np.where((label == found.label)[:, None], faces[:, ::-1], faces)
    return faces

"""Which samples it takes for a solid to rest on a plane where its mesh does.

In a direction u a solid reaches as far as its outermost point: h(u) = max u . p. On a plane with
that direction downwards it rests at the height h(u). Samples at c with the radius r reach as far as
max u . c + r. Between two samples of a round area that is less, so samples are added, the one that
is missing most first, until in no direction more than the sink is missing: the depth to which
contacts let a body at rest sink in any case.

The rounder a mesh is, the larger r can be and the fewer samples it takes. The largest ball that
touches face i from inside and is within the planes of all others j, but for the sink s, has

    r = min (h_j - n_j . p_i + s) / (1 - n_j . n_i)

with normals n and a point p_i of face i: on a ball its radius, on a solid with fillets theirs.
"""

import numpy as np

from physics.directions import spread_directions
from physics.meshes.sides import touched_by

Array = np.ndarray

# directions that are tested: normals of faces, and others beside them
_FACES = 1000
_SPREAD = 400
# decimals of normals that count as one
_DECIMALS = 6
# of a length, below which it is round-off
_SAME = 1e-6


class Support:
    """How far a mesh reaches in many directions.

    Attributes:
        faces: [k] faces of different normals.
        directions: [d, 3] their normals, and others that are spread evenly.
        reach: [d] m, of the mesh.
        outer: mask [k] of the faces that a plane can touch.
        middles: [k, 3] m, of the faces.
    """

    def __init__(self, vertices: Array, faces: Array) -> None:
        corners = vertices[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        doubled = np.linalg.norm(normals, axis=1)
        order = np.argsort(-doubled, kind="stable")
        order = order[doubled[order] > 0.0]
        normals = normals[order] / doubled[order, None]
        alike = np.unique(np.round(normals, _DECIMALS) + 0.0, axis=0, return_index=True)[1]
        alike = np.sort(alike)  # of alike normals the largest face
        if len(alike) > _FACES:
            alike = alike[np.linspace(0, len(alike) - 1, _FACES).astype(int)]
        self.faces = order[alike]
        self.directions = np.concatenate([normals[alike], spread_directions(_SPREAD)])
        self.reach = (self.directions @ vertices.T).max(axis=1)
        self.middles = corners[self.faces].mean(axis=1)
        own = np.einsum("ki,ki->k", self.directions[: len(alike)], self.middles)
        same = _SAME * float(np.abs(vertices).max())
        self.outer = own >= self.reach[: len(alike)] - same
        longest = np.argmax(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2), axis=1)
        rows = np.arange(len(corners))
        ends = 0.5 * (corners[rows, longest] + corners[rows, (longest + 1) % 3])
        self.inner_points = ends[self.faces]

    @property
    def normals(self) -> Array:
        """[k, 3] of the outer faces."""
        return np.asarray(self.directions[: len(self.faces)][self.outer])

    def largest_radius(self, sink: float) -> float:
        """Radius in m of the largest balls that touch every outer face, see above."""
        normals, points = self.normals, self.middles[self.outer]
        room = self.reach - points @ self.directions.T + sink
        turn = 1.0 - normals @ self.directions.T
        ratio = np.where(turn > _SAME, room / np.maximum(turn, _SAME), np.inf)
        return float(ratio.min(initial=np.inf))

    def one_ball(self, sink: float) -> tuple[Array, float]:
        """Centre [3] and radius in m of a ball that reaches all outer faces; 0 if none does.

        It may lack the sink. Its centre is that which fits all faces best (least squares).
        """
        normals, reach = self.normals, self.reach[: len(self.faces)][self.outer]
        if len(normals) < 4:
            return np.zeros(3), 0.0
        columns = np.concatenate([normals, np.ones((len(normals), 1))], axis=1)
        centre = np.linalg.lstsq(columns, reach, rcond=None)[0][:3]
        away = reach - normals @ centre
        nearest, farthest = float(away.min()), float(away.max())
        return centre, nearest if farthest - nearest <= sink else 0.0

    def at_corners(
        self, vertices: Array, faces: Array, radius: float, sink: float
    ) -> tuple[Array, Array]:
        """Centres [n, 3] m of balls that touch outer faces at their corners, and normals [n, 3].

        Those that reach over other faces by more than the sink are left out.
        """
        places = vertices[faces[self.faces[self.outer]]].reshape(-1, 3)
        normals = np.repeat(self.normals, 3, axis=0)
        centres = places - radius * normals
        over = (centres @ self.directions.T + radius - self.reach).max(axis=1, initial=0.0)
        return centres[over <= sink], normals[over <= sink]

    def missing(self, centres: Array, chosen: Array, sink: float) -> Array:
        """[n] indices of the samples that have to be added to those that are chosen, a mask [n]."""
        heights = self.directions @ centres.T
        wanted = heights.max(axis=1)
        there = heights[:, chosen].max(axis=1, initial=-np.inf)
        added: list[int] = []
        while True:
            lacks = wanted - there
            worst = int(np.argmax(lacks))
            if not lacks[worst] > max(sink, _SAME * float(np.abs(centres).max())):
                return np.array(added, dtype=int)
            added.append(int(np.argmax(heights[worst])))
            there = np.maximum(there, heights[:, added[-1]])

    def resting_faces(self, centres: Array, sink: float) -> list[tuple[Array, Array, Array]]:
        """Of each outer face on which the solid can rest: normal, touched samples, a point on it.

        It can rest where the centre of mass, the origin, is above what touches.
        """
        found = []
        touched = touched_by(centres, self.normals, sink)
        for normal, mask, point in zip(
            self.normals, touched, self.inner_points[self.outer], strict=True
        ):
            if surrounds(centres[mask], normal):
                found.append((normal, mask, point))
        return found


def surrounds(points: Array, normal: Array) -> bool:
    """Whether points [n, 3] m in a plane lie around the foot of the origin."""
    across = np.linalg.svd(normal[None])[2][1:]
    places = points @ across.T
    angles = np.sort(np.arctan2(places[:, 1], places[:, 0]))
    gaps = np.diff(np.append(angles, angles[0] + 2.0 * np.pi))
    return bool(len(points) > 2 and gaps.max() < np.pi)

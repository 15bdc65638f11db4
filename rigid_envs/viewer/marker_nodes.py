"""Markers of goals as nodes of viser: discs and balls, places of solids, crosses."""

from typing import Any, NamedTuple

import numpy as np
import viser

from rigid_envs.rendering.markers import box_corners
from rigid_envs.rendering.view import Ghost, Goal, Mark, Marker
from rigid_envs.viewer.triangles import Triangles, cylinder, rounded

Array = np.ndarray

DISC_OPACITY, GHOST_OPACITY = 0.35, 0.22
DISC_HEIGHT = 0.001  # m
_UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])  # quaternion x, y, z, w
ARM = 0.25  # width of a cross's arm over half its length
EDGES = (0, 1, 0, 2, 0, 4, 1, 3, 1, 5, 2, 3, 2, 6, 3, 7, 4, 5, 4, 6, 5, 7, 6, 7)
"""Pairs of `box_corners`."""


class Kind(NamedTuple):
    """A mesh of unit size and how it is drawn."""

    mesh: Triangles
    opacity: float | None


def _cross() -> Triangles:
    """Two bars that cross at the origin, along the diagonals, with arms of length 1."""
    bars = []
    for turn in (0.25 * np.pi, -0.25 * np.pi):
        along = np.array([np.cos(turn), np.sin(turn), 0.0])
        across = ARM * np.array([-along[1], along[0], 0.0])
        bars += [along + across, -along + across, -along - across, along - across]
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    return Triangles(np.array(bars), faces)


KINDS = {
    "disc": Kind(cylinder(1.0, 0.5), DISC_OPACITY),
    "ball": Kind(rounded(np.zeros(3), 1.0), None),
    "ghost": Kind(rounded(np.ones(3), 0.0, sides=4), GHOST_OPACITY),
    "cross": Kind(_cross(), None),
}


class MarkerNodes:
    """Shows markers: one node for all of a kind.

    Args:
        scene: of the page.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        """Adds nothing yet."""
        self._scene = scene
        self._nodes: dict[str, tuple[Array, Any]] = {}
        self._edges: tuple[Array, Any] | None = None

    def update(self, markers: list[tuple[Marker, Array]]) -> None:
        """Shows these markers and no others.

        Args:
            markers: each with the place [3] m of its world.
        """
        found: dict[str, list[Array]] = {}
        edges, colors = [], []
        for marker, place in markers:
            for kind, position, size in _parts(marker):
                turn = marker.orientation if isinstance(marker, Ghost) else _UPRIGHT
                row = np.concatenate([position + place, size, np.roll(turn, 1), marker.color])
                found.setdefault(kind, []).append(row)
            if isinstance(marker, Ghost):
                corners = box_corners(marker) + place
                edges.append(corners[list(EDGES)].reshape(-1, 2, 3))
                colors.append(np.broadcast_to(np.array(marker.color), (len(EDGES) // 2, 2, 3)))
        for kind in [kind for kind in self._nodes if kind not in found]:
            self._nodes.pop(kind)[1].remove()
        for kind, rows in found.items():
            self._show(kind, np.array(rows))
        self._show_edges(edges, colors)

    def _show(self, name: str, rows: Array) -> None:
        """Shows markers of a kind: rows [n, 13] of position, size, w, x, y, z, and colour."""
        old, colors = self._nodes.get(name), rows[:, 10:].astype(np.uint8)
        if old is not None and np.array_equal(old[0], rows):
            return
        if old is not None and len(old[0]) == len(rows):
            node = old[1]
            node.batched_positions, node.batched_scales = rows[:, :3], rows[:, 3:6]
            node.batched_wxyzs, node.batched_colors = rows[:, 6:10], colors
        else:
            if old is not None:
                old[1].remove()
            kind = KINDS[name]
            node = self._scene.add_batched_meshes_simple(
                f"/{name}",
                kind.mesh.vertices,
                kind.mesh.faces,
                rows[:, 6:10],
                rows[:, :3],
                batched_scales=rows[:, 3:6],
                batched_colors=colors,
                opacity=kind.opacity,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
        self._nodes[name] = rows, node

    def _show_edges(self, edges: list[Array], colors: list[Array]) -> None:
        if not edges:
            if self._edges is not None:
                self._edges[1].remove()
            self._edges = None
            return
        points = np.concatenate(edges)
        shown = np.concatenate([points, np.concatenate(colors)], axis=2)
        if self._edges is not None and np.array_equal(self._edges[0], shown):
            return
        node = self._scene.add_line_segments(
            "/ghost edges",
            points,
            shown[:, :, 3:].astype(np.uint8),
            thickness=1.5,
            thickness_units="screen",
        )
        self._edges = shown, node


def _parts(marker: Marker) -> list[tuple[str, Array, Array]]:
    """Kind, position [3] m and size [3] m of the meshes of a marker."""
    foot = marker.position * (1.0, 1.0, 0.0)
    if isinstance(marker, Ghost):
        return [("ghost", marker.position, marker.half_extents)]
    if isinstance(marker, Mark):
        above = foot + np.array([0.0, 0.0, 2.0 * DISC_HEIGHT])
        return [("cross", above, np.full(3, marker.radius))]
    assert isinstance(marker, Goal)
    # smaller discs lie on larger ones
    height = DISC_HEIGHT * (1.0 + 0.02 / (0.02 + marker.radius))
    disc = np.array([marker.radius, marker.radius, height])
    parts = [("disc", foot, disc)]
    if marker.position[2] > 0.0:
        ball = min(marker.radius, float(marker.position[2]))
        parts.append(("ball", marker.position, np.full(3, ball)))
    return parts

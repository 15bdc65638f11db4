"""What the worlds look like in a page: solids, floors, forces and light as nodes of viser.

A solid is one node with an instance for each world, so that many worlds need few messages.
"""

from typing import Any

import numpy as np
import viser

from physics import Box, Ground
from rigid_envs.episodes.runner import Runner
from rigid_envs.rendering import scene_view
from rigid_envs.rendering.rays.light import TO_SUN
from rigid_envs.rendering.view import Arrow, Item
from rigid_envs.viewer.layout import CELL, Layout
from rigid_envs.viewer.marker_nodes import MarkerNodes
from rigid_envs.viewer.triangles import triangles

Array = np.ndarray

FORCES = ("off", "of each pair", "of each point")
"""Which contact forces are drawn: none, the sum of two solids, or that of each of their points."""

FLOOR, LINES, FINE_LINES = (250, 251, 253), (176, 182, 191), (208, 212, 219)
GLASS = 0.55  # opacity of solids while forces are shown, most of which act inside
THICKNESS = 0.01  # m, of a floor
FINE = 0.6  # m, half width of a floor from which on lines between the cells would be too dense
ABOVE = 3e-4  # m, of lines above the floor
SHAFT, HEAD, HEAD_LENGTH = 0.0025, 0.006, 0.014  # m, of an arrow
FORCE_COLOR = Arrow(np.zeros(3), np.zeros(3)).color


class SceneNodes:
    """The worlds of a runner as nodes of a page's scene.

    Args:
        scene: of the page.
        runner: whose worlds.
    """

    def __init__(self, scene: viser.SceneApi, runner: Runner) -> None:
        """Adds floors, light and solids."""
        self._scene, self._runner = scene, runner
        self.layout = Layout(runner.count, runner.task.camera)
        self._offsets = self.layout.offsets
        self._markers = MarkerNodes(scene)
        self._arrows: Any = None
        _add_light(scene)
        for static in runner.world.scene.statics:
            if isinstance(static, Ground):
                self._add_floors(static.height)
        self._nodes = [self._add_solid(k, solid) for k, solid in enumerate(self._solids())]

    def update(self, forces: str, goals: bool) -> None:
        """Shows the worlds as they are now.

        Args:
            forces: one of `FORCES`.
            goals: whether to show the markers of the goals.
        """
        opacity = 1.0 if forces == FORCES[0] else GLASS
        for node, solid in zip(self._nodes, self._solids(), strict=True):
            least = min(opacity, solid.opacity)
            node.opacity = None if least == 1.0 else least
            node.batched_positions = solid.position + self._offsets
            node.batched_wxyzs = _wxyz(solid)
            scales = _scales(solid)
            if not np.array_equal(scales, node.batched_scales):
                node.batched_scales = scales
        self._markers.update(self._marked() if goals else [])
        self._show_arrows(forces)

    def _solids(self) -> list[Item]:
        """Every solid, with its poses in all worlds."""
        return scene_view.items(self._runner.world, np.arange(self._runner.count))

    def _add_solid(self, k: int, solid: Item) -> Any:
        mesh = triangles(solid.shape)
        return self._scene.add_batched_meshes_simple(
            f"/solid {k}",
            mesh.vertices,
            mesh.faces,
            _wxyz(solid),
            solid.position + self._offsets,
            batched_scales=_scales(solid),
            batched_colors=solid.color,
            lod="off",
        )

    def _marked(self) -> list[tuple[Any, Array]]:
        """Markers of all worlds, each with the place [3] m of its world."""
        return [
            (marker, self._offsets[i])
            for i in range(self._runner.count)
            for marker in scene_view.markers(self._runner, i)
        ]

    def _show_arrows(self, forces: str) -> None:
        segments = []
        if forces != FORCES[0]:
            for i in range(self._runner.count):
                arrows = scene_view.forces(self._runner.world, i, particles=forces == FORCES[2])
                segments += [
                    np.stack([arrow.origin, arrow.origin + arrow.vector]) + self._offsets[i]
                    for arrow in arrows
                ]
        if self._arrows is None:
            if not segments:
                return
            self._arrows = self._scene.add_arrows(
                "/forces",
                np.array(segments),
                FORCE_COLOR,
                shaft_radius=SHAFT,
                head_radius=HEAD,
                head_length=HEAD_LENGTH,
            )
            return
        self._arrows.visible = bool(segments)
        if segments:
            self._arrows.points = np.array(segments)

    def _add_floors(self, height: float) -> None:
        layout = self.layout
        half = layout.half_width
        middles = self._offsets + np.append(layout.centre, height)
        slab = triangles(Box((half, half, 0.5 * THICKNESS)))
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (layout.count, 1))
        self._scene.add_batched_meshes_simple(
            "/floors",
            slab.vertices,
            slab.faces,
            upright,
            middles - (0.0, 0.0, 0.5 * THICKNESS),
            batched_colors=FLOOR,
            lod="off",
            cast_shadow=False,
        )
        kinds = [("lines", 0.0, LINES), ("fine lines", 0.5 * CELL, FINE_LINES)]
        for name, shift, color in kinds if half < FINE else kinds[:1]:
            place = np.arange(-half + shift, half + 0.1 * CELL, CELL)
            ends = np.array([-half, half])
            along = np.stack(np.broadcast_arrays(place[:, None], ends, ABOVE), axis=-1)
            lines = np.concatenate([along, along[..., [1, 0, 2]]])
            everywhere = (middles[:, None, None] + lines).reshape(-1, 2, 3)
            self._scene.add_line_segments(
                f"/{name}", everywhere, color, thickness=1.0, thickness_units="screen"
            )


def _add_light(scene: viser.SceneApi) -> None:
    """Light from the sky and from the side from which the other renderer's light comes."""
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map("studio", environment_intensity=0.1)
    scene.add_light_hemisphere(
        "/sky", sky_color=(255, 255, 255), ground_color=(200, 196, 190), intensity=0.55
    )
    x, y, z = (5.0 * TO_SUN).tolist()
    scene.add_light_directional(
        "/sun",
        color=(255, 250, 240),
        intensity=2.8,
        cast_shadow=True,
        position=(x, y, z),
    )


def _wxyz(solid: Item) -> Array:
    """[n, 4] quaternions w, x, y, z."""
    return np.asarray(solid.orientation[:, [3, 0, 1, 2]])


def _scales(solid: Item) -> Array:
    """[n, 3], by which the solid is larger than its shape."""
    sizes = np.broadcast_to(solid.size, len(solid.position))
    return np.repeat(sizes[:, None], 3, axis=1)

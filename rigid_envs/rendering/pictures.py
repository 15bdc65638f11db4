"""Pictures of running episodes: what both kinds of environment share."""

import math
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from physics.scene.validation import choice, instance, integer
from rigid_envs.rendering import scene_view
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.cameras import FOLLOW, choose_camera, fitted, following
from rigid_envs.rendering.renderer import Renderer, grid
from rigid_envs.rendering.view import Ghost
from rigid_envs.rendering.window import Window, check_display

Array = np.ndarray

RENDER_MODES = ("rgb_array", "human")
SIZE = 480  # pixels, width and height of a frame
FPS = 25
WINDOW = 960  # pixels, widest that a window of many worlds gets
IN_WINDOW = 16  # worlds that a window shows, if it isn't told how many
LEAST, MOST = 16, 4096  # pixels, width or height of a frame


class Pictures:
    """Draws worlds, off screen or in a window. Only a window needs pygame.

    Warns if a size of frames is given where only observed pixels are drawn.

    Args:
        shown: the episodes.
        mode: None, "rgb_array" or "human".
        width: of a frame in pixels.
        height: of a frame in pixels.
        camera: a name, a Camera or its settings, see `choose_camera`.
        show_forces: draw contact forces.
        show_particles: draw what touches in place of exact shapes.
        worlds: how many to draw at most; if None all of them, or `IN_WINDOW` in a window.
        pixels: whether pixels are observed.

    Attributes:
        camera: where to look from; with "follow" the task's camera, which each frame moves.

    Raises:
        NoDisplay: a window where there is nothing to show it on.
    """

    def __init__(
        self,
        shown: scene_view.Shown,
        mode: str | None,
        width: int = SIZE,
        height: int = SIZE,
        camera: Any = None,
        show_forces: bool = False,
        show_particles: bool = False,
        worlds: int | None = None,
        pixels: bool = False,
    ) -> None:
        """Checks all arguments. A window opens with its first picture."""
        if mode is not None:
            choice("render_mode", mode, RENDER_MODES)
        self._shown, self._mode = shown, mode
        self._show_forces: bool = instance("show_forces", show_forces, bool)
        self._show_particles: bool = instance("show_particles", show_particles, bool)
        self._width = integer("width", width, low=LEAST, high=MOST)
        self._height = integer("height", height, low=LEAST, high=MOST)
        self.camera = choose_camera(camera, shown.task, self._width / self._height)
        self._follows = isinstance(camera, str) and camera == FOLLOW
        self._floor = scene_view.floor(shown.world.scene).height
        if worlds is None:
            worlds = IN_WINDOW if mode == "human" else shown.count
        self._count = min(integer("render_worlds", worlds, low=1), shown.count)
        self._renderer: Renderer | None = None
        self._window: Window | None = None
        if mode == "human":
            check_display()
        self._warned = False
        if mode is None and pixels and (width, height) != (SIZE, SIZE):
            gym.logger.warn(
                f"width={width} and height={height} are of frames of render(), which needs a "
                "render_mode; the size of observed pixels is pixel_size=..."
            )

    def points(self, *, arms: bool) -> Array:
        """[n, 3] m around what pictures of the first world show: solids but statics, and markers.

        Args:
            arms: whether what carries the drives is among the solids.
        """
        scene, ends = self._shown.world.scene, []
        statics = len(scene.bodies) + len(scene.driven_bodies)
        for item in scene_view.items(self._shown.world, np.zeros(1, dtype=np.int64)):
            if item.solid < statics and (arms or item.opacity == 1.0):
                reach = item.shape.reach * float(np.max(item.size))
                ends += _around(item.position[0], np.full(3, reach))
        for marker in scene_view.markers(self._shown, 0):
            if isinstance(marker, Ghost):
                ends += _around(marker.position, np.full(3, np.linalg.norm(marker.half_extents)))
            else:  # and the disc on the ground
                flat = np.array([marker.radius, marker.radius, 0.0])
                ends += _around(marker.position, flat)
                ends += _around(np.array([*marker.position[:2], self._floor or 0.0]), flat)
        return np.array(ends)

    def look(self, camera: Any) -> None:
        """Takes the next frames from another camera, given as to `choose_camera`."""
        self.camera = choose_camera(camera, self._shown.task, self._width / self._height)
        self._follows = isinstance(camera, str) and camera == FOLLOW
        self._renderer = None

    def fitted(self, points: Array) -> Camera:
        """The camera from the side of the task's that just sees some points [n, 3] m."""
        return fitted(self._shown.task.camera, points, self._width / self._height)

    def frames(self) -> tuple[Array, ...]:
        """Pictures [height, width, 3] uint8 of the first worlds."""
        if self._count < self._shown.count and not self._warned:
            self._warned = True
            gym.logger.warn(
                f"render() draws render_worlds={self._count} of {self._shown.count} worlds; "
                "RecordVideo and HumanRendering want a picture of every world"
            )
        return self._draw(self._width, self._height)

    def show(self) -> None:
        """Draws the first worlds in a window, as a grid."""
        columns = math.ceil(math.sqrt(self._count))
        share = min(1.0, WINDOW / (columns * self._width))
        width, height = max(round(share * self._width), 1), max(round(share * self._height), 1)
        if self._window is None:
            rows = -(-self._count // columns)
            title = type(self._shown.task).__name__
            self._window = Window(columns * width, rows * height, FPS, title)
        if not self._window.closed:
            self._window.show(grid(self._draw(width, height), columns))

    def close(self) -> None:
        """Closes the window, if any."""
        if self._window is not None:
            self._window.close()
        self._window = self._renderer = None

    def _draw(self, width: int, height: int) -> tuple[Array, ...]:
        if self._follows:
            return tuple(
                self._frames(self._looking(camera, width, height), [world])[0]
                for world, camera in enumerate(self._following(width / height))
            )
        if self._renderer is None:
            self._renderer = self._looking(self.camera, width, height)
        return tuple(self._frames(self._renderer, range(self._count)))

    def _looking(self, camera: Camera, width: int, height: int) -> Renderer:
        threads = self._shown.world.threads
        return Renderer(width, height, camera, floor=self._floor, threads=threads)

    def _following(self, shape: float) -> list[Camera]:
        """For each world a camera that follows what is to reach the goal."""
        engine, task, goals = self._shown.world, self._shown.task, self._shown.goals
        if [unit for _, unit, _, _ in task.goal_bounds[:3]] == ["m"] * 3:
            places = task.achieved(engine, engine.read())[: self._count, :3]
            goals = goals[: self._count, :3]
        else:  # a goal that is no place
            places = goals = engine.read().position[: self._count, 0]
        bodies = engine.position[: self._count, 0] if engine.scene.bodies else places
        return [
            following(self.camera, place, goal, self._floor or 0.0, shape, body=body)
            for place, goal, body in zip(places, goals, bodies, strict=True)
        ]

    def _frames(self, renderer: Renderer, worlds: Sequence[int]) -> Array:
        """[n, height, width, 3] uint8 of some worlds."""
        items = scene_view.items(
            self._shown.world, np.array(worlds), particles=self._show_particles
        )
        overlays = [renderer.overlay(*self._beside(world)) for world in worlds]
        rgb = renderer.frames(items, overlays, worlds=len(worlds)).rgb
        assert rgb is not None
        return rgb

    def _beside(self, world: int) -> tuple[Any, Any]:
        """Markers and forces of a world."""
        shown, particles = self._shown, self._show_particles
        arrows = (
            scene_view.forces(shown.world, world, particles=particles) if self._show_forces else ()
        )
        return scene_view.markers(shown, world), arrows


def _around(middle: Array, half: Array) -> list[Array]:
    """The ends of the axes [6] of an upright ellipsoid."""
    return [middle + sign * end for end in np.diag(half) for sign in (-1.0, 1.0)]

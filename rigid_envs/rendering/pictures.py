"""Pictures of a runner's worlds: what both kinds of environment share."""

import math
from typing import TYPE_CHECKING

import gymnasium as gym
import numpy as np

from physics.scene.validation import choice, instance, integer
from rigid_envs.rendering import scene_view
from rigid_envs.rendering.renderer import Renderer, grid
from rigid_envs.rendering.window import Window

if TYPE_CHECKING:
    from rigid_envs.episodes.runner import Runner

Array = np.ndarray

RENDER_MODES = ("rgb_array", "human")
FPS = 25
WINDOW = 960  # pixels, widest that a window of many worlds gets


class Pictures:
    """Draws worlds, off screen or in a window. pygame is needed from the first picture on.

    Args:
        runner: whose worlds.
        mode: None, "rgb_array" or "human".
        show_forces: draw contact forces.
        show_particles: draw what touches in place of exact shapes.
        worlds: how many to draw at most.
        size: width and height of a picture in pixels.
    """

    def __init__(
        self,
        runner: "Runner",
        mode: str | None,
        show_forces: bool = False,
        show_particles: bool = False,
        worlds: int = 1,
        size: int = 480,
    ) -> None:
        """Checks all arguments."""
        if mode is not None:
            choice("render_mode", mode, RENDER_MODES)
        self._runner, self._mode = runner, mode
        self._show_forces: bool = instance("show_forces", show_forces, bool)
        self._show_particles: bool = instance("show_particles", show_particles, bool)
        self._size = integer("render_size", size, low=16)
        self._count = min(integer("render_worlds", worlds, low=1), runner.count)
        self._renderer: Renderer | None = None
        self._window: Window | None = None
        self._warned = False

    def frames(self) -> tuple[Array, ...]:
        """Pictures [size, size, 3] uint8 of the first worlds."""
        if self._count < self._runner.count and not self._warned:
            self._warned = True
            gym.logger.warn(
                f"render() draws {self._count} of {self._runner.count} worlds; render_worlds=... "
                "draws more. RecordVideo wants a picture of every world"
            )
        return self._draw(self._size)

    def show(self) -> None:
        """Draws the first worlds in a window, as a grid."""
        columns = math.ceil(math.sqrt(self._count))
        size = min(self._size, WINDOW // columns)
        if self._window is None:
            rows = -(-self._count // columns)
            title = type(self._runner.task).__name__
            self._window = Window(columns * size, rows * size, FPS, title)
        if not self._window.closed:
            self._window.show(grid(self._draw(size), columns))

    def close(self) -> None:
        """Closes the window, if any."""
        if self._window is not None:
            self._window.close()
        self._window = self._renderer = None

    def _draw(self, size: int) -> tuple[Array, ...]:
        if self._renderer is None:
            self._renderer = Renderer(size, size, self._runner.task.camera)
        return tuple(self._frame(self._renderer, world) for world in range(self._count))

    def _frame(self, renderer: Renderer, world: int) -> Array:
        runner, particles = self._runner, self._show_particles
        arrows = scene_view.forces(runner, world, particles=particles) if self._show_forces else ()
        return renderer.frame(
            scene_view.items(runner, world, particles=particles),
            markers=scene_view.markers(runner, world),
            forces=arrows,
        )

"""A small software renderer: shaded solids, soft shadows and a ruled ground, drawn with pygame.

All is drawn at `SUPERSAMPLING` times the size of the picture and then reduced, which smooths the
edges. What there is to see, and from where, is in `rigid_envs.view`.
"""

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.error import DependencyNotInstalled

from physics.validation import choice, integer, positive
from rigid_envs.view import (
    ACROSS_LIGHT,
    CIRCLE,
    FACES,
    LIGHTS,
    SHADOW_SAMPLES,
    TO_LIGHT,
    Arrow,
    Camera,
    Color,
    Goal,
    Item,
    Solids,
    ground,
    shade,
)

__all__ = ["TO_LIGHT", "Arrow", "Camera", "Goal", "Item", "Renderer", "grid"]

Array = np.ndarray

RENDER_MODES = ("human", "rgb_array")
SUPERSAMPLING = 2
SHADOW_TINT = np.array([98.0, 92.0, 82.0])  # of 255, what full shadow takes; less blue, as the sky
GLOSS = 0.4  # strength of the highlight on round solids
CAPSULE_STRIPS = 32  # flat strips that make up the visible half of a tube


class Renderer:
    """Draws frames of solids on the ground.

    Mode "rgb_array" draws off screen and needs no display. Mode "human" opens a window with the
    first frame and holds the pace of `fps`; once its user closes it, `closed` is true and nothing
    more is drawn. A copy or pickle carries the settings and opens its own window.

    Args:
        mode: "rgb_array" or "human".
        width: pixels.
        height: pixels.
        camera: where to look from; by default a square of 30 cm about the origin fills the picture.
        fps: frames a second of the window.
        title: of the window.

    Raises:
        ValueError: an unknown mode, or a size or rate that is not positive.
        DependencyNotInstalled: pygame is missing.
    """

    def __init__(
        self,
        mode: str,
        width: int = 480,
        height: int = 480,
        camera: Camera | None = None,
        fps: float = 25.0,
        title: str = "",
    ) -> None:
        self.mode = choice("mode", mode, RENDER_MODES)
        self.width = integer("width", width, low=1)
        self.height = integer("height", height, low=1)
        self.camera = camera or Camera()
        self.fps = positive("fps", fps)
        self.title = title
        self.closed = False
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # no banner on import
        try:
            import pygame
        except ImportError as error:
            raise DependencyNotInstalled(
                'rendering needs pygame: pip install "rigid-envs[render]"'
            ) from error
        self._pygame = pygame
        self._window: Any = None
        self._clock: Any = None
        self._balls: dict[tuple[Color, bool], Any] = {}
        size = (SUPERSAMPLING * self.width, SUPERSAMPLING * self.height)
        surfaces = [pygame.Surface(size, depth=32) for _ in range(4)]
        self._background, self._canvas, self._shadow, self._layer = surfaces
        self._picture = pygame.Surface((self.width, self.height), depth=32)
        pygame.surfarray.blit_array(self._background, ground(self.camera, *size))

    def __reduce__(self) -> tuple[Any, ...]:
        """Settings only: surfaces and windows can't be copied."""
        settings = (self.mode, self.width, self.height, self.camera, self.fps, self.title)
        return Renderer, settings

    def frame(
        self,
        items: Sequence[Item],
        *,
        goals: Sequence[Goal] = (),
        forces: Sequence[Arrow] = (),
        caption: str = "",
    ) -> Array | None:
        """Draw one frame.

        Args:
            items: the solids.
            goals: the targets.
            forces: arrows, drawn over everything else.
            caption: text for the top left corner.

        Returns:
            A new array (height, width, 3) uint8 in mode "rgb_array", None in mode "human".
        """
        if self.closed:
            return None
        balls = [goal for goal in goals if goal.position[2] > 0.0]
        colors = [item.color for item in items] + [ball.color for ball in balls]
        solids = Solids(items, balls)
        self._canvas.blit(self._background, (0, 0))
        for goal in goals:
            self._draw_disc(goal)
        self._draw_shadows(solids.outline(ACROSS_LIGHT)[: len(items)])
        for i in solids.paint_order(self.camera.eye):
            self._draw_solid(solids, i, colors[i], glass=i >= len(items))
        for arrow in forces:
            self._draw_arrow(arrow)
        self._pygame.transform.smoothscale(self._canvas, self._picture.get_size(), self._picture)
        self._draw_caption(caption)
        if self.mode == "human":
            self._show()
            return None
        return self._read()

    def close(self) -> None:
        """Close the window, if there is one; a closed window is not opened again."""
        if self._window is not None:
            self._pygame.display.quit()
        self._window, self.closed = None, self.mode == "human"

    def _read(self) -> Array:
        pixels = np.empty((self.height, self.width, 3), np.uint8)
        memory: Any = pixels  # pygame takes any buffer, its type hints only some
        frame = self._pygame.image.frombuffer(memory, (self.width, self.height), "RGB")
        frame.blit(self._picture, (0, 0))
        return pixels

    def _show(self) -> None:
        if self._window is None:
            self._pygame.display.init()
            self._window = self._pygame.display.set_mode((self.width, self.height))
            self._pygame.display.set_caption(self.title)
            self._clock = self._pygame.time.Clock()
        self._window.blit(self._picture, (0, 0))
        self._pygame.display.flip()
        if any(event.type == self._pygame.QUIT for event in self._pygame.event.get()):
            self.close()
        else:
            self._clock.tick(self.fps)

    def _project(self, points: Array) -> tuple[Array, Array]:
        return self.camera.project(points, *self._canvas.get_size())

    def _polygon(self, surface: Any, color: Any, pixels: Array, width: int = 0) -> None:
        points = np.rint(pixels).astype(int).tolist()
        self._pygame.draw.polygon(surface, tuple(map(int, color)), points, width)

    def _draw_disc(self, goal: Goal) -> None:
        foot = np.array([*goal.position[:2], 0.0])
        pixels, depth = self._project(foot + goal.radius * np.pad(CIRCLE, ((0, 0), (0, 1))))
        if depth.min() < self.camera.near:
            return
        low = np.floor(pixels.min(axis=0)) - SUPERSAMPLING
        size = np.ceil(pixels.max(axis=0)) + SUPERSAMPLING + 1 - low
        glass = self._pygame.Surface(size.astype(int).tolist(), self._pygame.SRCALPHA)
        self._polygon(glass, (*goal.color, 80), pixels - low)
        self._polygon(glass, (*goal.color, 210), pixels - low, SUPERSAMPLING)
        self._canvas.blit(glass, low.astype(int).tolist())
        if goal.position[2] > goal.radius:  # a stem shows over which spot the ball hangs
            foot_pixel, ball_pixel = self._project(np.array([foot, goal.position]))[0].tolist()
            self._pygame.draw.line(self._canvas, goal.color, foot_pixel, ball_pixel, SUPERSAMPLING)

    def _draw_shadows(self, outlines: Array) -> None:
        """Darken the ground where solids hide the light; outlines [n, k, 3] m face the light.

        Each point of the light removes its share from the union of the shadows that it casts.
        """
        lights = LIGHTS[:, None, None]
        cast = outlines - np.maximum(outlines[..., 2:], 0.0) * lights / lights[..., 2:]
        cast[..., 2] = 0.0
        pixels, depth = self._project(cast)
        pixels = np.rint(pixels[:, (depth > self.camera.near).all(axis=(0, 2))]).astype(int)
        if not pixels.size:
            return
        low, high = pixels.min((0, 1, 2)), pixels.max((0, 1, 2))
        area = self._pygame.Rect(low.tolist(), (high - low + 1).tolist())
        area = area.clip(self._canvas.get_rect())
        tint = np.rint(SHADOW_TINT / SHADOW_SAMPLES).astype(int).tolist()
        self._shadow.fill((255, 255, 255), area)
        for shadows in pixels.tolist():
            self._layer.fill((0, 0, 0), area)
            for shadow in shadows:
                self._pygame.draw.polygon(self._layer, tint, shadow)
            self._shadow.blit(self._layer, area, area, self._pygame.BLEND_RGB_SUB)
        self._canvas.blit(self._shadow, area, area, self._pygame.BLEND_RGB_MULT)

    def _draw_solid(self, solids: Solids, i: int, color: Color, *, glass: bool) -> None:
        pixels, depth = self._project(solids.corners[i])
        if depth.min() - solids.radius[i] < self.camera.near:
            return
        if not solids.radius[i]:
            self._draw_box(solids, i, pixels, color)
        elif solids.half[i].any():
            self._draw_capsule(solids, i, color)
        else:
            self._draw_ball(solids.centre[i], solids.radius[i], color, glass=glass)

    def _draw_box(self, solids: Solids, i: int, pixels: Array, color: Color) -> None:
        eye = (self.camera.eye - solids.centre[i]) @ solids.axes[i]  # m, as the box sees it
        for axis, side, corners in FACES:
            if side * eye[axis] > solids.half[i, axis]:
                normal = side * solids.axes[i, :, axis]
                paint = shade(color, normal, -self.camera.axes[2], 0.0)
                self._polygon(self._canvas, paint, pixels[corners])
                self._polygon(self._canvas, 0.72 * paint, pixels[corners], SUPERSAMPLING)

    def _draw_ball(self, centre: Array, radius: float, color: Color, *, glass: bool) -> None:
        pixel, depth = self._project(centre)
        focal = self.camera.focal_length(self._canvas.get_height())
        diameter = max(round(2.0 * focal * radius / float(np.sqrt(depth**2 - radius**2))), 2)
        ball = self._pygame.transform.smoothscale(self._ball(color, glass), (diameter,) * 2)
        self._canvas.blit(ball, np.rint(pixel - 0.5 * diameter).astype(int).tolist())

    def _ball(self, color: Color, glass: bool, size: int = 128) -> Any:
        """Picture of a ball, to be scaled: shaded, or see-through with a stronger rim."""
        if (color, glass) not in self._balls:
            y, x = -(np.mgrid[:size, :size] + 0.5 - 0.5 * size) / (0.5 * size)
            off = np.hypot(x, y)
            normals = np.stack([-x, y, np.sqrt(np.maximum(1.0 - off**2, 0.0))], axis=-1)
            normals /= np.maximum(off, 1.0)[..., None]
            to_eye = -self.camera.axes[2]
            world = normals @ np.stack([*self.camera.axes[:2], to_eye])
            alpha = 0.30 + 0.55 * (1.0 - normals[..., 2:]) ** 2 if glass else 1.0
            alpha = alpha * np.clip(0.5 * size * (1.0 - off[..., None]) + 0.5, 0.0, 1.0)
            pixels = np.concatenate([shade(color, world, to_eye, GLOSS), 255.0 * alpha], axis=-1)
            self._balls[color, glass] = self._pygame.image.frombuffer(
                pixels.astype(np.uint8).tobytes(), (size, size), "RGBA"
            )
        return self._balls[color, glass]

    def _draw_capsule(self, solids: Solids, i: int, color: Color) -> None:
        """Draw the end balls, then strips of the tube, which hide just the balls' inner halves."""
        ends, axis, radius = solids.corners[i, :2], solids.axes[i, :, 2], solids.radius[i]
        for end in ends:
            self._draw_ball(end, radius, color, glass=False)
        side = np.cross(axis, self.camera.eye - solids.centre[i])
        side /= max(float(np.linalg.norm(side)), 1e-9)
        turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2 * CAPSULE_STRIPS + 1)[:, None]
        normals = np.sin(turn) * side + np.cos(turn) * np.cross(side, axis)
        pixels, _ = self._project(ends[:, None] + radius * normals[::2])
        paints = shade(color, normals[1::2], -self.camera.axes[2], GLOSS)
        for k, paint in enumerate(paints):
            self._polygon(self._canvas, paint, pixels[[0, 0, 1, 1], [k, k + 1, k + 1, k]])

    def _draw_arrow(self, arrow: Arrow) -> None:
        (tail, tip), depth = self._project(
            np.array([arrow.origin, np.add(arrow.origin, arrow.vector)])
        )
        length = np.linalg.norm(tip - tail)
        if length < 1.0 or depth.min() < self.camera.near:
            return
        along = (tip - tail) / length
        across = SUPERSAMPLING * np.array([-along[1], along[0]])
        neck = tip - min(8.0 * SUPERSAMPLING, 0.6 * length) * along
        left = [tail + across, neck + across, neck + 4.0 * across]
        right = [neck - 4.0 * across, neck - across, tail - across]
        self._polygon(self._canvas, arrow.color, np.array([*left, tip, *right]))

    def _draw_caption(self, caption: str) -> None:
        font = self._pygame.font
        if caption and font:  # pygame without SDL_ttf has no fonts
            font.init()
            face = font.Font(None, max(self.height // 22, 14))
            self._picture.blit(face.render(caption, True, (52, 58, 66)), (10, 10))


def grid(frames: Sequence[Array], columns: int | None = None) -> Array:
    """Tile frames row by row, such as those of a vector environment's worlds.

    Args:
        frames: one or more pictures (height, width, 3) uint8 of one size.
        columns: frames a row; by default the grid is as square as can be.

    Returns:
        (rows * height, columns * width, 3) uint8; places left over are white.

    Raises:
        ValueError: no frames, frames of different shapes, or less than one column.
    """
    shapes = {np.shape(frame) for frame in frames}
    if len(shapes) != 1 or len(min(shapes)) != 3:
        raise ValueError(f"frames must have one shape (height, width, 3), got {sorted(shapes)}")
    if columns is None:
        columns = int(np.ceil(np.sqrt(len(frames))))
    columns = integer("columns", columns, low=1)
    rows = -(-len(frames) // columns)
    height, width, channels = np.shape(frames[0])
    tiles = np.full((rows * columns, height, width, channels), 255, np.uint8)
    tiles[: len(frames)] = frames
    tiles = tiles.reshape(rows, columns, height, width, channels).swapaxes(1, 2)
    return tiles.reshape(rows * height, columns * width, channels)

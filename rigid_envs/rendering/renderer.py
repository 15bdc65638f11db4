"""A small software renderer: shaded solids, soft shadows and a ruled ground, drawn with pygame.

All is drawn at `SUPERSAMPLING` times the size of the picture and then reduced, which smooths the
edges. What there is to see is in `view`, how a solid is drawn in `painter`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from physics.scene.validation import integer
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.painter import GHOST_FILL, Painter, whole
from rigid_envs.rendering.solids import ACROSS_LIGHT, CIRCLE, LIGHTS, SHADOW_SAMPLES, Solids
from rigid_envs.rendering.view import (
    TO_LIGHT,
    Arrow,
    Ghost,
    Goal,
    Item,
    Mark,
    Marker,
    Particles,
    ground,
)
from rigid_envs.rendering.window import INK, load_pygame

__all__ = [
    "TO_LIGHT",
    "Arrow",
    "Camera",
    "Ghost",
    "Goal",
    "Item",
    "Mark",
    "Particles",
    "Renderer",
    "grid",
]

Array = np.ndarray

SUPERSAMPLING = 2
SHADOW_TINT = np.array([98.0, 92.0, 82.0])  # of 255, what full shadow takes; less blue, as the sky
SCALE = "squares: 10 cm"  # written in the corner, as lines alone don't tell how far apart they are
DISC_FILL, DISC_EDGE = 80, 210  # opacity of 255


class Renderer:
    """Draws frames of solids on the ground, off screen: it needs no display.

    A copy or pickle carries the settings.

    Args:
        width: pixels.
        height: pixels.
        camera: where to look from; by default a square of 30 cm about the origin fills the picture.

    Raises:
        ValueError: a size that is not positive.
        DependencyNotInstalled: pygame is missing.
    """

    def __init__(self, width: int = 480, height: int = 480, camera: Camera | None = None) -> None:
        self.width = integer("width", width, low=1)
        self.height = integer("height", height, low=1)
        self.camera = camera or Camera()
        self._pygame = pygame = load_pygame()
        size = (SUPERSAMPLING * self.width, SUPERSAMPLING * self.height)
        self._background, self._canvas = (pygame.Surface(size, depth=32) for _ in range(2))
        size_of_picture = (self.width, self.height)
        surfaces = [pygame.Surface(size_of_picture, depth=32) for _ in range(3)]
        self._picture, self._shadow, self._layer = surfaces
        self._painter = Painter(pygame, self._canvas, self.camera, SUPERSAMPLING)
        pygame.surfarray.blit_array(self._background, ground(self.camera, *size))
        self._scale = self._words(SCALE, max(self.height // 30, 12))

    def __reduce__(self) -> tuple[Any, ...]:
        """Settings only: surfaces can't be copied."""
        return Renderer, (self.width, self.height, self.camera)

    def frame(
        self,
        items: Sequence[Item],
        *,
        markers: Sequence[Marker] = (),
        forces: Sequence[Arrow] = (),
        caption: str = "",
    ) -> Array:
        """Draw one frame.

        Args:
            items: the solids.
            markers: targets and marks.
            forces: arrows, drawn over everything else.
            caption: text for the top left corner.

        Returns:
            A new array (height, width, 3) uint8.
        """
        goals = [marker for marker in markers if isinstance(marker, Goal)]
        balls = [goal for goal in goals if goal.position[2] > 0.0]
        ghosts = self._painter.ghosts([marker for marker in markers if isinstance(marker, Ghost)])
        colors = [item.color for item in items] + [ball.color for ball in balls]
        solids = Solids(items, balls)
        self._canvas.blit(self._background, (0, 0))
        for goal in goals:
            self._draw_disc(goal)
        for marker in markers:
            if isinstance(marker, Mark):
                self._draw_mark(marker)
        self._draw_shadows(*solids.outlines(ACROSS_LIGHT, len(items)))
        for color, faces in ghosts:
            self._painter.glass(color, faces, GHOST_FILL)
        self._painter.draw_solids(solids, colors, [item.particles for item in items])
        for color, faces in ghosts:
            for face in faces:
                self._painter.polygon(color, face, SUPERSAMPLING)
        self._draw_arrows(forces)
        self._pygame.transform.smoothscale(self._canvas, self._picture.get_size(), self._picture)
        self._write(self._words(caption, max(self.height // 22, 14)), top=True)
        self._write(self._scale, top=False)
        return self._read()

    def _read(self) -> Array:
        pixels = np.empty((self.height, self.width, 3), np.uint8)
        memory: Any = pixels  # pygame takes any buffer, its type hints only some
        frame = self._pygame.image.frombuffer(memory, (self.width, self.height), "RGB")
        frame.blit(self._picture, (0, 0))
        return pixels

    def _draw_disc(self, goal: Goal) -> None:
        foot = np.array([*goal.position[:2], 0.0])
        around = foot + goal.radius * np.pad(CIRCLE, ((0, 0), (0, 1)))
        pixels, depth = self._painter.project(around)
        if depth.min() < self.camera.near:
            return
        self._painter.glass(goal.color, [whole(pixels)], DISC_FILL, DISC_EDGE)
        if goal.position[2] > goal.radius:  # a stem shows over which spot the ball hangs
            ends = self._painter.project(np.array([foot, goal.position]))[0].tolist()
            self._pygame.draw.line(self._canvas, goal.color, *ends, SUPERSAMPLING)

    def _draw_mark(self, mark: Mark) -> None:
        foot = np.array([*mark.position[:2], 0.0])
        for along in (np.array([1.0, 1.0, 0.0]), np.array([1.0, -1.0, 0.0])):
            along *= np.sqrt(0.5) * mark.radius
            across = 0.25 * np.array([-along[1], along[0], 0.0])
            arm = [along + across, along - across, -along - across, -along + across]
            pixels, depth = self._painter.project(foot + np.array(arm))
            if depth.min() > self.camera.near:
                self._painter.polygon(mark.color, whole(pixels))

    def _draw_shadows(self, outlines: Array, ends: list[int]) -> None:
        """Darken the ground where solids hide the light; outlines [m, 3] m face the light.

        Each point of the light removes its share from the union of the shadows that it casts. They
        are soft, so the size of the picture is fine enough.
        """
        lights = LIGHTS[:, None]
        cast = outlines - np.maximum(outlines[:, 2:], 0.0) * lights / lights[..., 2:]
        cast[..., 2] = 0.0
        pixels, depth = self._painter.project(cast)
        pixels = np.rint(pixels / SUPERSAMPLING).astype(int)
        starts = [0, *ends][:-1]
        shown = [
            slice(start, end)
            for start, end in zip(starts, ends, strict=True)
            if depth[:, start:end].min() > self.camera.near
        ]
        if not shown:
            return
        reach = np.concatenate([pixels[:, part] for part in shown], axis=1)
        low, high = reach.min((0, 1)), reach.max((0, 1))
        # one pixel more all around, for the way back to the canvas mixes neighbours
        area = self._pygame.Rect((low - 1).tolist(), (high - low + 3).tolist())
        area = area.clip(self._shadow.get_rect())
        if not area:
            return
        tint = np.rint(SHADOW_TINT / SHADOW_SAMPLES).astype(int).tolist()
        self._shadow.fill((255, 255, 255), area)
        for points in pixels.tolist():
            self._layer.fill((0, 0, 0), area)
            for part in shown:
                self._pygame.draw.polygon(self._layer, tint, points[part])
            self._shadow.blit(self._layer, area, area, self._pygame.BLEND_RGB_SUB)
        size = (SUPERSAMPLING * area.width, SUPERSAMPLING * area.height)
        fine = self._pygame.transform.smoothscale(self._shadow.subsurface(area), size)
        place = (SUPERSAMPLING * area.left, SUPERSAMPLING * area.top)
        self._canvas.blit(fine, place, special_flags=self._pygame.BLEND_RGB_MULT)

    def _draw_arrows(self, arrows: Sequence[Arrow]) -> None:
        if not arrows:
            return
        origins = np.stack([arrow.origin for arrow in arrows])
        ends = np.stack([origins, origins + np.stack([arrow.vector for arrow in arrows])], axis=1)
        pixels, depth = self._painter.project(ends)
        for arrow, (tail, tip), nearest in zip(arrows, pixels, depth.min(axis=1), strict=True):
            length = float(np.hypot(*(tip - tail)))
            if length < 1.0 or nearest < self.camera.near:
                continue
            along = (tip - tail) / length
            across = SUPERSAMPLING * np.array([-along[1], along[0]])
            neck = tip - min(8.0 * SUPERSAMPLING, 0.6 * length) * along
            left = [tail + across, neck + across, neck + 4.0 * across]
            right = [neck - 4.0 * across, neck - across, tail - across]
            self._painter.polygon(arrow.color, whole(np.array([*left, tip, *right])))

    def _words(self, text: str, size: int) -> Any:
        font = self._pygame.font
        if not text or not font:  # pygame without SDL_ttf has no fonts
            return None
        font.init()
        return font.Font(None, size).render(text, True, INK)

    def _write(self, words: Any, *, top: bool) -> None:
        if words is not None:
            self._picture.blit(words, (10, 10 if top else self.height - 8 - words.get_height()))


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

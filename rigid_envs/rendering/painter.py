"""Painter: solids as polygons and pictures of balls, on a canvas that a camera looks at."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.solids import FACES, Solids, box_corners
from rigid_envs.rendering.view import Color, Ghost, Particles, shade

Array = np.ndarray
Points = list[list[int]]  # [n, 2] pixels

GLOSS = 0.4  # strength of the highlight on round solids
CAPSULE_STRIPS = 32  # flat strips that make up the visible half of a tube
CYLINDER_STRIPS = 64  # those of a whole one
BALL_SIZE = 128  # pixels of the picture that all balls of a colour are scaled from
GHOST_FILL, FAINT_FILL, FAINT_EDGE = 70, 60, 110  # opacity of 255
EDGE = 0.72  # brightness of a box's edges, as a share of its faces'
LEAST_PARTICLE = 2.0  # pixels of a finished picture, radius; smaller ones would not be seen


class Painter:
    """Draws on a canvas.

    Args:
        pygame: the module.
        canvas: the surface to draw on, `fineness` times the size of the finished picture.
        camera: that looks.
        fineness: see canvas.
    """

    def __init__(self, pygame: Any, canvas: Any, camera: Camera, fineness: int) -> None:
        self._pygame, self._canvas, self._camera = pygame, canvas, camera
        self._fineness = fineness
        self._focal = camera.focal_length(canvas.get_height())
        self._scaled_ball = lru_cache(maxsize=512)(self._scale_ball)
        self._balls: dict[tuple[Color, bool], Any] = {}

    def project(self, points: Array) -> tuple[Array, Array]:
        """Pixels and depths of points, see `Camera.project`."""
        return self._camera.project(points, *self._canvas.get_size())

    def polygon(self, color: Any, points: Points, width: int = 0) -> None:
        """A filled polygon, or its outline."""
        self._pygame.draw.polygon(self._canvas, color, points, width)

    def glass(self, color: Color, parts: Sequence[Points], fill: int, edge: int = 0) -> None:
        """Translucent polygons with stronger edges, of one colour and opacities up to 255.

        Where they overlap they do not add up.
        """
        columns, rows = zip(*(point for part in parts for point in part), strict=True)
        margin = self._fineness
        left, top = max(min(columns) - margin, 0), max(min(rows) - margin, 0)
        width = min(max(columns) + margin + 1, self._canvas.get_width()) - left
        height = min(max(rows) + margin + 1, self._canvas.get_height()) - top
        if width <= 0 or height <= 0:
            return
        layer = self._pygame.Surface((width, height), self._pygame.SRCALPHA)
        moved = [[(x - left, y - top) for x, y in part] for part in parts]
        for part in moved:
            self._pygame.draw.polygon(layer, (*color, fill), part)
        for part in moved if edge else ():
            self._pygame.draw.polygon(layer, (*color, edge), part, self._fineness)
        self._canvas.blit(layer, (left, top))

    def draw_solids(
        self, solids: Solids, colors: Sequence[Color], particles: Sequence[Particles | None]
    ) -> None:
        """Every solid, the farther ones first; those beyond the particles are balls of goals."""
        pixels, depth = self.project(solids.corners)
        nearest = depth.min(axis=1, initial=np.inf) - solids.radius
        corners, seen = whole(pixels), self._seen(solids.centre, solids.axes, solids.half)
        paints = self._paints(solids, colors)
        edges = (EDGE * paints).astype(int).tolist()
        faces = paints.astype(int).tolist()
        for i in solids.paint_order(self._camera.eye):
            if nearest[i] < self._camera.near:
                continue
            balls = particles[i] if i < len(particles) else None
            if solids.cylinder[i]:
                if balls is None:
                    self._draw_cylinder(solids, i, colors[i])
            elif solids.radius[i] == 0.0:
                parts = {face: [corners[i][k] for k in FACES[face][2]] for face in seen[i]}
                if balls is not None:
                    self.glass(colors[i], list(parts.values()), FAINT_FILL, FAINT_EDGE)
                else:
                    for face, part in parts.items():
                        self.polygon(faces[i][face], part)
                        self.polygon(edges[i][face], part, self._fineness)
            if balls is not None:
                self._draw_particles(solids, i, colors[i], balls)
            elif solids.radius[i] and solids.half[i].any():
                self._draw_capsule(solids, i, colors[i])
            elif solids.radius[i]:
                glass = i >= len(particles)
                self._draw_ball(solids.centre[i], solids.radius[i], colors[i], glass=glass)

    def ghosts(self, ghosts: Sequence[Ghost]) -> list[tuple[Color, list[Points]]]:
        """Colour and visible faces of every ghost, those of the farther ones first."""
        if not ghosts:
            return []
        centre = np.stack([ghost.position for ghost in ghosts])
        half = np.stack([ghost.half_extents for ghost in ghosts])
        axes = np.broadcast_to(np.eye(3), (len(ghosts), 3, 3))
        pixels, depth = self.project(box_corners(centre, axes, half))
        corners, seen = whole(pixels), self._seen(centre, axes, half)
        order = np.argsort(-np.linalg.norm(centre - self._camera.eye, axis=1)).tolist()
        return [
            (ghosts[i].color, [[corners[i][k] for k in FACES[face][2]] for face in seen[i]])
            for i in order
            if depth[i].min() > self._camera.near and seen[i]
        ]

    def _seen(self, centre: Array, axes: Array, half: Array) -> list[list[int]]:
        """Which of the `FACES` of every box the camera sees."""
        eye = np.einsum("ni,nij->nj", self._camera.eye - centre, axes)  # m, as the box sees it
        beyond = [side * eye[:, axis] > half[:, axis] for axis, side, _ in FACES]
        return [np.flatnonzero(row).tolist() for row in np.stack(beyond, axis=1)]

    def _paints(self, solids: Solids, colors: Sequence[Color]) -> Array:
        """Colours [n, 6, 3] of the `FACES` of every solid."""
        turn = solids.axes.swapaxes(1, 2)
        normals = np.stack([side * turn[:, axis] for axis, side, _ in FACES], axis=1)
        own = np.array(colors, dtype=float).reshape(-1, 1, 3)
        return shade(own, normals, -self._camera.axes[2], 0.0)

    def _draw_particles(self, solids: Solids, i: int, color: Color, particles: Particles) -> None:
        """All balls from far to near; they have one size, so that no other order is needed."""
        centres = solids.centre[i] + particles.positions @ solids.axes[i].T
        pixels, depth = self.project(centres)
        radii = self._focal * particles.radius / depth
        radii = np.maximum(radii, LEAST_PARTICLE * self._fineness)
        diameters = np.rint(2.0 * radii).astype(int).tolist()
        corners = np.rint(pixels - radii[:, None]).astype(int).tolist()
        for k in np.argsort(-depth).tolist():
            self._canvas.blit(self._scaled_ball(color, False, diameters[k]), corners[k])

    def _draw_ball(self, centre: Array, radius: float, color: Color, *, glass: bool) -> None:
        pixel, depth = self.project(centre)
        distance = math.sqrt(max(float(depth) ** 2 - radius**2, 1e-9))
        diameter = max(round(2.0 * self._focal * radius / distance), 2)
        ball = self._scaled_ball(color, glass, diameter)
        self._canvas.blit(ball, np.rint(pixel - 0.5 * diameter).astype(int).tolist())

    def _scale_ball(self, color: Color, glass: bool, diameter: int) -> Any:
        return self._pygame.transform.smoothscale(self._ball(color, glass), (diameter,) * 2)

    def _ball(self, color: Color, glass: bool) -> Any:
        """Picture of a ball, to be scaled: shaded, or see-through with a stronger rim."""
        if (color, glass) not in self._balls:
            size = BALL_SIZE
            y, x = -(np.mgrid[:size, :size] + 0.5 - 0.5 * size) / (0.5 * size)
            off = np.hypot(x, y)
            normals = np.stack([-x, y, np.sqrt(np.maximum(1.0 - off**2, 0.0))], axis=-1)
            normals /= np.maximum(off, 1.0)[..., None]
            to_eye = -self._camera.axes[2]
            world = normals @ np.stack([*self._camera.axes[:2], to_eye])
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
        side = np.cross(axis, self._camera.eye - solids.centre[i])
        side /= max(float(np.linalg.norm(side)), 1e-9)
        turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2 * CAPSULE_STRIPS + 1)[:, None]
        normals = np.sin(turn) * side + np.cos(turn) * np.cross(side, axis)
        pixels, _ = self.project(ends[:, None] + radius * normals[::2])
        paints = shade(color, normals[1::2], -self._camera.axes[2], GLOSS)
        points, colors = whole(pixels), paints.astype(int).tolist()
        near, far = points
        for k, paint in enumerate(colors):
            self.polygon(paint, [near[k], near[k + 1], far[k + 1], far[k]])

    def _draw_cylinder(self, solids: Solids, i: int, color: Color) -> None:
        """Draw the strips and the end that face the camera, of which no two overlap."""
        axes, half, to_eye = solids.axes[i], solids.half[i], -self._camera.axes[2]
        eye = (self._camera.eye - solids.centre[i]) @ axes
        turn = np.linspace(0.0, 2.0 * np.pi, 2 * CYLINDER_STRIPS + 1)
        normals = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
        rims = np.array([half * (1.0, 1.0, side) for side in (-1.0, 1.0)])[:, None]
        circles = normals[::2] * half[0] + rims * (0.0, 0.0, 1.0)
        pixels, _ = self.project(solids.centre[i] + circles @ axes.T)
        low, high = whole(pixels)
        paints = shade(color, normals[1::2] @ axes.T, to_eye, GLOSS).astype(int).tolist()
        for k in np.flatnonzero(normals[1::2] @ eye > half[0]).tolist():
            self.polygon(paints[k], [low[k], low[k + 1], high[k + 1], high[k]])
        if abs(eye[2]) > half[2]:
            side = math.copysign(1.0, float(eye[2]))
            paint = shade(color, side * axes[:, 2], to_eye, 0.0)
            end = (high if side > 0.0 else low)[:-1]
            self.polygon(paint.astype(int).tolist(), end)
            self.polygon((EDGE * paint).astype(int).tolist(), end, self._fineness)


def whole(pixels: Array) -> Any:
    """Pixels as nested lists of integers, as pygame takes them."""
    return np.rint(pixels).astype(int).tolist()

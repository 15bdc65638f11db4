"""Painter: solids as polygons and pictures of balls, on a canvas that a camera looks at."""

from functools import lru_cache
from typing import Any

import numpy as np

from rigid_envs.camera import Camera
from rigid_envs.solids import FACES, Solids, box_corners
from rigid_envs.view import Color, Ghost, Particles, shade

Array = np.ndarray
Face = tuple[int, int, list[int]]  # axis, side and corners, see FACES

GLOSS = 0.4  # strength of the highlight on round solids
CAPSULE_STRIPS = 32  # flat strips that make up the visible half of a tube
BALL_SIZE = 128  # pixels of the picture that all balls of a colour are scaled from
GHOST_FILL, GHOST_EDGE, FAINT_FILL, FAINT_EDGE = 70, 200, 60, 110  # opacity of 255
LEAST_PARTICLE = 2.0  # pixels of a finished picture, radius; smaller ones would not be seen


class Painter:
    """Draws one solid after the other.

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

    def polygon(self, color: Any, pixels: Array, width: int = 0) -> None:
        """A filled polygon, or its outline."""
        points = np.rint(pixels).astype(int).tolist()
        self._pygame.draw.polygon(self._canvas, tuple(map(int, color)), points, width)

    def glass(self, color: Color, parts: list[Array], fill: int, edge: int) -> None:
        """Translucent polygons of one colour with stronger edges; each an array [n, 2] of pixels.

        Parts add up where they overlap only in their edges.
        """
        low = np.floor(np.min([p.min(axis=0) for p in parts], axis=0)) - self._fineness
        high = np.ceil(np.max([p.max(axis=0) for p in parts], axis=0)) + self._fineness + 1
        low = np.maximum(low, 0.0)
        size = (np.minimum(high, self._canvas.get_size()) - low).astype(int)
        if (size <= 0).any():
            return
        layer = self._pygame.Surface(size.tolist(), self._pygame.SRCALPHA)
        rounded = [np.rint(p - low).astype(int).tolist() for p in parts]
        if fill:
            for points in rounded:
                self._pygame.draw.polygon(layer, (*color, fill), points)
        if edge:
            for points in rounded:
                self._pygame.draw.polygon(layer, (*color, edge), points, self._fineness)
        self._canvas.blit(layer, low.astype(int).tolist())

    def solid(
        self, solids: Solids, i: int, color: Color, particles: Particles | None, *, glass: bool
    ) -> None:
        """Solid i; as glass if it is the ball of a goal."""
        pixels, depth = self.project(solids.corners[i])
        if depth.min() - solids.radius[i] < self._camera.near:
            return
        if particles is not None:
            if not solids.radius[i]:
                faces = [pixels[corners] for _, _, corners in self._faces(solids, i)]
                self.glass(color, faces, FAINT_FILL, FAINT_EDGE)
            self._draw_particles(solids, i, color, particles)
        elif not solids.radius[i]:
            self._draw_box(solids, i, pixels, color)
        elif solids.half[i].any():
            self._draw_capsule(solids, i, color)
        else:
            self._draw_ball(solids.centre[i], solids.radius[i], color, glass=glass)

    def ghost(self, ghost: Ghost, *, edges: bool) -> None:
        """The faces or the edges of a place for a box."""
        corners = box_corners(ghost.position, np.eye(3), ghost.half_extents)
        pixels, depth = self.project(corners)
        if depth.min() < self._camera.near:
            return
        faces = _seen(self._camera.eye - ghost.position, ghost.half_extents)
        seen = [pixels[at] for _, _, at in faces]
        if edges:
            self.glass(ghost.color, seen, 0, GHOST_EDGE)
        else:
            self.glass(ghost.color, seen, GHOST_FILL, 0)

    def _faces(self, solids: Solids, i: int) -> list[Face]:
        return _seen((self._camera.eye - solids.centre[i]) @ solids.axes[i], solids.half[i])

    def _draw_box(self, solids: Solids, i: int, pixels: Array, color: Color) -> None:
        for axis, side, corners in self._faces(solids, i):
            normal = side * solids.axes[i, :, axis]
            paint = shade(color, normal, -self._camera.axes[2], 0.0)
            self.polygon(paint, pixels[corners])
            self.polygon(0.72 * paint, pixels[corners], self._fineness)

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
        distance = float(np.sqrt(max(depth**2 - radius**2, 1e-9)))
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
        for k, paint in enumerate(paints):
            self.polygon(paint, pixels[[0, 0, 1, 1], [k, k + 1, k + 1, k]])


def _seen(eye: Array, half: Array) -> list[Face]:
    """The faces of a box that are seen from `eye` [3] m in its frame."""
    return [face for face in FACES if face[1] * eye[face[0]] > half[face[0]]]

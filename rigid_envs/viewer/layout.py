"""Where the worlds stand side by side, and the camera that sees all of them."""

import math
from dataclasses import dataclass

import numpy as np

from rigid_envs.rendering.camera import Camera

Array = np.ndarray

CELL = 0.1  # m, between the lines of a floor; floors start and end at a line
GAP = 0.1  # m, between floors
HEIGHT = 0.3  # m above the floor that the camera shows
LOWEST = 36.0  # degrees, least elevation: lower ones hide worlds behind others


@dataclass(frozen=True)
class Layout:
    """`count` worlds in rows.

    Args:
        count: number of worlds.
        camera: the camera of the task: a floor is as large as what it sees.
    """

    count: int
    camera: Camera

    @property
    def half_width(self) -> float:
        """Half the width of a floor in m, a multiple of `CELL`."""
        seen = self.camera.distance * math.tan(math.radians(0.5 * self.camera.field_of_view))
        return CELL * max(1, round(seen / CELL))

    @property
    def centre(self) -> Array:
        """[2] m, middle of a floor in its world, on crossing lines."""
        return CELL * np.round(np.array(self.camera.target[:2]) / CELL)

    @property
    def offsets(self) -> Array:
        """[count, 3] m, where the origin of each world is; the worlds' middle is the origin."""
        columns = math.ceil(math.sqrt(self.count))
        rows = math.ceil(self.count / columns)
        row, column = np.divmod(np.arange(self.count), columns)
        spacing = 2.0 * self.half_width + GAP
        # the first row is the furthest from the camera, as lines of text
        right, away = self._directions
        along = (column - 0.5 * (columns - 1))[:, None] * right
        across = (0.5 * (rows - 1) - row)[:, None] * away
        flat = spacing * (along + across) - self.centre
        return np.concatenate([flat, np.zeros((self.count, 1))], axis=1)

    @property
    def _directions(self) -> tuple[Array, Array]:
        """The axes [2] of the ground that are nearest to the picture's right and forward."""
        turn = math.radians(90.0 * round((self.camera.azimuth + 90.0) / 90.0))
        cos, sin = round(math.cos(turn)), round(math.sin(turn))
        return np.array([cos, sin]), np.array([-sin, cos])

    def view(self, aspect: float) -> Camera:
        """The task's camera, as far away as it must be to see all floors.

        Args:
            aspect: width over height of the picture.
        """
        tasks = self.camera
        reach = self.half_width + 0.5 * GAP
        signs = np.array([[x, y] for x in (-1, 1) for y in (-1, 1)])
        flat = (self.offsets[:, None, :2] + self.centre + reach * signs).reshape(-1, 2)
        heights = np.repeat([0.0, HEIGHT], len(flat))[:, None]
        corners = np.concatenate([np.tile(flat, (2, 1)), heights], axis=1)
        target = (0.0, 0.0, 0.25 * HEIGHT)
        elevation = max(tasks.elevation, LOWEST)
        local = (corners - target) @ Camera.around(target, 1.0, tasks.azimuth, elevation).axes.T
        slope = math.tan(math.radians(0.5 * tasks.field_of_view))
        needed = np.abs(local[:, :2]) / (slope * np.array([aspect, 1.0])) - local[:, 2:]
        distance, field = float(needed.max()), tasks.field_of_view
        return Camera.around(target, distance, tasks.azimuth, elevation, field)

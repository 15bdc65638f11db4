"""Camera: where to look from, and where a point of the world appears in a picture.

World frame: metres, z up, ground at z = 0.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from physics.scene.validation import number, positive, vector

Array = np.ndarray

NEAR = 0.1  # least depth that is drawn, as a share of the camera's distance
_DOWN = np.array([1.0, -1.0])  # rows of a picture count downwards


@dataclass(frozen=True)
class Camera:
    """A perspective camera.

    Attributes:
        target: (3,) m, the point in the middle of the picture.
        distance: m, from the target to the eye.
        azimuth: degrees about z of the eye as seen from the target. At -90, x points to the right
            of the picture and y into it.
        elevation: degrees of the eye above the horizontal, 1 to 90.
        field_of_view: degrees, over the height of the picture, 1 to 150.

    Raises:
        TypeError: a value is not a number.
        ValueError: a value is not finite or out of its range.
    """

    target: tuple[float, ...] = (0.0, 0.0, 0.0)
    distance: float = 0.88
    azimuth: float = -70.0
    elevation: float = 38.0
    field_of_view: float = 32.0

    def __post_init__(self) -> None:
        """Checks all values; the target becomes a tuple, as pictures are cached by camera."""
        object.__setattr__(self, "target", vector("Camera.target", self.target))
        positive("Camera.distance", self.distance)
        number("Camera.azimuth", self.azimuth)
        number("Camera.elevation", self.elevation, low=1.0, high=90.0)
        number("Camera.field_of_view", self.field_of_view, low=1.0, high=150.0)

    @cached_property
    def axes(self) -> Array:
        """[3, 3], rows are the world directions of the picture's right, up and forward."""
        a, e = np.radians([self.azimuth, self.elevation])
        outward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.stack([right, np.cross(outward, right), -outward])

    @cached_property
    def eye(self) -> Array:
        """[3] m, where the camera stands."""
        return np.array(self.target) - self.distance * self.axes[2]

    @property
    def near(self) -> float:
        """Least depth that is drawn, in m."""
        return NEAR * self.distance

    def focal_length(self, height: int) -> float:
        """Size in pixels of a metre at a depth of a metre, in a picture `height` pixels high."""
        return float(0.5 * height / np.tan(0.5 * np.radians(self.field_of_view)))

    def project(self, points: Array, width: int, height: int) -> tuple[Array, Array]:
        """Where world points appear in a picture of `width` x `height` pixels.

        Args:
            points: [..., 3] m; a depth less than `near` counts as `near`.
            width: pixels.
            height: pixels.

        Returns:
            Pixels [..., 2], right and down from the top left corner, and depths [...] m.
        """
        local = (points - self.eye) @ self.axes.T
        depth = local[..., 2]
        scale = self.focal_length(height) / np.maximum(depth, self.near)
        pixels = local[..., :2] * (scale[..., None] * _DOWN)
        return pixels + np.array([0.5 * width, 0.5 * height]), depth

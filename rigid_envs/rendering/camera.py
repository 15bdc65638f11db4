"""Camera: where to look from, and where a point of the world appears in a picture.

World frame: metres, z up, ground at z = 0.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from physics.scene.validation import number, positive, vector
from rigid_envs.rendering.rays.tables import CAMERA

Array = np.ndarray

NEAR = 0.01  # least depth that is drawn, as a share of the camera's distance
_DOWN = np.array([1.0, -1.0])  # rows of a picture count downwards


@dataclass(frozen=True)
class Camera:
    """A perspective camera. z points up in the picture; seen from straight above, y does.

    Attributes:
        position: (3,) m, of the eye, above the ground.
        target: (3,) m, the point in the middle of the picture.
        field_of_view: degrees, over the height of the picture, 1 to 150.

    Raises:
        TypeError: a value is not a number.
        ValueError: a value is not finite or out of its range, the eye is not above the ground, or
            it is at the target.
    """

    position: tuple[float, ...] = (0.237, -0.652, 0.542)
    target: tuple[float, ...] = (0.0, 0.0, 0.0)
    field_of_view: float = 32.0

    def __post_init__(self) -> None:
        """Checks all values; points become tuples, as pictures of the ground are cached."""
        object.__setattr__(self, "position", vector("Camera.position", self.position))
        object.__setattr__(self, "target", vector("Camera.target", self.target))
        number("Camera.field_of_view", self.field_of_view, low=1.0, high=150.0)
        if self.position[2] <= 0.0:
            raise ValueError(
                f"Camera.position must be above the ground (z > 0), got {self.position!r}"
            )
        if self.distance < 1e-6:
            raise ValueError(
                f"Camera.position must be apart from Camera.target, got {self.position!r} for both"
            )

    @classmethod
    def around(
        cls,
        target: tuple[float, ...],
        distance: float,
        azimuth: float = -70.0,
        elevation: float = 38.0,
        field_of_view: float = 32.0,
    ) -> "Camera":
        """A camera on a sphere around its target.

        Args:
            target: (3,) m.
            distance: m, from the target to the eye.
            azimuth: degrees about z of the eye as seen from the target. At -90, x points to the
                right of the picture and y into it.
            elevation: degrees of the eye above the horizontal, at most 90.
            field_of_view: degrees, see the class.
        """
        middle = np.array(vector("target", target))
        a = np.radians(number("azimuth", azimuth))
        e = np.radians(number("elevation", elevation, low=-90.0, high=90.0))
        outward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        eye = middle + positive("distance", distance) * outward
        return cls(tuple(eye.tolist()), target, field_of_view)

    @property
    def distance(self) -> float:
        """m, from the eye to the target."""
        return float(np.linalg.norm(np.subtract(self.target, self.position)))

    @property
    def azimuth(self) -> float:
        """Degrees about z of the eye as seen from the target; -90 if the eye is straight above."""
        x, y, _ = np.subtract(self.position, self.target)
        return float(np.degrees(np.arctan2(y, x))) if np.hypot(x, y) > 1e-9 else -90.0

    @property
    def elevation(self) -> float:
        """Degrees of the eye above the horizontal, as seen from the target."""
        return float(np.degrees(np.arcsin(-self.axes[2, 2])))

    @cached_property
    def axes(self) -> Array:
        """[3, 3], rows are the world directions of the picture's right, up and forward."""
        forward = np.subtract(self.target, self.position) / self.distance
        right = np.array([forward[1], -forward[0], 0.0])
        across = float(np.linalg.norm(right))
        right = right / across if across > 1e-9 else np.array([1.0, 0.0, 0.0])
        return np.stack([right, np.cross(right, forward), forward])

    @cached_property
    def eye(self) -> Array:
        """[3] m, where the camera stands."""
        return np.array(self.position)

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

    def rays(self, width: int, height: int) -> Array:
        """[height, width, 3], directions of the pixels' middles, with a depth of 1 m.

        Args:
            width: of the picture in pixels.
            height: likewise.
        """
        pixel = 1.0 / self.focal_length(height)
        x = pixel * (np.arange(width) + 0.5 - 0.5 * width)
        y = pixel * (0.5 * height - np.arange(height) - 0.5)
        right, up, forward = self.axes
        return np.asarray(forward + x[:, None] * right + y[:, None, None] * up)

    def table(self, width: int, height: int, floor: float = 0.0) -> Array:
        """[1], of CAMERA: this camera for pictures of `width` x `height` pixels.

        Args:
            width: pixels.
            height: pixels.
            floor: m, height of the ground, which is z = 0 for kernels.
        """
        focal, eye = self.focal_length(height), self.eye - np.array([0.0, 0.0, floor])
        row = (eye, self.axes, focal, 1.0 / focal, self.near, 0.5 * width, 0.5 * height)
        return np.array([row], dtype=CAMERA)

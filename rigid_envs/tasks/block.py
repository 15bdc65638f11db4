"""The object that Push pushes: a cube, a T or any Compound that lies flat on the ground."""

from typing import Any, NamedTuple

import numpy as np

from physics import Box, Compound
from physics.scene.validation import choice, instance

Array = np.ndarray

HALF = 0.02  # m, half the width of the cube
# m, half extents of the bar and the stem of the T, which are joined along y
BAR, STEM = (0.04, 0.01, 0.015), (0.01, 0.02, 0.015)
NAMES = ("cube", "t")
# limits in m: the height, so that the finger can push the block and pass over it; the radius, so
# that the finger fits between the block and the border of its workspace; and how far inside its
# base the centre of mass of the block must lie
MIN_HEIGHT, MAX_HEIGHT, MAX_RADIUS, MIN_BASE_MARGIN = 0.015, 0.08, 0.07, 0.005


class Block(NamedTuple):
    """A block as it lies on the ground.

    Attributes:
        shape: its shape.
        height: m, of its centre of mass above the ground.
        top: m, of its highest point above the ground.
        radius: m, distance of its farthest point from the vertical axis through its centre of mass.
        yaw_symmetry: the block looks the same after every 1/yaw_symmetry of a turn.
    """

    shape: Box | Compound
    height: float
    top: float
    radius: float
    yaw_symmetry: int

    @property
    def cube(self) -> bool:
        """Whether the block is the cube."""
        return isinstance(self.shape, Box)

    @classmethod
    def of(cls, block: Any) -> "Block":
        """The block with a name, or made of a Compound.

        Raises:
            TypeError, ValueError: there is no such name; or the Compound is too low, too high or
                too wide for the task, or would tip over.
        """
        if isinstance(block, str):
            if choice("block", block, NAMES) == "cube":
                return cls(Box((HALF,) * 3), HALF, 2.0 * HALF, np.sqrt(2.0) * HALF, 4)
            block = Compound([(Box(BAR), (0, 0, 0)), (Box(STEM), (0, -BAR[1] - STEM[1], 0))])
        if not isinstance(block, Compound):
            instance(f"block, if not one of {list(NAMES)},", block, Compound)
        points, radii = _support_points(block)
        bottom = float((points[:, 2] - radii).min())
        top = float((points[:, 2] + radii).max()) - bottom
        if not MIN_HEIGHT <= top <= MAX_HEIGHT:
            raise ValueError(
                f"block must be {MIN_HEIGHT:g} to {MAX_HEIGHT:g} m high, so that the finger can "
                f"push it and pass over it, got {top:g} m"
            )
        radius = float((np.hypot(points[:, 0], points[:, 1]) + radii).max())
        if radius > MAX_RADIUS:
            raise ValueError(
                f"block must reach at most {MAX_RADIUS:g} m from the vertical axis through its "
                f"centre of mass, so that the finger can move behind it, got {radius:g} m"
            )
        base = points[points[:, 2] - radii < bottom + 1e-6, :2]
        angle = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
        margin = float((base @ np.stack([np.cos(angle), np.sin(angle)])).max(axis=0).min())
        if margin < MIN_BASE_MARGIN:
            raise ValueError(
                "block must lie flat: its centre of mass must be at least "
                f"{MIN_BASE_MARGIN:g} m inside the border of its base, got {margin:.3g} m"
            )
        return cls(block, -bottom, top, radius, 1)


def _support_points(block: Compound) -> tuple[Array, Array]:
    """Corners [n, 3] m of the cores of a compound's parts, and the rounding radii [n] m of each."""
    points, radii = zip(*(part.ends for part in block.parts), strict=True)  # type: ignore[union-attr]
    return np.concatenate(points), np.repeat(radii, [len(ends) for ends in points])

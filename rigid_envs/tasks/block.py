"""Block: what Push pushes, a cube, a T or any Compound that lies flat."""

from typing import Any, NamedTuple

import numpy as np

from physics import Box, Compound
from physics.scene.validation import choice, instance

Array = np.ndarray

HALF = 0.02  # m, half the cube's width
# m, half extents of the T's bar and stem, which are joined along y
BAR, STEM = (0.04, 0.01, 0.015), (0.01, 0.02, 0.015)
NAMES = ("cube", "t")
# m: heights that the finger can push at and pass over, the largest reach that leaves it room within
# its workspace, and how far within its base a block's centre of mass must be
LOWEST, HIGHEST, WIDEST, WITHIN = 0.015, 0.08, 0.07, 0.005


class Block(NamedTuple):
    """A block as it lies on the ground.

    Attributes:
        shape: its shape.
        height: m, of its centre over the ground.
        top: m, of its highest point.
        radius: m, of its farthest point from the upright axis through its centre.
        turns: parts of a turn after each of which it looks the same.
    """

    shape: Box | Compound
    height: float
    top: float
    radius: float
    turns: int

    @property
    def cube(self) -> bool:
        """Whether it is the cube."""
        return isinstance(self.shape, Box)

    @classmethod
    def of(cls, block: Any) -> "Block":
        """The block of a name, or a Compound.

        Raises:
            TypeError, ValueError: no such name; a Compound that is too low, high or wide for the
                task, or would topple.
        """
        if isinstance(block, str):
            if choice("block", block, NAMES) == "cube":
                return cls(Box((HALF,) * 3), HALF, 2.0 * HALF, np.sqrt(2.0) * HALF, 4)
            block = Compound([(Box(BAR), (0, 0, 0)), (Box(STEM), (0, -BAR[1] - STEM[1], 0))])
        if not isinstance(block, Compound):
            instance(f"block, if none of {list(NAMES)},", block, Compound)
        points, radii = _ends(block)
        bottom = float((points[:, 2] - radii).min())
        height = float((points[:, 2] + radii).max()) - bottom
        if not LOWEST <= height <= HIGHEST:
            raise ValueError(
                f"block must be {LOWEST:g} to {HIGHEST:g} m high, for the finger to push it and to "
                f"pass over it, got {height:g} m"
            )
        radius = float((np.hypot(points[:, 0], points[:, 1]) + radii).max())
        if radius > WIDEST:
            raise ValueError(
                f"block must reach at most {WIDEST:g} m from the upright axis through its centre "
                f"of mass, for the finger to get behind it, got {radius:g} m"
            )
        lowest = points[points[:, 2] - radii < bottom + 1e-6, :2]
        turn = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
        within = float((lowest @ np.stack([np.cos(turn), np.sin(turn)])).max(axis=0).min())
        if within < WITHIN:
            raise ValueError(
                f"block must lie flat, its centre of mass at least {WITHIN:g} m within the border "
                f"of what it lies on, got {within:.3g} m"
            )
        return cls(block, -bottom, height, radius, 1)


def _ends(block: Compound) -> tuple[Array, Array]:
    """Corners [n, 3] m of the cores of a compound's parts, and the radii [n] m around them."""
    points, radii = zip(*(part.ends for part in block.parts), strict=True)  # type: ignore[union-attr]
    return np.concatenate(points), np.repeat(radii, [len(ends) for ends in points])

"""A software renderer: colours, depths and solids of pictures of many worlds, without a display.

Every solid is cut with the rays of the pixels that it may cover, so that pictures are exact: round
solids are not cut into polygons. What there is to see is in `view`.
"""

import threading
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from physics.rotation import rotation_matrix
from physics.scene.validation import instance, integer, number
from physics.step.threads import run_in_blocks
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.markers import Overlay, overlay, stacked
from rigid_envs.rendering.primitives import balls, placed, shape_primitives
from rigid_envs.rendering.rays.kernel import Drawn, Memory, Pictures, make_draw
from rigid_envs.rendering.rays.light import SUN_FRAME, TO_SUN, sun_points
from rigid_envs.rendering.rays.shadows import MOST_CELLS
from rigid_envs.rendering.rays.tables import PRIMITIVE
from rigid_envs.rendering.rays.tiles import make_draw_ground
from rigid_envs.rendering.view import Arrow, Item, Marker

Array = np.ndarray

LARGEST = 4096  # pixels, width or height
SOFT = 8  # points of the sun for soft shadows
LISTED = 16  # places in the lists of the shadows' grid for each primitive
_FAINT = 0.24  # opacity of a shape around its particles
_LEAST_BALL = 1.0  # pixels, radius; smaller particles would not be seen


class Frames(NamedTuple):
    """Pictures of worlds; None where it wasn't asked for.

    Attributes:
        rgb: [worlds, height, width, 3] uint8.
        depth: [worlds, height, width] float32, m along the camera's forward axis; infinite where
            there is nothing.
        solid: [worlds, height, width] int32, the index of the solid that is seen, -1 for none.
    """

    rgb: Array | None
    depth: Array | None
    solid: Array | None


class Renderer:
    """Draws solids on the ground. A copy or pickle carries the settings.

    Args:
        width: pixels, 1 to 4096.
        height: pixels, 1 to 4096.
        camera: where to look from; by default a square of 30 cm about the origin fills the picture.
        smooth: whether borders are smoothed.
        soft: whether shadows are, which takes longer where many solids hang high.
        floor: m, height of the ground; None if there is none.
        threads: largest number of threads for pictures of many worlds.

    Raises:
        TypeError: a value of another type.
        ValueError: a size out of its range, or a camera that is not above the ground.
    """

    def __init__(
        self,
        width: int = 480,
        height: int = 480,
        camera: Camera | None = None,
        *,
        smooth: bool = True,
        soft: bool = True,
        floor: float | None = 0.0,
        threads: int = 1,
    ) -> None:
        self.width = integer("width", width, low=1, high=LARGEST)
        self.height = integer("height", height, low=1, high=LARGEST)
        self.camera: Camera = instance("camera", camera or Camera(), Camera)
        self.smooth: bool = instance("smooth", smooth, bool)
        self.soft: bool = instance("soft", soft, bool)
        self.floor = None if floor is None else number("floor", floor)
        self.threads = integer("threads", threads, low=1)
        if self.floor is not None and self.camera.eye[2] <= self.floor:
            raise ValueError(
                f"camera must be above the ground at z = {self.floor:g} m, got a position of "
                f"{self.camera.position}"
            )
        self._below = np.array([0.0, 0.0, self.floor or 0.0])  # kernels have the ground at z = 0
        self._points = sun_points(SOFT if soft else 1)
        self._view = self.camera.table(self.width, self.height, self._below[2])
        self._memory = threading.local()
        self._has_ground = False

    def __reduce__(self) -> tuple[Any, ...]:
        """Settings only."""
        settings = (self.smooth, self.soft, self.floor, self.threads)
        return _renderer, (self.width, self.height, self.camera, *settings)

    @cached_property
    def _ground(self) -> tuple[Array, Array]:
        """Colours and depths of the empty ground, which `_draw_ground` writes."""
        size = self.height, self.width
        return np.empty((*size, 3), np.uint8), np.empty(size)

    def _draw_ground(self) -> None:
        picture, depth = self._ground
        camera = self.camera
        shown = camera.distance * np.tan(0.5 * np.radians(camera.field_of_view))
        target = np.array(camera.target[:2])
        make_draw_ground()(self._view, target, shown, self.floor is not None, picture, depth)
        self._has_ground = True

    def frame(
        self, items: Sequence[Item], *, markers: Sequence[Marker] = (), forces: Sequence[Arrow] = ()
    ) -> Array:
        """A picture (height, width, 3) uint8 of one world.

        Args:
            items: the solids.
            markers: targets and marks.
            forces: arrows, drawn over everything else.
        """
        rgb = self.frames(items, [self.overlay(markers, forces)]).rgb
        assert rgb is not None
        return np.asarray(rgb[0])

    def overlay(self, markers: Sequence[Marker], forces: Sequence[Arrow] = ()) -> Overlay:
        """Markers and forces of a world, as `frames` takes them."""
        floor = float(self._below[2])
        return overlay(markers, forces, self.camera, self.width, self.height, floor)

    def frames(
        self,
        items: Sequence[Item],
        overlays: Sequence[Overlay] = (),
        *,
        worlds: int = 1,
        primitives: Array | None = None,
        rgb: bool = True,
        depth: bool = False,
        solid: bool = False,
        ground_solid: int = -1,
    ) -> Frames:
        """Pictures of many worlds. Each depends on what its world shows alone.

        Args:
            items: the solids.
            overlays: what else is drawn in each world; none, or one for each.
            worlds: how many.
            primitives: [worlds, n], of PRIMITIVE: solids beside the items.
            rgb: whether colours are wanted.
            depth: whether depths are wanted.
            solid: whether the indices of the solids that are seen are wanted.
            ground_solid: index of the ground.

        Raises:
            ValueError: no worlds, or overlays that are neither none nor one a world.
        """
        size, worlds = (self.height, self.width), integer("worlds", worlds, low=1)
        solids, faint = self._tables(items, worlds)
        if primitives is not None:
            solids = np.concatenate([solids, primitives], axis=1)
        glass, decals, polygons = stacked(overlays, worlds)
        glass = np.concatenate([faint, glass], axis=1) if faint.size else glass
        far = np.linalg.norm(glass["position"] - self.camera.eye, axis=2)
        order = np.argsort(-far, axis=1, kind="stable")  # far ones first
        glass = np.take_along_axis(glass, order, axis=1)
        for table in (solids, glass):
            table["position"] -= self._below
        colors = np.empty((worlds if rgb else 0, *size, 3), np.uint8)
        depths = np.empty((worlds if depth else 0, *size), np.float32)
        indices = np.empty((worlds if solid else 0, *size), np.int32)
        kernel = make_draw()
        order = np.argsort(-(solids["position"] @ TO_SUN), axis=1, kind="stable")
        drawn = Drawn(
            solids, order, glass, decals, polygons, self._view, SUN_FRAME, self._points,
            *self._ground,
        )  # fmt: skip
        pictures = Pictures(colors, depths, indices)
        if not self._has_ground:
            # so that another process compiles while this one draws the ground
            memory = self._working_memory(solids.shape[1])
            kernel.prepare(0, worlds, drawn, memory, pictures, self.smooth, ground_solid)
            self._draw_ground()

        def run(first: int, last: int) -> int:
            memory = self._working_memory(solids.shape[1])
            kernel(first, last, drawn, memory, pictures, self.smooth, ground_solid)
            return 0

        run_in_blocks(run, worlds, self.threads)
        return Frames(
            colors if rgb else None, depths if depth else None, indices if solid else None
        )

    def _tables(self, items: Sequence[Item], worlds: int) -> tuple[Array, Array]:
        """Primitives [worlds, n] of solids, and [worlds, g] of those that are see-through."""
        solids = _placed([item for item in items if _opaque(item)], worlds)
        faint = _placed([item for item in items if not _opaque(item)], worlds)
        local = {
            item: balls(item.particles.positions, item.particles.radius)
            for item in items
            if item.particles is not None
        }
        if not local:
            return solids, faint
        grains = _at_poses(list(local), list(local.values()), worlds)
        depth = (grains["position"] - self.camera.eye) @ self.camera.axes[2]
        least = _LEAST_BALL * np.maximum(depth, 0.0) * self._view["pixel"][0]
        for field in (grains["size"][..., 0], grains["reach"]):
            np.maximum(field, least, out=field)
        return np.concatenate([solids, grains], axis=1), faint

    def _working_memory(self, count: int) -> Memory:
        """Of this thread, for `count` primitives."""
        own, size, listed = self._memory, (self.height, self.width), LISTED * count + 64
        if not hasattr(own, "tables"):
            own.tables = Memory(
                np.empty(size), np.empty(size, np.int32), np.empty(size, np.uint8),
                np.empty((*size, 3), np.uint8), np.empty((9, 2), np.int64),
                starts=np.empty(MOST_CELLS**2 + 1, np.int32), entries=np.empty(0, np.int32),
                slabs=np.empty((0, 0, 6)), spans=np.empty((self.height, 2), np.int64),
            )  # fmt: skip
        memory: Memory = own.tables
        if len(memory.entries) < listed:
            entries, slabs = np.empty(listed, np.int32), np.empty((count, len(self._points) + 1, 6))
            own.tables = memory = memory._replace(entries=entries, slabs=slabs)
        return memory


def _opaque(item: Item) -> bool:
    return item.opacity == 1.0 and item.particles is None


def _placed(items: list[Item], worlds: int) -> Array:
    """Primitives [worlds, n] of the items' shapes."""
    return _at_poses(items, [shape_primitives(item.shape) for item in items], worlds)


def _at_poses(items: list[Item], parts: list[Array], worlds: int) -> Array:
    """Primitives [worlds, n] of items, of which each has its part of them in its own frame."""
    if not items:
        return np.zeros((worlds, 0), PRIMITIVE)
    count = len(items)
    position, turn, size = (np.empty((worlds, count, *end)) for end in ((3,), (4,), ()))
    for k, item in enumerate(items):
        position[:, k], turn[:, k], size[:, k] = item.position, item.orientation, item.size
    which = np.repeat(np.arange(count), [len(part) for part in parts])
    local = np.empty(len(which), PRIMITIVE)
    last = 0
    for item, part in zip(items, parts, strict=True):
        first, last = last, last + len(part)
        own = local[first:last]
        own[:] = part
        own["color"], own["solid"] = item.color, item.solid
        if not _opaque(item):
            own["opacity"] = item.opacity if item.particles is None else _FAINT
    return placed(local, position[:, which], rotation_matrix(turn)[:, which], size[:, which])


def _renderer(
    width: int, height: int, camera: Camera, smooth: bool, soft: bool, floor: float, threads: int
) -> Renderer:
    return Renderer(width, height, camera, smooth=smooth, soft=soft, floor=floor, threads=threads)


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

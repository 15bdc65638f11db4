"""Pixels as observations: small pictures of every world, stacked over the last steps."""

from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from physics import World
from physics.scene.validation import choice, integer
from rigid_envs.rendering import scene_view
from rigid_envs.rendering.cameras import choose_camera
from rigid_envs.rendering.renderer import Frames, Renderer
from rigid_envs.tasks.task import Task

Array = np.ndarray
Observation = dict[str, Array]

OBSERVATION_TYPES = ("state", "flat", "pixels", "pixels+state")
CHANNELS = {"rgb": 3, "depth": 1, "segmentation": 1}
"""How many bytes of a pixel each kind takes."""

SIZE = 84  # pixels, the width and height that most learners from pixels use
LEAST, MOST = 8, 1024  # pixels
MOST_SOLIDS = 255  # that a byte tells apart
DEEPEST = 2.0  # depth of the brightest pixel, as a share of the camera's distance


class PixelSettings(NamedTuple):
    """What `obs_type` and the arguments beside it ask for.

    Attributes:
        keeps_state: whether the state is observed too.
        kinds: of pixels, in the order of the channels.
        width: pixels.
        height: pixels.
        frame_stack: how many steps a picture shows.
        camera: a name, a Camera or its settings, see `choose_camera`; it stands still.
    """

    keeps_state: bool
    kinds: tuple[str, ...]
    width: int
    height: int
    frame_stack: int
    camera: Any


def pixel_settings(
    obs_type: str, pixels: Any, pixel_size: Any, frame_stack: int | None, camera: Any
) -> PixelSettings | None:
    """Checked settings; None if the state alone is observed.

    Args:
        obs_type: one of `OBSERVATION_TYPES`.
        pixels: one of `CHANNELS`, or several; "rgb" if None.
        pixel_size: width and height in pixels, or (width, height); `SIZE` if None.
        frame_stack: how many steps a picture shows; 1 if None.
        camera: see `choose_camera`.

    Raises:
        TypeError, ValueError: an unknown name, or a number out of its range.
    """
    choice("obs_type", obs_type, OBSERVATION_TYPES)
    if not obs_type.startswith("pixels"):
        given = {"pixels": pixels, "pixel_size": pixel_size, "frame_stack": frame_stack}
        for name, value in given.items():
            if value is not None:
                raise ValueError(
                    f'{name}={value!r} needs obs_type="pixels" or "pixels+state", got "{obs_type}"'
                )
        return None
    kinds = _check_kinds("rgb" if pixels is None else pixels)
    pixel_size = SIZE if pixel_size is None else pixel_size
    size = pixel_size if isinstance(pixel_size, tuple | list) else (pixel_size, pixel_size)
    if len(size) != 2:
        raise ValueError(f"pixel_size must be a number or (width, height), got {pixel_size!r}")
    width, height = (integer("pixel_size", n, low=LEAST, high=MOST) for n in size)
    stack = 1 if frame_stack is None else integer("frame_stack", frame_stack, low=1, high=64)
    return PixelSettings(obs_type == "pixels+state", kinds, width, height, stack, camera)


class Pixels:
    """Pictures of worlds as observations.

    The markers of goals are not drawn: goals stay numbers, so that learners that relabel them (HER)
    see no picture that shows another goal. A world's pictures depend on its own episode alone.

    - "rgb": three bytes.
    - "depth": 0 at the eye, 255 at twice the camera's distance and beyond.
    - "segmentation": 0 where there is nothing, else 1 + the index of the solid.

    In a stack the last step's channels are last. At the start of an episode its first picture
    stands for those before it.

    Args:
        settings: see `PixelSettings`.
        task: of the episodes.
        world: the worlds at the start.

    Attributes:
        space: of one world's pixels.
    """

    def __init__(self, settings: PixelSettings, task: Task, world: World) -> None:
        self._kinds, self._stack = settings.kinds, settings.frame_stack
        width, height = settings.width, settings.height
        camera = choose_camera(settings.camera, task, width / height)
        floor = scene_view.floor(world.scene)
        self._ground = floor.solid
        self._renderer = Renderer(width, height, camera, floor=floor.height, threads=world.threads)
        solids = len(world.scene.solid_names)
        if "segmentation" in self._kinds and solids > MOST_SOLIDS:
            raise ValueError(
                f'pixels="segmentation" tells at most {MOST_SOLIDS} solids apart, got {solids}'
            )
        self._channels = sum(CHANNELS[kind] for kind in self._kinds)
        shape = (height, width, self._channels * self._stack)
        self.space = spaces.Box(0, 255, shape, np.uint8)
        self._frames = np.zeros((world.count, *shape), np.uint8)
        # of each world, whether its picture is old, whether it has made a step since, and whether
        # its episode has just started
        self._old, self._moved, self._starts = np.ones((3, world.count), dtype=bool)

    def stepped(self) -> None:
        """All worlds have made a step."""
        self._old[:] = self._moved[:] = True

    def changed(self) -> None:
        """All worlds look different, but have made no step."""
        self._old[:] = True

    def started(self, mask: Array) -> None:
        """The worlds of a mask have started an episode."""
        self._old |= mask
        self._starts |= mask

    def observe(self, world: World) -> Array:
        """Pixels [count, height, width, channels]; draws only what has changed since the last."""
        worlds = np.flatnonzero(self._old)
        if len(worlds):
            new, channels = self._draw(world, worlds), self._channels
            if self._stack == 1:
                self._frames[worlds] = new
            else:
                first = self._starts[worlds]
                self._frames[worlds[first]] = np.tile(new[first], self._stack)
                moved = worlds[~first & self._moved[worlds]]
                self._frames[moved, ..., :-channels] = self._frames[moved, ..., channels:]
                self._frames[worlds[~first], ..., -channels:] = new[~first]
            self._old[:] = self._moved[:] = self._starts[:] = False
        return self._frames.copy()

    def get_state(self) -> dict[str, Array]:
        """What later observations depend on beside the worlds."""
        return {
            "frames": self._frames.copy(),
            "flags": np.stack([self._old, self._moved, self._starts]),
        }

    def check_state(self, state: dict[str, Array]) -> None:
        """Raises ValueError for a state of pixels of another size or stack, or of other kinds."""
        found = state["frames"].shape
        if found != self._frames.shape:
            raise ValueError(
                f"state must have pixels of shape {self._frames.shape} (worlds, height, width, "
                f"channels), got {found}"
            )

    def set_state(self, state: dict[str, Array]) -> None:
        """Restores `get_state`, which `check_state` has accepted."""
        self._frames[:] = state["frames"]
        self._old[:], self._moved[:], self._starts[:] = state["flags"]

    def _draw(self, world: World, worlds: Array) -> Array:
        frames = self._renderer.frames(
            scene_view.items(world, worlds, observed=True),
            worlds=len(worlds),
            rgb="rgb" in self._kinds,
            depth="depth" in self._kinds,
            solid="segmentation" in self._kinds,
            ground_solid=self._ground,
        )
        if self._kinds == ("rgb",):
            assert frames.rgb is not None
            return frames.rgb
        return np.concatenate([self._channel(kind, frames) for kind in self._kinds], axis=-1)

    def _channel(self, kind: str, frames: Frames) -> Array:
        if kind == "rgb":
            assert frames.rgb is not None
            return frames.rgb
        if kind == "depth":
            assert frames.depth is not None
            share = frames.depth / (DEEPEST * self._renderer.camera.distance)
            return np.asarray(255.0 * np.minimum(share, 1.0)).astype(np.uint8)[..., None]
        assert frames.solid is not None
        return (frames.solid + 1).astype(np.uint8)[..., None]


def _check_kinds(kinds: Any) -> tuple[str, ...]:
    """Kinds of pixels: one name, or several of them, none twice."""
    if not isinstance(kinds, str | tuple | list):
        raise TypeError(f"pixels must be a name or a tuple of names, got {kinds!r}")
    names = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    for name in names:
        choice("pixels", name, CHANNELS)
    if not names or len(set(names)) < len(names):
        raise ValueError(f"pixels must name at least one kind, and none twice, got {kinds!r}")
    return names

"""A video of one world of many bodies."""

import time
from pathlib import Path

from physics import World
from rigid_envs.rendering.crowd import Crowd
from training.results.video import video_writer


class Film:
    """Draws a world now and then, and writes what it drew when it is closed.

    Args:
        world: with one world; the camera sees the places that its bodies have now.
        path: the mp4 or GIF to write.
        fps: frames a second.
        size: width and height of a frame in pixels.

    Attributes:
        path: see above.
        count: how many frames were drawn.
        seconds: s that drawing took.

    Raises:
        UsageError: another kind of file, or one that can't be written.
        ValueError: a size out of its range.
    """

    def __init__(self, world: World, path: Path, fps: float, size: int) -> None:
        self.path, self.count, self.seconds = path, 0, 0.0
        self._crowd = Crowd(world, size)
        self._writer = video_writer(path, fps, gif_width=size)
        self.add()
        self.seconds = 0.0  # the first frame compiles

    def add(self) -> None:
        """Adds a frame of the world as it is now."""
        start = time.perf_counter()
        frame = self._crowd.frame()
        self.seconds += time.perf_counter() - start
        self.count += 1
        self._writer.append_data(frame)

    @property
    def rate(self) -> float:
        """Frames drawn a second, without the first one."""
        return (self.count - 1) / self.seconds if self.seconds else 0.0

    def close(self) -> None:
        """Writes the file."""
        self._writer.close()

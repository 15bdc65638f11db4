"""GIFs that are small enough for a page: half the frames, few colours, a small size."""

from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from PIL import Image

WIDTH = 320
"""Pixels. Three episodes then take 50 to 260 KB."""
COLOURS = 64
"""Enough for a few bodies on a plain ground; more colours double the size, hardly visibly."""
SKIP = 2
"""Only each n-th frame is stored, and shown n times as long."""
PALETTE_SAMPLES = 16
"""Number of frames, evenly over the video, from which the palette is chosen."""


class GifWriter:
    """Takes frames one by one and writes the file when it is closed.

    All frames have the same palette, without dithering. Then pixels that do not move stay equal,
    and the format stores only the rectangle that has changed.

    Args:
        path: The file.
        fps: Frames per second of the frames that are passed.
        width: Width in pixels; larger frames are scaled down, smaller ones are not changed.
        colours: Largest number of colours.
    """

    def __init__(self, path: Path, fps: float, width: int = WIDTH, colours: int = COLOURS):
        self.path = path
        self.fps = fps
        self.width = width
        self.colours = colours
        self.received = 0
        self.frames: list[Image.Image] = []

    def append_data(self, frame: np.ndarray) -> None:
        """Adds a frame, (height, width, 3) uint8."""
        if self.received % SKIP == 0:
            image = Image.fromarray(frame)
            if image.width > self.width:
                height = round(self.width * image.height / image.width)
                image = image.resize((self.width, height), Image.Resampling.LANCZOS)
            self.frames.append(image)
        self.received += 1

    def close(self) -> None:
        """Writes the file, which repeats forever; writes nothing if there is no frame."""
        if not self.frames:
            return
        every = max(1, len(self.frames) // PALETTE_SAMPLES)
        sample = np.concatenate([np.asarray(frame) for frame in self.frames[::every]])
        palette = palette_of(Image.fromarray(sample), self.colours)
        first, *others = [
            frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in self.frames
        ]
        # the unit of the format is 10 ms, and viewers slow down frames shorter than 20 ms
        duration = max(20, 10 * round(100 * SKIP / self.fps))
        first.save(
            self.path,
            "GIF",
            save_all=True,
            append_images=others,
            duration=duration,
            loop=0,
            optimize=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()


def palette_of(sample: Image.Image, colours: int) -> Image.Image:
    """A picture whose palette suits a sample.

    Half the colours by octree, which finds those of a small ball; half by median cut, which finds
    the many shades of the ground: with the octree's alone the horizon is ragged.
    """
    halves = [
        sample.quantize(colours // 2, method=method).getpalette()
        for method in (Image.Quantize.FASTOCTREE, Image.Quantize.MEDIANCUT)
    ]
    palette = Image.new("P", (1, 1))
    palette.putpalette([value for half in halves for value in half or ()])
    return palette

"""Films as GIFs, small enough to stand in a page: half the pictures, few colours, a small size."""

from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from PIL import Image

WIDTH = 320
"""Pixels: a film of three episodes then takes 50 to 320 KB, the most for Stack's long ones."""
COLOURS = 64
"""Shades of a few solids on a plain ground; more double the size and hardly show."""
SKIP = 2
"""One picture of so many is kept, and shown as much longer."""
PALETTE_SAMPLES = 16
"""Pictures from all over the film that its colours are chosen from."""


class GifWriter:
    """Takes the pictures of a film one by one, and writes the file when it is closed.

    All pictures share one palette without dithering: what stands still then stays the same to the
    bit, and the format stores only the rectangle that has changed.

    Args:
        path: The file.
        fps: Pictures a second, of those that are given.
        width: Of the film, in pixels; larger pictures are shrunk to it, smaller ones kept.
    """

    def __init__(self, path: Path, fps: float, width: int = WIDTH):
        self.path = path
        self.fps = fps
        self.width = width
        self.given = 0
        self.kept: list[Image.Image] = []

    def append_data(self, frame: np.ndarray) -> None:
        """Adds a picture, (height, width, 3) uint8."""
        if self.given % SKIP == 0:
            picture = Image.fromarray(frame)
            if picture.width > self.width:
                height = round(self.width * picture.height / picture.width)
                picture = picture.resize((self.width, height), Image.Resampling.LANCZOS)
            self.kept.append(picture)
        self.given += 1

    def close(self) -> None:
        """Writes the file, which plays for ever; nothing if no picture was given."""
        if not self.kept:
            return
        every = max(1, len(self.kept) // PALETTE_SAMPLES)
        sample = np.concatenate([np.asarray(picture) for picture in self.kept[::every]])
        # an octree, for a median cut spends all colours on the ground's shades, and none on a ball
        palette = Image.fromarray(sample).quantize(COLOURS, method=Image.Quantize.FASTOCTREE)
        first, *others = [
            picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in self.kept
        ]
        # the format counts in hundredths of a second, and viewers slow down what is below two
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

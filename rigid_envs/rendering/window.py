"""A window that shows pictures, with lines of text below them, and tells which keys were used."""

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium.error import DependencyNotInstalled

from physics.scene.validation import integer, positive

Array = np.ndarray

INK, PAPER = (52, 58, 66), (250, 251, 253)
LINE_HEIGHT = 24  # pixels of a line of text
NO_DISPLAY = 'no window can be opened: there is no display; render_mode="rgb_array" needs none'


class NoDisplay(RuntimeError):
    """A window was asked for where there is nothing to show it on."""


class Key(NamedTuple):
    """A key that went down or up; `name` is pygame's, as "left", "page up", "space" or "a"."""

    name: str
    down: bool


def load_pygame() -> Any:
    """The module pygame, without its banner.

    Raises:
        DependencyNotInstalled: it is missing.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise DependencyNotInstalled(
            "a window needs pygame; to install, in a clone: "
            'pip install -c constraints.txt -e ".[render]"'
        ) from error
    return pygame


class Window:
    """Opens with the first picture and holds the pace of `fps`.

    Once its user closes it, `closed` is true and nothing more is shown. A copy or pickle carries
    the settings and opens a window of its own.

    Args:
        width: pixels of a picture.
        height: pixels of a picture.
        fps: pictures a second.
        title: of the window.
        lines: of text that have room below a picture.

    Raises:
        ValueError: a size or rate that is not positive.
        DependencyNotInstalled: pygame is missing.
    """

    def __init__(
        self, width: int, height: int, fps: float = 25.0, title: str = "", lines: int = 0
    ) -> None:
        self.width = integer("width", width, low=1)
        self.height = integer("height", height, low=1)
        self.fps = positive("fps", fps)
        self.title = title
        self.lines = integer("lines", lines, low=0)
        self.closed = False
        self._pygame = load_pygame()
        self._surface: Any = None
        self._clock: Any = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Settings only: a window can't be copied."""
        return Window, (self.width, self.height, self.fps, self.title, self.lines)

    def show(self, picture: Array, text: Sequence[str] = ()) -> list[Key]:
        """Show a picture (height, width, 3) uint8 and lines of text; waits for its time.

        Returns:
            The keys that went down or up since the last picture, in order.

        Raises:
            NoDisplay: there is none.
        """
        if self.closed:
            return []
        if self._surface is None:
            self._open()
        self._surface.fill(PAPER)
        memory: Any = np.ascontiguousarray(picture)  # any buffer will do, type hints know some
        image = self._pygame.image.frombuffer(memory, (self.width, self.height), "RGB")
        self._surface.blit(image, (0, 0))
        for row, line in enumerate(text[: self.lines]):
            self._write(line, row)
        self._pygame.display.flip()
        keys = self._keys()
        if not self.closed:
            self._clock.tick(self.fps)
        return keys

    def close(self) -> None:
        """Close the window for good."""
        if self._surface is not None:
            self._pygame.display.quit()
        self._surface, self.closed = None, True

    def _open(self) -> None:
        check_display()
        self._pygame.display.init()
        room = LINE_HEIGHT * self.lines + (LINE_HEIGHT // 2 if self.lines else 0)
        self._surface = self._pygame.display.set_mode((self.width, self.height + room))
        self._pygame.display.set_caption(self.title)
        self._clock = self._pygame.time.Clock()

    def _write(self, line: str, row: int) -> None:
        font = self._pygame.font
        if not font:  # pygame without SDL_ttf
            return
        font.init()
        words = font.Font(None, LINE_HEIGHT - 2).render(line, True, INK)
        self._surface.blit(words, (10, self.height + LINE_HEIGHT * row + LINE_HEIGHT // 3))

    def _keys(self) -> list[Key]:
        found = []
        for event in self._pygame.event.get():
            if event.type == self._pygame.QUIT:
                self.close()
                break
            if event.type in (self._pygame.KEYDOWN, self._pygame.KEYUP):
                down = event.type == self._pygame.KEYDOWN
                found.append(Key(self._pygame.key.name(event.key), down))
        return found


def check_display() -> None:
    """Raises NoDisplay where no window could be opened; windows that are open stay open."""
    pygame = load_pygame()
    if pygame.display.get_init():
        return
    try:
        pygame.display.init()
    except pygame.error:
        raise NoDisplay(NO_DISPLAY) from None
    # without a display SDL draws to nowhere; whoever names such a driver wants it
    driver = pygame.display.get_driver()
    pygame.display.quit()
    if "SDL_VIDEODRIVER" not in os.environ and driver in ("offscreen", "dummy"):
        raise NoDisplay(NO_DISPLAY)

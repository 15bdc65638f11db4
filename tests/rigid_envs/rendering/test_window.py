"""A window shows pictures and text, tells of keys, and is closed for good by its user."""

import copy
import sys

import numpy as np
import pygame
import pytest
from gymnasium.error import DependencyNotInstalled

from rigid_envs import RigidEnv, RigidVectorEnv
from rigid_envs.rendering.window import Key, NoDisplay, Window

PICTURE = np.zeros((48, 64, 3), np.uint8)


@pytest.fixture
def window(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = Window(64, 48, fps=1000, title="Push", lines=2)
    yield window
    window.close()


def test_it_opens_with_the_first_picture_and_closes_with_its_user(window):
    assert not pygame.display.get_init()
    window.show(PICTURE)
    assert pygame.display.get_caption()[0] == "Push"
    assert not window.closed
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.show(PICTURE)
    assert window.closed
    assert not pygame.display.get_init()
    assert window.show(PICTURE) == []
    assert not pygame.display.get_init()
    window.close()


def test_without_a_display_there_is_no_window(monkeypatch):
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    with pytest.raises(NoDisplay, match="there is no display; render_mode="):
        Window(64, 48).show(PICTURE)


def test_an_environment_without_a_display_is_refused_before_anything_is_compiled(monkeypatch):
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "dummy")
    with pytest.raises(NoDisplay, match="there is no display; render_mode="):
        RigidEnv("push", render_mode="human")
    with pytest.raises(NoDisplay, match="there is no display; render_mode="):
        RigidVectorEnv("push", 4, render_mode="human")


def test_it_tells_which_keys_went_down_and_up(window):
    window.show(PICTURE)
    pygame.event.clear()
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_LEFT))
    pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.K_LEFT))
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_PAGEUP))
    assert window.show(PICTURE) == [Key("left", True), Key("left", False), Key("page up", True)]
    assert window.show(PICTURE) == []


def test_text_stands_below_the_picture(window):
    window.show(PICTURE)
    plain = pygame.surfarray.array3d(pygame.display.get_surface())
    window.show(PICTURE, ["step 3", "reward"])
    written = pygame.surfarray.array3d(pygame.display.get_surface())
    changed = np.argwhere((plain != written).any(axis=-1))
    assert len(changed) > 0
    assert changed[:, 1].min() >= 48


def test_a_copy_opens_a_window_of_its_own(window):
    window.show(PICTURE)
    twin = copy.deepcopy(window)
    assert (twin.width, twin.height, twin.fps, twin.title, twin.lines) == (64, 48, 1000, "Push", 2)
    assert not twin.closed


def test_a_missing_pygame_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(DependencyNotInstalled, match=r'constraints.txt -e "\.\[render\]"'):
        Window(64, 48)


@pytest.mark.parametrize("field", ["width", "height", "fps"])
def test_a_size_or_rate_must_be_positive(field):
    with pytest.raises(ValueError, match=f"{field}.*got 0"):
        Window(**{"width": 64, "height": 48, field: 0})

"""Environments draw what happens, in a window or not, and can be filmed."""

import os
import subprocess
import sys
import warnings

import gymnasium as gym
import numpy as np
import pygame
import pytest
from gymnasium.wrappers import RecordVideo
from gymnasium.wrappers.vector import RecordVideo as RecordVectorVideo

from rigid_envs.rendering import grid
from tests.rigid_envs.rollout import (
    IDS,
    PUSH,
    make,
    make_vec,
    random_actions,
    steps_of,
    toward_cube,
)

FRAME = (480, 480, 3)


@pytest.mark.parametrize("env_id", IDS)
def test_a_picture_follows_the_world(env_id):
    env = make(env_id, render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    np.testing.assert_array_equal(env.render(), before)
    env.step(env.action_space.high)
    after = env.render()
    assert after.shape == FRAME
    assert after.dtype == np.uint8
    assert (after != before).any()


def test_rendering_changes_no_bit_of_the_episode():
    seen, unseen = make(render_mode="rgb_array", show_forces=True), make()
    for env in (seen, unseen):
        env.reset(seed=0)
    for action in random_actions(50, 1)[:, 0]:
        seen.render()
        one, other = seen.step(action), unseen.step(action)
        np.testing.assert_equal(one, other)


def test_contact_forces_are_drawn_if_asked_for():
    frames = []
    for show_forces in (False, True):
        env = make(render_mode="rgb_array", show_forces=show_forces)
        env.reset(seed=0)
        env.step(np.zeros(3))
        frames.append(env.render())
    assert (frames[0] != frames[1]).any()  # the cube's weight on the ground


def test_a_vector_environment_gives_a_picture_of_each_world():
    envs = make_vec(5, render_mode="rgb_array")
    envs.reset(seed=3)
    frames = envs.render()
    assert type(frames) is tuple
    assert [frame.shape for frame in frames] == [FRAME] * 5
    assert grid(frames).shape == (960, 1440, 3)
    alone = make(render_mode="rgb_array")
    alone.reset(seed=5)
    np.testing.assert_array_equal(frames[2], alone.render())


@pytest.mark.parametrize("make_one", [make, lambda: make_vec(2)], ids=["one", "many"])
def test_rendering_without_a_mode_says_how_to_get_one(make_one):
    env = make_one()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match='render_mode="rgb_array"'):
        assert env.render() is None


def test_a_window_opens_with_the_first_episode_and_closes_with_the_environment(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gym.make(PUSH, render_mode="human")
    env.reset(seed=0)
    assert pygame.display.get_init()
    env.step(np.zeros(3, dtype=np.float32))
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()
    env.close()


def test_a_window_shows_the_first_of_many_worlds(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    envs = make_vec(3, render_mode="human")
    envs.reset(seed=0)
    assert envs.render() is None
    assert pygame.display.get_init()
    envs.close()
    assert not pygame.display.get_init()


def test_an_episode_of_one_world_can_be_filmed(tmp_path):
    env = gym.make(PUSH, render_mode="rgb_array", max_episode_steps=8)
    env = RecordVideo(
        env, str(tmp_path / "films"), episode_trigger=lambda _: True, disable_logger=True
    )
    observation, _ = env.reset(seed=0)
    truncated = False
    while not truncated:
        observation, _, _, truncated, _ = env.step(toward_cube(observation))
    env.close()
    assert [film.stat().st_size > 0 for film in tmp_path.glob("films/*.mp4")] == [True]


def test_episodes_of_many_worlds_can_be_filmed(tmp_path):
    envs = make_vec(4, render_mode="rgb_array", max_episode_steps=8)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        envs = RecordVectorVideo(
            envs, str(tmp_path / "films"), episode_trigger=lambda k: k == 0, disable_logger=True
        )
    envs.reset(seed=0)
    for _ in steps_of(envs, random_actions(12, 4)):
        pass
    envs.close()
    assert [film.stat().st_size > 0 for film in tmp_path.glob("films/*.mp4")] == [True]


def test_an_environment_draws_without_a_banner_and_without_a_display():
    program = (
        "import gymnasium as gym\n"
        f"env = gym.make('rigid_envs:{PUSH}', render_mode='rgb_array')\n"
        "env.reset(seed=0)\n"
        "assert env.render().std() > 1\n"
    )
    environment = {k: v for k, v in os.environ.items() if "SDL" not in k and k != "DISPLAY"}
    environment.pop("PYGAME_HIDE_SUPPORT_PROMPT", None)
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == ""

"""Videos: mp4 and GIF, written without a display."""

from contextlib import closing

import gymnasium as gym
import numpy as np
import pytest
from PIL import Image

from tests.training.reach import straight_to_the_goal
from training.policies.policy import Policy, scripted_policy
from training.results import video as video_module
from training.results.gif import GifWriter
from training.results.video import make_video_env, record


@pytest.fixture
def solver(reach) -> Policy:
    return Policy(straight_to_the_goal, reach, "solver")


def test_video_and_still_image_are_written(solver, tmp_path):
    video, still = record(solver, tmp_path / "videos" / "reach.mp4", episodes=2, quiet=True)
    assert video.read_bytes()[4:8] == b"ftyp"
    assert still.read_bytes().startswith(b"\x89PNG")


def test_gif_of_small_frames_keeps_their_size(solver, tmp_path):
    video, still = record(solver, tmp_path / "reach.gif", episodes=2, quiet=True)
    assert still.read_bytes().startswith(b"\x89PNG")
    with Image.open(video) as gif:
        assert gif.format == "GIF"
        assert gif.info["loop"] == 0
        assert gif.size == (64, 48)  # small frames are not enlarged


def test_gif_is_scaled_down_and_shows_every_second_frame_twice_as_long(tmp_path):
    path = tmp_path / "moving.gif"
    with GifWriter(path, fps=25, width=100) as writer:
        for step in range(11):
            frame = np.full((100, 200, 3), 255, np.uint8)
            frame[:, 10 * step : 10 * step + 40] = (200, 30, 30)
            writer.append_data(frame)
    with Image.open(path) as gif:
        assert gif.size == (100, 50)
        assert gif.n_frames == 6
        assert gif.info["duration"] == 80  # ms
        gif.seek(5)
        last = np.asarray(gif.convert("RGB"))
    np.testing.assert_allclose(last[25, 60], (200, 30, 30), atol=3)
    np.testing.assert_allclose(last[25, 20], 255, atol=3)


def test_gif_keeps_the_colour_of_a_small_object(tmp_path):
    path = tmp_path / "ball.gif"
    shades = np.linspace(180, 255, 200).astype(np.uint8)
    with GifWriter(path, fps=25) as writer:
        for step in range(11):
            frame = np.empty((200, 200, 3), np.uint8)
            frame[:] = shades[:, None]
            frame[100:106, 10 * step : 10 * step + 6] = (230, 120, 40)
            writer.append_data(frame)
    with Image.open(path) as gif:
        gif.seek(5)
        np.testing.assert_allclose(
            np.asarray(gif.convert("RGB"))[103, 103], (230, 120, 40), atol=10
        )


def test_three_episodes_of_push_take_less_than_300_kilobytes(tmp_path):
    video, _ = record(
        scripted_policy("RigidEnvs/Push-v0"), tmp_path / "push.gif", episodes=3, quiet=True
    )
    assert video.stat().st_size <= 300_000
    with Image.open(video) as gif:
        assert gif.size == (320, 320)


def test_failure_leaves_no_gif(tmp_path, reach):
    def fails(observation):
        raise RuntimeError("a bug")

    with pytest.raises(RuntimeError, match="a bug"):
        record(Policy(fails, reach, "fails"), tmp_path / "video.gif", episodes=1, quiet=True)
    assert not list(tmp_path.iterdir())


def test_a_video_of_throw_follows_the_ball_unless_a_camera_is_given(tmp_path):
    """Also with arguments that the video replaces, and where pixels are observed."""
    throw = "RigidEnvs/Throw-v0"
    frames = {}
    for name, arguments in {
        "default": {"render_mode": None},
        "follow": {"camera": "follow"},
        "task": {"camera": "task"},
        "pixels": {"obs_type": "pixels", "pixel_size": 16},
    }.items():
        with closing(make_video_env(throw, {"fidelity": "fast", **arguments})) as env:
            env.reset(seed=0)
            frames[name] = env.render()
    np.testing.assert_array_equal(frames["default"], frames["follow"])
    np.testing.assert_array_equal(frames["pixels"], frames["follow"])
    assert (frames["task"] != frames["follow"]).any()


def test_an_environment_of_another_kind_keeps_its_camera(monkeypatch, reach):
    class Other(gym.Env):
        task = "a name"

    made = Other()
    monkeypatch.setattr(video_module, "make_single_env", lambda env_id, **arguments: made)
    assert make_video_env("Other-v0", {}) is made

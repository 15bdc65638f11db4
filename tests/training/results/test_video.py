"""Videos: mp4 and GIF, written without a display."""

from contextlib import closing

import numpy as np
import pytest
from PIL import Image

from tests.training.reach import straight_to_the_goal
from training.policies.policy import Policy, scripted_policy
from training.results.gif import GifWriter
from training.results.video import film_episode, record
from training.settings.environments import make_single_env

THROW = "RigidEnvs/Throw-v0"
STILL = Policy(lambda _: np.array([[0.0, 0.0, 0.0, -1.0]], np.float32), THROW, "still")


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
    """Also where pixels are observed, which then are the task's camera's."""
    films = {}
    for name, arguments in {
        "default": {},
        "follow": {"camera": "follow"},
        "task": {"camera": "task"},
        "pixels": {"obs_type": "pixels", "pixel_size": 16},
    }.items():
        size = {"width": 32, "height": 32, "fidelity": "fast"}
        env = make_single_env(THROW, render_mode="rgb_array", **size, **arguments)
        with closing(env):
            films[name] = film_episode(env, STILL, 0, steps=2, fits="camera" not in arguments)
    np.testing.assert_array_equal(films["default"], films["follow"])
    np.testing.assert_array_equal(films["pixels"], films["follow"])
    assert (np.array(films["task"]) != films["follow"]).any()


@pytest.mark.parametrize("forces", [False, True])
def test_a_film_shows_what_frames_of_the_running_episode_show(forces):
    size = {"width": 48, "height": 48, "show_forces": forces, "camera": "front"}
    with closing(make_single_env(THROW, render_mode="rgb_array", fidelity="fast", **size)) as env:
        film = film_episode(env, STILL, 3, steps=4, fits=False)
        env.reset(seed=3)
        frames = [env.render()]
        for _ in range(4):
            env.step(STILL.act(None)[0])
            frames.append(env.render())
    np.testing.assert_array_equal(film, frames)


def test_a_film_ends_shortly_after_success():
    policy = scripted_policy("RigidEnvs/Push-v0")
    arguments = {"render_mode": "rgb_array", "width": 16, "height": 16, "fidelity": "fast"}
    with closing(make_single_env(policy.env_id, **arguments)) as env:
        whole = film_episode(env, policy, 0)
        short = film_episode(env, policy, 0, after=5)
        start = film_episode(env, policy, 0, after=0)
    assert len(whole) == 51
    assert len(short) == len(start) + 5 < 51


def test_an_environment_of_another_kind_keeps_its_camera(solver, reach):
    """It has no states: frames are drawn as the episode runs."""
    with closing(make_single_env(reach, render_mode="rgb_array")) as env:
        film = film_episode(env, solver, 0, after=0)
        env.reset(seed=0)
        np.testing.assert_array_equal(film[0], env.render())
    assert len(film) > 1

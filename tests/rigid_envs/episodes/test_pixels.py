"""Pixels as observations: what they show, and that they belong to their world and step."""

import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_for_sb3

from tests.rigid_envs.rollout import IDS, PUSH, make, make_vec, random_actions

SMALL = {"obs_type": "pixels", "pixel_size": 32, "fidelity": "fast"}


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("obs_type", ["pixels", "pixels+state"])
def test_the_checkers_accept_pixels(env_id, obs_type):
    env = gym.make(env_id, obs_type=obs_type)
    check_env(env.unwrapped, skip_render_check=True)
    check_for_sb3(env.unwrapped, warn=True)
    space = env.observation_space["observation"]
    assert space.shape == (84, 84, 3)
    assert space.dtype == np.uint8
    assert ("state" in env.observation_space.spaces) == (obs_type == "pixels+state")


def test_goals_and_state_stay_numbers():
    both, plain = make(obs_type="pixels+state"), make()
    seen, _ = both.reset(seed=3)
    known, _ = plain.reset(seed=3)
    np.testing.assert_array_equal(seen["state"], known["observation"])
    for name in ("achieved_goal", "desired_goal"):
        np.testing.assert_array_equal(seen[name], known[name])


def test_pictures_show_the_step_that_they_are_of():
    env = make(**SMALL)
    first, _ = env.reset(seed=0)
    kept = first["observation"].copy()
    second = env.step(np.ones(3))[0]
    np.testing.assert_array_equal(first["observation"], kept)
    assert (second["observation"] != kept).any()
    again, _ = env.reset(seed=0)
    np.testing.assert_array_equal(again["observation"], kept)


def test_goals_are_not_drawn():
    """Two episodes with one start and different goals look alike."""
    env = make(**SMALL)
    env.reset(seed=0)
    state = env._runner.get_state()
    before = env._runner.observe()[0]["observation"]
    state["goals"] = -state["goals"]
    env._runner.set_state(state)
    env._runner._pixels.stepped()
    np.testing.assert_array_equal(env._runner.observe()[0]["observation"], before)


def test_many_worlds_see_what_each_would_see_alone():
    envs = make_vec(5, **SMALL, threads=2)
    alone = make(**SMALL)
    many, one = envs.reset(seed=7)[0], alone.reset(seed=9)[0]
    np.testing.assert_array_equal(many["observation"][2], one["observation"])
    for actions in random_actions(4, 5):
        many, one = envs.step(actions)[0], alone.step(actions[2])[0]
        np.testing.assert_array_equal(many["observation"][2], one["observation"])


def test_kinds_of_pixels_are_channels_in_order():
    settings = {**SMALL, "pixels": ("depth", "rgb", "segmentation")}
    env, rgb = make(**settings), make(**SMALL)
    seen = env.reset(seed=0)[0]["observation"]
    assert seen.shape == (32, 32, 5)
    np.testing.assert_array_equal(seen[..., 1:4], rgb.reset(seed=0)[0]["observation"])
    # block, finger and ground by their places in the scene: bodies, drives, statics
    assert set(np.unique(seen[..., 4])) == {1, 2, 3}
    camera = env.unwrapped.task.camera
    eye, ray = camera.eye, camera.rays(32, 32)
    ground = seen[..., 4] == 3
    share = (-eye[2] / ray[..., 2] / (2.0 * camera.distance))[ground]
    np.testing.assert_allclose(
        seen[..., 0][ground], np.floor(255.0 * np.minimum(share, 1.0)), atol=1
    )


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_stack_holds_the_last_steps_and_begins_with_each_episode(mode):
    settings = {**SMALL, "max_episode_steps": 4}
    stacked = make_vec(3, **settings, frame_stack=3, autoreset_mode=mode)
    single = make_vec(3, **settings, autoreset_mode=mode)
    now, new = stacked.reset(seed=0)[0], single.reset(seed=0)[0]
    past = [new["observation"]] * 3
    for actions in random_actions(10, 3):
        np.testing.assert_array_equal(now["observation"], np.concatenate(past[-3:], axis=-1))
        ended = stacked._ended.copy()
        now, _, terminated, truncated, info = stacked.step(actions)
        new = single.step(actions)[0]
        begun = ended if mode == "NextStep" else terminated | truncated
        past.append(new["observation"])
        if begun.all():
            past = [new["observation"]] * 3
        if mode == "SameStep" and begun.all():
            last = info["final_obs"][0]["observation"]
            assert last.shape == (32, 32, 9)
            assert (last[..., 3:6] != last[..., 6:]).any()


def test_an_episode_with_a_stack_continues_from_its_state():
    env, other = (make(**SMALL, frame_stack=2) for _ in range(2))
    env.reset(seed=0)
    env.step(np.ones(3))
    other.set_state(env.get_state())
    one, two = env.step(-np.ones(3))[0], other.step(-np.ones(3))[0]
    np.testing.assert_array_equal(one["observation"], two["observation"])


def test_a_state_of_other_pixels_is_refused_before_anything_changes():
    small, large = make(**SMALL), make(**{**SMALL, "pixel_size": 48})
    for env in (small, large):
        env.reset(seed=0)
    small.step(np.ones(3))
    before = large._runner.world.position.copy()
    with pytest.raises(ValueError, match=r"shape \(1, 48, 48, 3\).*got \(1, 32, 32, 3\)"):
        large.set_state(small.get_state())
    np.testing.assert_array_equal(large._runner.world.position, before)


def test_new_parameters_are_seen_at_once_and_do_not_count_as_a_step():
    env = make(**SMALL, frame_stack=2, randomize={"size": (1.0, 1.0)})
    env.reset(seed=0)
    before = env.step(np.ones(3))[0]["observation"]
    env._runner.change_ranges({"size": (2.0, 2.0)})
    after = env._runner.observe()[0]["observation"][0]
    np.testing.assert_array_equal(after[..., :3], before[..., :3])
    assert (after[..., 3:] != before[..., 3:]).any()


def test_a_camera_that_follows_stands_still_for_pixels():
    still, follows = (make(**SMALL, camera=name).reset(seed=0)[0] for name in ("task", "follow"))
    np.testing.assert_array_equal(still["observation"], follows["observation"])


def test_a_camera_is_chosen_for_pixels_too():
    above, side = (make(**SMALL, camera=name).reset(seed=0)[0] for name in ("top", "side"))
    assert (above["observation"] != side["observation"]).any()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"obs_type": "pixel"}, "obs_type"),
        ({"pixels": "rgbd"}, "pixels"),
        ({"pixels": ()}, "at least one kind"),
        ({"obs_type": "state", "pixel_size": 84, "pixels": "depth"}, "pixels=.* needs obs_type"),
        ({"pixels": ("rgb", "rgb")}, "none twice"),
        ({"pixel_size": 4}, "pixel_size must be at least 8, got 4"),
        ({"pixel_size": (84, 84, 3)}, r"number or \(width, height\)"),
        ({"frame_stack": 0}, "frame_stack must be at least 1, got 0"),
        ({"obs_type": "state", "frame_stack": 2}, 'needs obs_type="pixels"'),
        ({"obs_type": "state", "frame_stack": None, "pixel_size": 84}, "pixel_size=84 needs"),
        ({"camera": "left"}, "camera must be one of 'task', 'follow', 'front'"),
        ({"camera": {"place": (0, 0, 1)}}, "camera has no field 'place'"),
        ({"camera": {"position": (0, 0, -1)}}, "above the ground"),
        ({"width": 5000}, "width must be at most 4096, got 5000"),
    ],
)
def test_what_cannot_be_observed_is_named(settings, message):
    with pytest.raises(ValueError, match=message):
        make(**{**SMALL, **settings})


def test_a_size_of_frames_that_are_not_drawn_is_warned_about():
    with pytest.warns(UserWarning, match="width=64 and height=480.*pixel_size"):
        make(**SMALL, width=64)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(**SMALL, width=64, render_mode="rgb_array")
        make(**SMALL)


def test_a_policy_learns_from_pixels():
    """A few updates of PPO with Stable-Baselines3's policy for dictionaries."""
    from stable_baselines3 import PPO

    env = gym.make(PUSH, obs_type="pixels", pixel_size=48, fidelity="fast")
    learner = PPO("MultiInputPolicy", env, n_steps=16, batch_size=16, n_epochs=1, device="cpu")
    learner.learn(32)
    action, _ = learner.predict(env.reset(seed=0)[0])
    assert env.action_space.contains(action)

"""Environments draw what happens, in a window or not, and can be filmed."""

import itertools
import os
import subprocess
import sys
import warnings

import gymnasium as gym
import imageio.v2 as imageio
import numpy as np
import pygame
import pytest
from gymnasium.wrappers import RecordVideo
from gymnasium.wrappers.vector import RecordVideo as RecordVectorVideo

from physics import World
from rigid_envs.rendering import scene_view
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.cameras import NAMED, choose_camera, following
from rigid_envs.rendering.renderer import grid
from rigid_envs.rendering.view import BODY_COLORS, GOAL_COLOR, OBSERVED_COLORS, Mark
from rigid_envs.tasks import Push, PushT, Reach, Slide, Stack, Throw
from tests.rigid_envs.rollout import (
    IDS,
    PUSH,
    REACH,
    STACK,
    make,
    make_vec,
    random_actions,
)

FRAME = (480, 480, 3)


@pytest.mark.parametrize("env_id", IDS)
def test_a_picture_follows_the_world(env_id):
    env = make(env_id, render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    np.testing.assert_array_equal(env.render(), before)
    env.step(np.ones(env.action_space.shape))
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


def test_a_window_shows_many_worlds_as_a_grid(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    envs = make_vec(3, render_mode="human", width=64, height=64)
    envs.reset(seed=0)
    assert envs.render() is None
    assert pygame.display.get_surface().get_size() == (128, 128)
    envs.close()
    assert not pygame.display.get_init()


def length_and_size(film):
    """Frames of an mp4, and their width and height."""
    reader = imageio.get_reader(film, format="FFMPEG")
    with reader:
        return reader.count_frames(), reader.get_meta_data()["source_size"]


@pytest.mark.parametrize("env_id", [PUSH, STACK])
def test_an_episode_of_one_world_can_be_filmed(env_id, tmp_path):
    env = gym.make(env_id, render_mode="rgb_array", max_episode_steps=8)
    env = RecordVideo(
        env, str(tmp_path / "films"), episode_trigger=lambda _: True, disable_logger=True
    )
    env.reset(seed=0)
    truncated = False
    while not truncated:
        truncated = env.step(env.action_space.sample())[3]
    env.close()
    (film,) = tmp_path.glob("films/*.mp4")
    assert length_and_size(film) == (9, (480, 480))  # the start, and a frame a step


@pytest.mark.parametrize("env_id", [PUSH, STACK])
def test_episodes_of_many_worlds_can_be_filmed(env_id, tmp_path):
    envs = make_vec(4, env_id, render_mode="rgb_array", max_episode_steps=8, width=160, height=160)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        envs = RecordVectorVideo(
            envs, str(tmp_path / "films"), episode_trigger=lambda k: k == 0, disable_logger=True
        )
    envs.reset(seed=0)
    for _ in range(12):
        envs.step(envs.action_space.sample())
    envs.close()
    (film,) = tmp_path.glob("films/*.mp4")
    assert length_and_size(film) == (9, (320, 320))


def test_of_many_worlds_all_are_drawn():
    envs = make_vec(40, render_mode="rgb_array", width=64, height=64, fidelity="fast")
    envs.reset(seed=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(envs.render()) == 40
    some = make_vec(
        40, render_mode="rgb_array", width=64, height=64, render_worlds=20, fidelity="fast"
    )
    some.reset(seed=0)
    with pytest.warns(UserWarning, match=r"render_worlds=20 of 40 worlds; RecordVideo"):
        frames = some.render()
    assert len(frames) == 20
    assert np.array_equal(frames[19], envs.render()[19])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        some.render()  # said once


def test_more_worlds_than_a_window_shows_can_be_filmed(tmp_path):
    """Gymnasium's wrappers want a frame of every world."""
    size = {"width": 32, "height": 32, "max_episode_steps": 2}
    envs = RecordVectorVideo(
        make_vec(20, render_mode="rgb_array", **size),
        str(tmp_path / "films"),
        episode_trigger=lambda k: k == 0,
        disable_logger=True,
    )
    envs.reset(seed=0)
    for _ in range(4):
        envs.step(envs.action_space.sample())
    envs.close()
    (film,) = tmp_path.glob("films/*.mp4")
    assert length_and_size(film)[1] == (160, 128)


@pytest.mark.parametrize("env_id", [one for one in IDS if one != REACH])  # there nothing touches
@pytest.mark.parametrize("option", ["show_forces", "show_particles"])
def test_one_world_and_many_draw_alike(env_id, option):
    """Contact forces of what lies on the ground and in a hand; what solids touch with."""
    one = make(env_id, render_mode="rgb_array", **{option: True})
    many = make_vec(2, env_id, render_mode="rgb_array", **{option: True})
    plain = make(env_id, render_mode="rgb_array")
    still = np.zeros(one.action_space.shape)
    still[3:] = -1.0
    for env in (one, many, plain):
        env.reset(seed=4)
        for _ in range(2):
            env.step(np.stack([still, still]) if env is many else still)
    np.testing.assert_array_equal(many.render()[0], one.render())
    assert (one.render() != plain.render()).any()


# --- what there is to see ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["task", *NAMED])
@pytest.mark.parametrize(
    "task", [Push(), PushT(), Reach(), Slide(), Stack(5), Throw()], ids=lambda t: type(t).__name__
)
def test_every_camera_sees_the_whole_task(task, name):
    world = World(task.scene())
    draws = np.random.default_rng(0).random((1, 200, task.draw_count))[0]
    points = []
    for row in draws:
        goal = task.start(world, np.ones(1, dtype=bool), row[None])[0]
        places = goal[[unit == "m" for _, unit, *_ in task.goal_bounds]]
        if len(places) == 2:  # a pose in the plane
            places = np.append(places, 0.0)
        points += [*world.position[0], *world.drive_position[0], *places.reshape(-1, 3)]
    pixels, _ = choose_camera(name, task).project(np.array(points), 480, 480)
    assert pixels.min() > 10
    assert pixels.max() < 470


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("task", [Slide(), Throw()], ids=lambda t: type(t).__name__)
def test_a_workspace_is_seen_in_a_narrow_picture(task, name):
    corners = np.array(np.meshgrid(*np.transpose(task.workspace))).reshape(3, 8).T
    pixels, _ = choose_camera(name, task, 240 / 480).project(corners, 240, 480)
    assert pixels.min() > 0
    assert (pixels < (240, 480)).all()


@pytest.mark.parametrize(
    "workspace", [((0.0, 0.0, 0.0), (1.0, 1.0)), ((0.0, 0.0, 1.0), (1.0, 1.0, 0.0))]
)
def test_an_invalid_workspace_is_named(workspace):
    class Other(Push):
        pass

    Other.workspace = workspace
    with pytest.raises(ValueError, match=r"Task\.workspace must be"):
        choose_camera("front", Other())


@pytest.mark.parametrize(
    ("task", "low", "high"),
    [
        # as high as where it starts; a picture of all that it can reach would be mostly floor
        (Push(), Push.finger.low, (*Push.finger.high[:2], Push.finger.home[2])),
        (PushT(), PushT.finger.low, PushT.finger.high),
        (Reach(), Reach.finger.low, Reach.finger.high),
        (Slide(), Slide.finger.low, (*Slide.finger.high[:2], Slide.finger.home[2])),
        (Stack(), Stack.hand.low, Stack.hand.high),
        (Throw(), Throw.hand.low, Throw.hand.high),
    ],
    ids=["Push", "PushT", "Reach", "Slide", "Stack", "Throw"],
)
def test_the_camera_sees_the_tool_wherever_it_goes(task, low, high):
    places = np.array(list(itertools.product(*zip(low, high, strict=True))))
    pixels, _ = task.camera.project(places, 480, 480)
    assert pixels.min() > 5
    assert pixels.max() < 475


@pytest.mark.parametrize("blocks", [2, 5])
def test_a_tower_has_a_ghost_for_each_cube_in_its_colour(blocks):
    env = make("RigidEnvs/Stack-v0", blocks=blocks)
    env.reset(seed=0)
    ghosts = scene_view.markers(env._runner, 0)
    assert [ghost.color for ghost in ghosts] == list(BODY_COLORS[:blocks])
    heights = [ghost.position[2] for ghost in ghosts]
    np.testing.assert_allclose(heights, 0.02 + 0.04 * np.arange(blocks), atol=1e-6)


def test_the_ghost_of_a_cube_is_green_where_the_cube_counts():
    env = make("RigidEnvs/Stack-v0", blocks=2)
    env.reset(seed=0)
    goal = env._runner.goals[0, :6].astype(float).reshape(2, 3)
    for off, color in ((0.019, GOAL_COLOR), (0.021, BODY_COLORS[1])):
        env._runner.world.set_state(position=goal + np.array([[0.5, 0.0, 0.0], [0.0, off, 0.0]]))
        colors = [ghost.color for ghost in scene_view.markers(env._runner, 0)]
        assert colors == [BODY_COLORS[0], color]


def test_people_see_through_what_nothing_touches_and_policies_see_what_they_know():
    runner = make("RigidEnvs/Stack-v0")._runner
    seen, observed = (
        scene_view.items(runner.world, np.zeros(1, dtype=int), observed=flag)
        for flag in (False, True)
    )
    assert {item.opacity for item in observed} == {1.0}
    assert [item.color for item in observed[:2]] == list(OBSERVED_COLORS[:2])
    assert [item.color for item in seen[:2]] == list(BODY_COLORS[:2])
    assert [item.opacity < 1.0 for item in seen] == [False] * 4 + [True] * 4


@pytest.mark.parametrize("env_id", IDS)
def test_a_camera_for_an_episode_just_sees_all_that_moves(env_id):
    env = make(env_id, render_mode="rgb_array", fidelity="fast")
    env.reset(seed=1)
    states = [env.get_state()]
    for _ in range(6):
        action = env.action_space.sample()
        env.step(action)
        states.append(env.get_state())
    camera = env.camera_for(states)
    last = env.get_state()
    assert all(np.array_equal(last[name], states[-1][name]) for name in ("elapsed", "goals"))
    ends = []
    for state in states:
        env.set_state(state)
        engine = env._runner.world
        places = np.concatenate([engine.position[0], engine.drive_position[0]])
        pixels, depth = camera.project(places, 100, 100)
        assert (depth > 0.0).all()
        assert 5.0 < pixels.min() <= pixels.max() < 95.0
        ends.append(env._pictures.points(arms=state is states[0]))
    pixels, _ = camera.project(np.concatenate(ends), 100, 100)
    assert max(50.0 - pixels.min(), pixels.max() - 50.0) == pytest.approx(42.5, abs=0.5)
    before = env.render()
    env.camera = camera
    assert env.camera == camera
    assert (env.render() != before).any()
    env.camera = "task"
    np.testing.assert_array_equal(env.render(), before)
    with pytest.raises(ValueError, match="states must be at least one"):
        env.camera_for([])
    with pytest.raises(TypeError, match="a list of states, got a single one"):
        env.camera_for(states[0])
    many = make_vec(2, env_id, render_mode="rgb_array", fidelity="fast")
    many.reset(seed=1)
    before = many.render()[1]
    many.camera = "top"
    assert (many.render()[1] != before).any()


def test_a_cross_shows_where_the_ball_landed_and_stays_there():
    env = make("RigidEnvs/Throw-v0")
    env.reset(seed=0)
    assert not any(isinstance(marker, Mark) for marker in scene_view.markers(env._runner, 0))
    for _ in range(12):  # down and away
        observation, *_ = env.step(np.array([1.0, 0.0, 0.0, 1.0]))
    for _ in range(3):
        (mark,) = [m for m in scene_view.markers(env._runner, 0) if isinstance(m, Mark)]
        np.testing.assert_allclose(mark.position, observation["achieved_goal"], atol=1e-6)
        env.step(np.array([1.0, 0.0, 0.0, 1.0]))


def test_a_gripper_hangs_from_an_arm_that_follows_its_fingers():
    env = make("RigidEnvs/Stack-v0")
    env.reset(seed=0)
    before = [item.position[0] for item in scene_view.items(env._runner.world, np.zeros(1, int))]
    env.step(np.array([0.0, 0.0, 1.0, 1.0]))
    after = [item.position[0] for item in scene_view.items(env._runner.world, np.zeros(1, int))]
    assert len(after) == 2 + 2 + 4  # cubes, pads, and two fingers, a bar and a post
    rise = np.array(after)[2:, 2] - np.array(before)[2:, 2]
    assert rise.min() > 0.01
    np.testing.assert_allclose(rise, rise[0], atol=1e-9)


def test_forces_of_two_solids_are_summed_and_act_on_the_body():
    env = make("RigidEnvs/Push-v0", fidelity="accurate")
    env.reset(seed=0)
    for _ in range(5):
        env.step(np.zeros(3))
    (weight,) = scene_view.forces(env._runner.world, 0)
    np.testing.assert_allclose(
        weight.vector, (0, 0, 0.1 * 9.81 * scene_view.FORCE_SCALE), atol=1e-4
    )
    np.testing.assert_allclose(weight.origin[:2], env._runner.world.position[0, 0, :2], atol=1e-4)
    points = scene_view.forces(env._runner.world, 0, particles=True)
    assert len(points) > 1
    total = np.sum([arrow.vector for arrow in points], axis=0)
    np.testing.assert_allclose(total, weight.vector, atol=1e-12)


def test_an_environment_draws_without_pygame_a_banner_and_a_display():
    program = (
        "import sys\n"
        "import gymnasium as gym\n"
        f"env = gym.make('rigid_envs:{PUSH}', render_mode='rgb_array')\n"
        "env.reset(seed=0)\n"
        "assert env.render().std() > 1\n"
        "assert 'pygame' not in sys.modules\n"
    )
    environment = {k: v for k, v in os.environ.items() if "SDL" not in k and k != "DISPLAY"}
    environment.pop("PYGAME_HIDE_SUPPORT_PROMPT", None)
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == ""


def test_a_following_camera_keeps_ball_and_target_in_the_picture_on_the_whole_way():
    task, draws = Throw(), np.random.default_rng(1).random((50, 2))
    env = make_vec(50, "RigidEnvs/Throw-v0", fidelity="fast")
    env.reset(seed=0)
    goals = task.start(env._runner.world, np.ones(50, dtype=bool), draws)
    for ball in env._runner.world.position[:, 0]:
        for goal in goals:
            for share in (0.0, 0.5, 1.0):  # of the way from the hand to the target
                place = ball + share * (goal - ball) + (0.0, 0.0, share * (1.0 - share))
                camera = following(task.camera, place, goal)
                pixels, depth = camera.project(np.array([place, goal]), 480, 480)
                assert pixels.min() > 5
                assert pixels.max() < 475
                assert 480 * 0.04 * camera.focal_length(1) / depth[0] > 18  # pixels of the ball


def test_a_following_camera_moves_with_the_ball_of_each_world_until_it_lands():
    options = {"render_mode": "rgb_array", "width": 96, "height": 96}
    moving, still = (
        make_vec(2, "RigidEnvs/Throw-v0", camera=name, fidelity="fast", **options)
        for name in ("follow", "task")
    )
    for envs in (moving, still):
        envs.reset(seed=3)
    before = moving.render()
    places = moving._runner.world.position[:, 0] + [[0.3, 0.0, 0.0], [0.0, 0.0, 0.0]]
    moving._runner.world.set_state(position=places[:, None])
    after = moving.render()
    assert (before[0] != after[0]).any()
    np.testing.assert_array_equal(before[1], after[1])
    assert (before[0] != still.render()[0]).any()
    assert moving.camera == still.camera
    moving._runner.world.set_state(position=(0.5, 0.0, 0.1), linear_velocity=(2.0, 0.0, 0.0))
    moving._runner.world.advance(1.0)
    landed = moving.render()
    moving._runner.world.advance(0.2)
    assert (moving._runner.world.position[:, 0, 0] > 1.0).all()
    corner = np.s_[:40, :40]  # of the sky and the ground beyond
    np.testing.assert_array_equal(moving.render()[0][corner], landed[0][corner])


@pytest.mark.parametrize("away", [0.0, 0.5, 2.0, 6.0])
def test_a_following_camera_keeps_a_ball_that_rolls_on_in_the_picture(away):
    landed, goal = np.array([0.9, 0.1, 0.02]), np.array([0.85, 0.05, 0.0])
    ball = landed + np.array([away, 0.4 * away, 0.0])
    camera = following(Throw().camera, landed, goal, body=ball)
    pixels, depth = camera.project(np.array([landed, goal, ball]), 480, 480)
    assert (depth > 0.0).all()
    assert 5 < pixels.min() <= pixels.max() < 475


@pytest.mark.parametrize("shape", [0.5, 1.0, 2.0])
def test_a_following_camera_sees_both_in_a_picture_of_any_shape_above_any_ground(shape):
    own = Camera.around((0.0, 0.0, 0.6), 1.0, 30.0, 1.0)
    place, goal = np.array([0.5, 0.0, -3.0]), np.array([-0.4, 0.3, 0.5])
    assert following(own, place, goal, 0.5, shape).eye[2] > 0.5
    place[2] = 0.6
    camera = following(own, place, goal, 0.5, shape)
    pixels, _ = camera.project(np.array([place, goal]), round(200 * shape), 200)
    assert pixels.min() > 0
    assert (pixels < [round(200 * shape), 200]).all()

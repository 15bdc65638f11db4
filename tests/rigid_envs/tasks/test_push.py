"""Push is a fair task: nothing is solved by chance, and its physics allows it to be solved."""

import functools
import itertools

import numpy as np
import pytest

from rigid_envs.episodes.draws import uniform
from rigid_envs.tasks.push import (
    GOAL_DRAWS,
    HALF,
    HEADING_LENGTH,
    POST_CLEARANCE,
    POST_RADIUS,
    POSTS,
    RANGE,
    THRESHOLD,
    Push,
    heading,
)
from rigid_envs.tasks.rewards import distance
from tests.rigid_envs.rollout import (
    EPISODE,
    PRESETS,
    PUSH,
    assert_same,
    make,
    make_vec,
    random_actions,
    steps_of,
)
from training.scripted import controller_for
from training.scripted.push import push

CORNERS = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
OPTIONS = [
    {"target_yaw": True},
    {"obstacles": 1},
    {"obstacles": 4},
    {"target_yaw": True, "obstacles": 2},
]


def test_no_episode_starts_solved():
    observation, info = make_vec(5000).reset(seed=0)
    assert not info["is_success"].any()
    apart = distance(observation["achieved_goal"], observation["desired_goal"])
    assert apart.min() > THRESHOLD


def test_starts_and_goals_fill_the_square():
    observation, _ = make_vec(5000).reset(seed=0)
    for key in ("achieved_goal", "desired_goal"):
        place = observation[key]
        assert np.abs(place[:, :2]).max() <= RANGE
        assert np.abs(place[:, :2]).max() > 0.99 * RANGE
        np.testing.assert_allclose(place[:, :2].mean(axis=0), 0.0, atol=5 * RANGE / 3**0.5 / 70)
        np.testing.assert_allclose(place[:, 2], HALF, atol=1e-6)


def test_a_goal_is_away_from_the_cube_even_if_all_drawn_goals_are_near():
    envs = make_vec(4)
    envs.reset(seed=0)
    corners = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    draws = np.concatenate([corners, np.zeros((4, 1)), np.tile(corners, (1, GOAL_DRAWS))], axis=1)
    assert draws.shape[1] == Push.draw_count
    goals = Push().start(envs._runner.world, np.ones(4, dtype=bool), draws)
    cubes = envs._runner.world.position[:, 0]
    assert distance(goals, cubes).min() > THRESHOLD
    assert np.abs(goals[:, :2]).max() <= RANGE


def test_the_draws_of_an_episode_are_its_start():
    observation, _ = make_vec(10).reset(seed=40)
    draws = uniform(np.arange(40, 50), np.zeros(10, dtype=int), Push.draw_count)
    expected = RANGE * (2.0 * draws[:, :2] - 1.0)
    np.testing.assert_allclose(observation["achieved_goal"][:, :2], expected, rtol=1e-6)


def test_the_observation_matches_the_names_in_its_bounds():
    envs = make_vec(30)
    envs.reset(seed=0)
    world = envs._runner.world
    for observation, *_ in steps_of(envs, random_actions(40, 30)):
        seen = dict(zip([b[0] for b in Push.bounds], observation["observation"].T, strict=True))
        for i, axis in enumerate("xyz"):
            finger, cube = world.drive_position[:, 0, i], world.position[:, 0, i]
            np.testing.assert_allclose(seen[f"finger {axis}"], finger, atol=1e-6)
            np.testing.assert_allclose(seen[f"cube {axis}"], cube, atol=1e-6)
            np.testing.assert_allclose(seen[f"finger to cube {axis}"], cube - finger, atol=1e-6)
            velocity = world.linear_velocity[:, 0, i]
            np.testing.assert_allclose(seen[f"cube velocity {axis}"], velocity, atol=1e-5)
        assert (seen["cube quaternion w"] >= 0.0).all()
        np.testing.assert_array_equal(
            observation["achieved_goal"], observation["observation"][:, 6:9]
        )


def test_a_full_action_moves_the_finger_by_five_centimetres():
    envs = make_vec(2)
    envs.reset(seed=0)
    action = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    seen = [result[0]["observation"][:, :3] for result in steps_of(envs, np.stack([action] * 4))]
    moved = np.diff(seen, axis=0)[1:]  # the first step spends some of it on getting up to speed
    np.testing.assert_allclose(moved, np.broadcast_to(0.05 * action, moved.shape), atol=0.01)


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_scripted_controller_solves_it(fidelity, stress):
    worlds = 1000 if stress or fidelity in ("fast", "balanced") else 256
    envs = make_vec(worlds, fidelity=fidelity)
    observation, _ = envs.reset(seed=0)
    for _ in range(EPISODE):
        observation, _, _, truncated, info = envs.step(controller_for(PUSH)(observation))
    assert truncated.all()
    assert info["is_success"].mean() >= 0.99


# --- options ------------------------------------------------------------------------------------


def spun(angle: float | np.ndarray, axis: int) -> np.ndarray:
    """Quaternion [..., 4] of a turn by an angle [...] about an axis of the world."""
    turn = np.zeros((*np.shape(angle), 4))
    turn[..., axis], turn[..., 3] = np.sin(0.5 * np.asarray(angle)), np.cos(0.5 * np.asarray(angle))
    return turn


def after(second: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Quaternion [..., 4] of one turn after another."""
    a, b, w, v = second[..., :3], first[..., :3], second[..., 3:], first[..., 3:]
    return np.concatenate(
        [w * b + v * a + np.cross(a, b), w * v - np.sum(a * b, axis=-1, keepdims=True)], axis=-1
    )


def clear_of_posts(places: np.ndarray, obstacles: int) -> np.ndarray:
    """[n] m, to the middle of the nearest post."""
    return np.linalg.norm(places[:, None, :2] - POSTS[:obstacles], axis=2).min(axis=1, initial=1.0)


def test_default_options_change_nothing():
    plain, explicit = Push(), Push(target_yaw=False, obstacles=0)
    assert plain.draw_count == explicit.draw_count == 3 + 2 * GOAL_DRAWS
    assert plain.goal_bounds == explicit.goal_bounds == Push.goal_bounds
    assert len(plain.goal_bounds) == 3
    scene = explicit.scene()
    assert (len(scene.bodies), len(scene.statics), len(scene.drives)) == (1, 1, 1)
    envs = make_vec(20), make_vec(20, target_yaw=False, obstacles=0)
    assert_same(envs[0].reset(seed=0), envs[1].reset(seed=0))
    for actions in random_actions(10, 20):
        assert_same(envs[0].step(actions), envs[1].step(actions))


@pytest.mark.parametrize("options", OPTIONS)
def test_options_change_neither_the_numbers_drawn_before_nor_the_observation(options):
    plain, other = make_vec(200).reset(seed=0)[0], make_vec(200, **options).reset(seed=0)[0]
    assert plain["observation"].shape == other["observation"].shape
    before, after = plain["achieved_goal"], other["achieved_goal"][:, :3]
    clear = clear_of_posts(before, options.get("obstacles", 0)) > POST_CLEARANCE
    np.testing.assert_array_equal(before[clear], after[clear])
    assert clear.mean() > 0.5


@pytest.mark.parametrize("options", OPTIONS)
def test_with_options_no_episode_starts_solved_or_near_a_post(options):
    observation, info = make_vec(5000, **options).reset(seed=0)
    assert not info["is_success"].any()
    for key in ("achieved_goal", "desired_goal"):
        place = observation[key]
        assert np.abs(place[:, :2]).max() <= RANGE
        assert np.abs(place[:, :2]).max() > 0.99 * RANGE
        if "obstacles" in options:
            assert clear_of_posts(place, options["obstacles"]).min() >= POST_CLEARANCE - 1e-6
    apart = observation["achieved_goal"] - observation["desired_goal"]
    assert np.linalg.norm(apart[:, :3], axis=1).min() > THRESHOLD


def test_a_cube_clear_of_a_post_does_not_touch_it_at_any_yaw():
    assert np.sqrt(2.0) * HALF + POST_RADIUS < POST_CLEARANCE


@pytest.mark.parametrize("obstacles", [1, 2, 3, 4])
def test_starts_and_goals_are_clear_of_posts_even_if_no_drawn_place_is(obstacles):
    envs = make_vec(obstacles, obstacles=obstacles)
    envs.reset(seed=0)
    task = envs._runner.task
    on_post = 0.5 * POSTS[:obstacles] / RANGE + 0.5
    draws = np.zeros((obstacles, task.draw_count))
    draws[:, :2], draws[:, 3:] = on_post, np.tile(on_post, (1, 2 * GOAL_DRAWS))
    goals = task.start(envs._runner.world, np.ones(obstacles, dtype=bool), draws)
    cubes = envs._runner.world.position[:, 0]
    for place in (goals, cubes):
        assert clear_of_posts(place, obstacles).min() > POST_CLEARANCE
    assert distance(goals, cubes).min() > THRESHOLD


def test_goal_yaws_fill_a_quarter_turn():
    goal = make_vec(5000, target_yaw=True).reset(seed=0)[0]["desired_goal"]
    np.testing.assert_allclose(np.linalg.norm(goal[:, 3:], axis=1), HEADING_LENGTH, rtol=1e-6)
    yaw = np.mod(np.degrees(0.25 * np.arctan2(goal[:, 4], goal[:, 3])), 90.0)
    fraction = np.histogram(yaw, bins=6, range=(0.0, 90.0))[0] / 5000
    np.testing.assert_allclose(fraction, 1.0 / 6.0, atol=0.03)


def test_a_cube_that_lies_on_any_face_has_the_heading_of_its_yaw():
    yaw = np.radians(np.linspace(-180.0, 180.0, 49))
    expected = HEADING_LENGTH * np.stack([np.cos(4.0 * yaw), np.sin(4.0 * yaw)], axis=1)
    quarters = 0.5 * np.pi * np.arange(4)
    for a, b, c in itertools.product(quarters, repeat=3):  # these take a cube onto itself
        onto_itself = after(spun(a, 2), after(spun(b, 1), spun(c, 0)))
        turned = after(spun(yaw, 2), onto_itself[None])
        np.testing.assert_allclose(heading(turned), expected, atol=1e-9)


def test_a_tilted_cube_has_a_shorter_heading_and_none_on_a_corner():
    tilt = np.radians(np.linspace(0.0, 45.0, 10))
    length = np.linalg.norm(heading(spun(tilt, 0)), axis=1)
    assert length[0] == pytest.approx(HEADING_LENGTH)
    assert (np.diff(length) < 0.0).all()
    on_corner = after(spun(np.array([np.arctan(np.sqrt(0.5))]), 1), spun(np.array([np.pi / 4]), 0))
    np.testing.assert_allclose(heading(on_corner), 0.0, atol=1e-9)
    turns = np.random.default_rng(0).normal(size=(1000, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    assert np.linalg.norm(heading(turns), axis=1).max() <= HEADING_LENGTH * (1.0 + 1e-9)


@pytest.mark.parametrize("degrees", [-44, -16, -14, 0, 14, 16, 44, 76, 104, 180, 270])
def test_a_yaw_within_fifteen_degrees_counts_and_so_does_a_quarter_turn_more(degrees):
    env = make(target_yaw=True, reward_type="dense")
    env.reset(seed=4)
    goal = env._runner.goals[0].astype(float)
    yaw = 0.25 * np.arctan2(goal[4], goal[3]) + np.radians(degrees)
    env._runner.world.set_state(position=goal[None, None, :3], orientation=spun(yaw, 2)[None, None])
    info = env.step(np.zeros(3))[4]
    assert info["is_success"] == (abs((degrees + 45) % 90 - 45) <= 15)


def test_dots_mark_the_corners_of_a_cube_at_the_goal_yaw():
    env = make(target_yaw=True)
    env.reset(seed=4)
    goal = env._runner.goals[0].astype(float)
    _, *dots = env._runner.task.markers(env._runner.world, 0, goal)
    yaw = 0.25 * np.arctan2(goal[4], goal[3])
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = goal[:2] + CORNERS[::2, :2] @ turn.T
    marked = np.array([dot.position[:2] for dot in dots])
    apart = np.linalg.norm(corners[:, None] - marked, axis=2)
    np.testing.assert_allclose(apart.min(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(apart.min(axis=1), 0.0, atol=1e-9)


def test_reach_does_not_depend_on_the_goal_yaw():
    plain, other = make_vec(50), make_vec(50, target_yaw=True)
    for envs in (plain, other):
        envs.reset(seed=0)
    for actions in random_actions(20, 50):
        expected = plain.step(actions)[4]["reach"]
        np.testing.assert_allclose(other.step(actions)[4]["reach"], expected, atol=1e-6)


@pytest.mark.parametrize("fidelity", PRESETS)
def test_posts_hold_a_cube_that_is_pushed_at_them(fidelity):
    pressed_in = {"fast": 0.006}.get(fidelity, 0.004)
    envs = make_vec(4, obstacles=4, fidelity=fidelity, max_episode_steps=-1)
    envs.reset(seed=0)
    away = POSTS / np.linalg.norm(POSTS, axis=1, keepdims=True)
    position, finger = np.full((4, 1, 3), HALF), np.full((4, 1, 3), HALF)
    position[:, 0, :2], finger[:, 0, :2] = POSTS - 0.06 * away, POSTS - 0.12 * away
    world = envs._runner.world
    world.set_state(position=position, drive_position=finger)
    envs._runner._now = world.read()
    for _ in range(25):
        observation = envs.step(np.concatenate([0.4 * away, np.zeros((4, 1))], axis=1))[0]
        cube = observation["achieved_goal"].astype(float)
        assert clear_of_posts(cube, 4).min() > HALF + POST_RADIUS - pressed_in


@pytest.mark.parametrize("options", [*OPTIONS, {"block": "t"}])
def test_with_options_a_random_policy_hardly_ever_solves_it(options, stress):
    worlds = 1000 if stress else 400
    envs = make_vec(worlds, **options)
    envs.reset(seed=0)
    for actions in np.random.default_rng(0).uniform(-1.0, 1.0, (EPISODE, worlds, 3)):
        info = envs.step(actions)[4]
    assert info["is_success"].mean() < 0.02


@pytest.mark.parametrize(
    ("options", "least"),
    [
        ({"target_yaw": True}, 0.98),
        ({"obstacles": 2}, 0.98),
        ({"obstacles": 4}, 0.98),
        ({"target_yaw": True, "obstacles": 2}, 0.96),
        ({"target_yaw": True, "obstacles": 4}, 0.9),
    ],
)
def test_the_scripted_controller_solves_every_option(options, least, stress):
    envs = make_vec(500 if stress else 200, **options)
    controller = functools.partial(push, obstacles=options.get("obstacles", 0))
    observation, _ = envs.reset(seed=0)
    for _ in range(EPISODE):
        observation, _, _, _, info = envs.step(controller(observation))
    assert info["is_success"].mean() >= least


@pytest.mark.parametrize(
    ("option", "error", "match"),
    [
        ({"obstacles": -1}, ValueError, "obstacles must be at least 0, got -1"),
        ({"obstacles": 5}, ValueError, "obstacles must be at most 4, got 5"),
        ({"obstacles": 1.5}, TypeError, "obstacles must be an integer, got 1.5"),
        ({"obstacles": True}, TypeError, "obstacles must be an integer, got True"),
        ({"target_yaw": 1}, TypeError, "target_yaw must be bool, got 1"),
        ({"target_yaw": "yes"}, TypeError, "target_yaw must be bool, got 'yes'"),
        ({"obstacle": 2}, TypeError, "did you mean 'obstacles'"),
    ],
)
def test_an_invalid_option_raises_an_error_that_names_it(option, error, match):
    with pytest.raises(error, match=match):
        make(**option)

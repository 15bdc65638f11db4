"""Randomised episodes: what is drawn, that seeds reproduce it, and which ranges raise."""

import copy
import pickle
import re

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import rigid_envs  # noqa: F401
from rigid_envs.episodes.draws import normal, uniform
from rigid_envs.episodes.runner import Runner
from rigid_envs.rendering import scene_view
from rigid_envs.tasks import Push
from training.scripted import controller_for

RANGES = {
    "mass": (0.5, 2.0),
    "friction": (0.2, 1.0),
    "restitution": (0.0, 0.5),
    "size": (0.75, 1.25),
    "noise": (0.0, 0.2),
}
PUSH, STACK, THROW = (f"RigidEnvs/{task}-v0" for task in ("Push", "Stack", "Throw"))


def actions(steps, count, seed=0, size=3):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (steps, count, size)).astype(np.float32)


def vector(count, **arguments):
    return gym.make_vec(PUSH, num_envs=count, **{"randomize": RANGES, **arguments})


def played(env, steps, options=None):
    """Observations of a rollout of a vector environment."""
    seen = [env.reset(seed=5, options=options)[0]["observation"]]
    seen += [env.step(a)[0]["observation"] for a in actions(steps, env.num_envs)]
    return np.stack(seen)


def test_every_episode_draws_its_own_parameters_within_the_ranges():
    runner = Runner("push", 500, randomize=RANGES)
    runner.reset(np.ones(500, dtype=bool), np.arange(500))
    first = runner.world.parameters
    for name, base in (("mass", 0.1), ("friction", 1.0), ("restitution", 1.0), ("size", 1.0)):
        low, high = (base * end for end in RANGES[name])
        values = getattr(first, name)
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < values.max() <= high
        assert values.mean() == pytest.approx(0.5 * (low + high), rel=0.05)
    runner.reset(np.arange(500) < 250)
    assert np.all(runner.world.parameters.mass[:250] != first.mass[:250])
    np.testing.assert_array_equal(runner.world.parameters.mass[250:], first.mass[250:])


def test_a_world_of_many_is_bitwise_identical_to_the_single_environment():
    count, steps = 9, 60
    many = played(vector(count, observe_parameters=True, max_episode_steps=25), steps)
    for i in (0, 5, 8):
        one = gym.make(PUSH, randomize=RANGES, observe_parameters=True).unwrapped
        observation, _ = one.reset(seed=5 + i)
        assert observation["observation"].tobytes() == many[0, i].tobytes()
        taken, ended = 0, False
        for step, action in enumerate(actions(steps, count)[:, i]):
            if ended:  # the vector environment's step is then the reset
                observation, _ = one.reset()
                taken = 0
            else:
                observation, *_ = one.step(action)
                taken += 1
            ended = taken == 25
            assert observation["observation"].tobytes() == many[step + 1, i].tobytes()


def test_a_cube_of_another_size_lies_on_the_ground():
    runner = Runner("push", 100, randomize={"size": (0.6, 1.5)})
    runner.reset(np.ones(100, dtype=bool), np.arange(100))
    half = 0.02 * runner.world.parameters.size[:, 0]
    np.testing.assert_allclose(runner.world.position[:, 0, 2], half, rtol=1e-14)
    np.testing.assert_allclose(runner.goals[:, 2], half, rtol=1e-6)
    runner.world.advance(0.5)
    np.testing.assert_allclose(runner.world.position[:, 0, 2], half, atol=5e-4)


def test_cubes_of_other_sizes_lie_on_the_ground_and_fit_their_tower():
    runner = Runner("stack", 100, randomize={"size": (0.75, 1.4)}, blocks=3)
    runner.reset(np.ones(100, dtype=bool), np.arange(100))
    world, half = runner.world, 0.02 * runner.world.parameters.size
    assert np.abs(half[:, 0] - half[:, 1]).max() > 0.01  # each cube has its own
    np.testing.assert_allclose(world.position[:, :, 2], half, rtol=1e-14)
    tower = runner.goals[:, :-1].reshape(100, 3, 3).astype(float)
    np.testing.assert_allclose(tower[:, 0, 2], half[:, 0], rtol=1e-6)
    for level in (1, 2):  # a face on a face
        apart = tower[:, level, 2] - tower[:, level - 1, 2]
        np.testing.assert_allclose(apart, half[:, level] + half[:, level - 1], rtol=1e-6)
    world.advance(0.5)
    np.testing.assert_allclose(world.position[:, :, 2], half, atol=5e-4)
    world.set_state(position=tower)
    for _ in range(5):
        info = runner.step(np.zeros((100, 4))).info
    assert info["is_success"].all()
    np.testing.assert_allclose(world.position, tower, atol=3e-3)  # contacts yield under the load


def test_no_stack_of_other_sizes_starts_solved_and_open_fingers_have_room():
    """At both ends of the size range: the first cube is a threshold high, and fingers fit."""
    for size in (0.5, 1.5):
        runner = Runner("stack", 500, randomize={"size": size}, blocks=5)
        runner.reset(np.ones(500, dtype=bool), np.arange(500))
        assert not runner.observe()[1]["is_success"].any()
    places = np.concatenate(
        [runner.world.position, runner.goals[:, None, :3].astype(float)], axis=1
    )[..., :2]
    hand = 0.5 * runner.task.hand.max_opening + 2.0 * runner.task.hand.PAD
    for i in range(6):
        for j in range(i):
            apart = np.abs(places[:, i] - places[:, j]).max(axis=1)
            assert apart.min() >= hand + 1.5 * 0.02 - 1e-6


@pytest.mark.parametrize(("fidelity", "yields"), [("fast", 1.5e-3), ("balanced", 1e-4)])
def test_a_ball_of_another_size_is_held_as_deep_and_stays(fidelity, yields):
    """The pads press as deep into any size, to round-off, and so no start depends on another."""
    # at "fast" a small ball must be heavier than that of the scene
    ranges = {"size": (0.5, 1.75), "mass": 2.0 if fidelity == "fast" else 1.0}
    runner = Runner("throw", 100, fidelity=fidelity, randomize=ranges)
    runner.reset(np.ones(100, dtype=bool), np.arange(100))
    world, radius = runner.world, 0.02 * runner.world.parameters.size[:, 0]
    np.testing.assert_allclose(runner.goals[:, 2], radius, rtol=1e-6)
    opening = runner.observe()[0]["observation"][:, 6]
    depth = radius - 0.5 * opening
    np.testing.assert_allclose(depth, depth[0], atol=1e-8)
    before = world.position[:, 0].copy()
    for _ in range(25):
        info = runner.step(np.tile([0.0, 0.0, 0.0, -1.0], (100, 1))).info
    assert not info["landed"].any()
    moved = world.position[:, 0] - before
    np.testing.assert_allclose(moved, np.tile(moved[0], (100, 1)), atol=1e-6)
    assert np.abs(moved).max() < 0.005
    gap = np.diff(world.drive_position[:, :, 1], axis=1)[:, 0] - 0.03
    np.testing.assert_allclose(radius - 0.5 * gap, depth, atol=yields)


def test_where_a_ball_of_another_size_would_land_is_known():
    runner = Runner("throw", 8, "dense", randomize={"size": (0.5, 1.75)})
    runner.reset(np.ones(8, dtype=bool), np.arange(8))
    world, desired = runner.world, runner.goals.astype(float)
    world.set_state(position=desired[:, None] + (0.0, 0.0, 0.3))
    world.advance(1e-3)
    runner._now = world.read()
    # straight down on the target, whose height is the ball's own radius
    assert np.abs(runner.observe()[1]["aim"]).max() < 1e-3


@pytest.mark.parametrize("env_id", [STACK, THROW])
def test_a_start_of_another_size_does_not_depend_on_other_worlds(env_id):
    """Nor do the steps after it. The test above does the same for Push, with more steps."""
    ranges = {**RANGES, "size": (0.8, 1.4)}
    many = gym.make_vec(env_id, num_envs=9, randomize=ranges)
    seen = [many.reset(seed=5)[0]]
    moves = actions(15, 9, size=4)
    seen += [many.step(action)[0] for action in moves]
    for i in (0, 8):
        one = gym.make(env_id, randomize=ranges)
        alone = [one.reset(seed=5 + i)[0], *(one.step(action)[0] for action in moves[:, i])]
        for a, b in zip(alone, seen, strict=True):
            for key, values in a.items():
                assert values.tobytes() == b[key][i].tobytes()


@pytest.mark.parametrize("env_id", [STACK, THROW])
def test_size_factors_of_one_change_no_bit(env_id):
    found = []
    for randomize in (None, {"size": 1.0}):
        env = gym.make_vec(env_id, num_envs=4, reward_type="dense", randomize=randomize)
        env.reset(seed=0)
        found.append([env.step(action)[:2] for action in actions(15, 4, size=4)])
    for (a, reward), (b, other) in zip(*found, strict=True):
        assert reward.tobytes() == other.tobytes()
        assert all(a[key].tobytes() == b[key].tobytes() for key in a)


@pytest.mark.parametrize(("env_id", "steps", "least"), [(STACK, 100, 0.98), (THROW, 50, 0.98)])
def test_a_scripted_controller_copes_with_other_sizes(env_id, steps, least):
    """It computes the sizes from the heights in the goal. 200 seeds."""
    env = gym.make_vec(env_id, num_envs=200, randomize={"size": (0.8, 1.2)})
    observation, _ = env.reset(seed=0)
    for _ in range(steps):
        observation, _, _, truncated, info = env.step(controller_for(env_id)(observation))
    assert truncated.all()
    assert info["is_success"].mean() >= least


def test_a_picture_shows_the_size_that_was_drawn():
    runner = Runner("push", 2, randomize={"size": (1.5, 1.5)})
    runner.reset(np.ones(2, dtype=bool), np.arange(2))
    world = np.array([1])
    cube = scene_view.items(runner.world, world)[0]
    np.testing.assert_allclose(cube.size * np.array(cube.shape.half_extents), 0.03)
    runner = Runner("stack", 2, randomize={"size": (0.8, 1.2)})
    runner.reset(np.ones(2, dtype=bool), np.arange(2))
    cubes = scene_view.items(runner.world, world)[:2]
    ghosts = runner.task.markers(runner.world, 1, runner.goals[1])
    for cube, ghost in zip(cubes, ghosts, strict=True):
        np.testing.assert_allclose(ghost.half_extents, cube.size * cube.shape.half_extents)


def test_observed_parameters_are_those_drawn_and_lie_in_the_space():
    env = vector(50, observe_parameters=True)
    observation, _ = env.reset(seed=0)
    own = env.unwrapped._runner.world.parameters
    seen = observation["observation"][:, -5:]
    for column, values in enumerate((own.mass, own.friction, own.restitution, own.size)):
        np.testing.assert_array_equal(seen[:, column], values[:, 0].astype(np.float32))
    assert env.observation_space.contains(observation)
    assert env.single_observation_space["observation"].shape == (27,)
    assert vector(1).single_observation_space["observation"].shape == (22,)
    names = [name for name, *_ in env.unwrapped._runner.bounds[-5:]]
    assert names == [*(f"body 0 {n}" for n in own._fields), "control noise"]


def test_without_randomisation_nothing_is_added_and_no_bit_changes():
    plain, none = (gym.make_vec(PUSH, num_envs=4, **extra) for extra in ({}, {"randomize": {}}))
    assert played(plain, 20).tobytes() == played(none, 20).tobytes()
    assert not none.unwrapped._runner.world.features.per_world_parameters
    assert not vector(
        2, randomize={"noise": 0.1}
    ).unwrapped._runner.world.features.per_world_parameters
    same = {"mass": (1.0, 1.0), "friction": 0.5, "restitution": 0.1, "size": 1.0}
    assert played(vector(4, randomize=same), 20).tobytes() == played(plain, 20).tobytes()


# --- noise --------------------------------------------------------------------------------------


def test_noise_is_gaussian_and_each_step_has_its_own():
    seeds, episodes = np.arange(20000), np.zeros(20000, dtype=int)
    values = normal(seeds, episodes, 3, 7)
    assert values.mean() == pytest.approx(0.0, abs=0.02)
    assert values.std() == pytest.approx(1.0, abs=0.02)
    assert np.mean(np.abs(values) < 1.0) == pytest.approx(0.6827, abs=0.01)
    other = normal(seeds, episodes, 3, 8)
    assert abs(np.corrcoef(values[:, 0], other[:, 0])[0, 1]) < 0.02
    assert values[17:18].tobytes() == normal(seeds[17:18], episodes[:1], 3, 7).tobytes()


def test_streams_leave_the_draws_of_starts_as_they_are():
    seeds, episodes = np.arange(5), np.arange(5)
    plain = uniform(seeds, episodes, 4)
    assert plain.tobytes() == uniform(seeds, episodes, 4, 0).tobytes()
    streams = np.array([0, 1, 2, 3, 4])
    mixed = uniform(seeds, episodes, 4, streams)
    for i in range(5):
        alone = uniform(seeds[i : i + 1], episodes[i : i + 1], 4, i)
        assert mixed[i].tobytes() == alone[0].tobytes()


def test_noise_moves_a_resting_finger_and_actions_stay_within_their_limits():
    still, shaken = vector(3, randomize={"noise": 0.0}), vector(3, randomize={"noise": 0.5})
    for env, moves in ((still, False), (shaken, True)):
        before = env.reset(seed=0)[0]["observation"][:, :3]
        after = env.step(np.zeros((3, 3), dtype=np.float32))[0]["observation"][:, :3]
        assert np.all(np.abs(after - before).max(axis=1) > 1e-3) == moves
    runner = Runner("push", 3, randomize={"noise": 5.0})
    runner.reset(np.ones(3, dtype=bool), np.arange(3))
    steps, seeds = np.zeros(3, dtype=int), np.arange(3)
    disturbed = runner.randomization.add_noise(np.ones((3, 3)), seeds, steps, steps)
    assert np.abs(disturbed).max() <= 1.0


# --- options, states ----------------------------------------------------------------------------


def test_options_set_the_ranges_of_the_reset_worlds_until_restored():
    env = gym.make_vec(PUSH, num_envs=4, autoreset_mode="Disabled")
    runner = env.unwrapped._runner
    env.reset(seed=0)
    mask = np.array([True, False, True, False])
    env.reset(options={"reset_mask": mask, "randomize": {"mass": (2.0, 3.0)}})
    mass = runner.world.parameters.mass[:, 0]
    assert np.all((mass[mask] >= 0.2) & (mass[mask] <= 0.3))
    assert np.all(mass[~mask] == 0.1)
    env.reset()
    assert np.all(runner.world.parameters.mass[mask, 0] != mass[mask])
    env.reset(options={"randomize": None})
    assert np.all(runner.world.parameters.mass == 0.1)


def test_worlds_that_are_not_reset_carry_on_to_the_last_bit_under_options():
    plain, other = (gym.make_vec(PUSH, num_envs=2, autoreset_mode="Disabled") for _ in range(2))
    for env in (plain, other):
        env.reset(seed=0)
        for action in actions(5, 2):
            env.step(action)
    mask = np.array([True, False])
    plain.reset(options={"reset_mask": mask})
    other.reset(options={"reset_mask": mask, "randomize": {"friction": (0.1, 0.2)}})
    for action in actions(10, 2, seed=1):
        a, b = (env.step(action)[0]["observation"][1] for env in (plain, other))
        assert a.tobytes() == b.tobytes()


@pytest.mark.parametrize("way", ["state", "pickle", "deepcopy"])
def test_states_and_copies_continue_bitwise_identically(way):
    env = vector(3, observe_parameters=True)
    played(env, 10)
    if way == "state":
        other = vector(3, observe_parameters=True)
        other.unwrapped.set_state(pickle.loads(pickle.dumps(env.unwrapped.get_state())))
    else:
        other = pickle.loads(pickle.dumps(env)) if way == "pickle" else copy.deepcopy(env)
    for action in actions(60, 3, seed=2):
        a, b = (each.step(action)[0]["observation"] for each in (env, other))
        assert a.tobytes() == b.tobytes()


def test_gymnasiums_checker_accepts_randomization(recwarn):
    env = gym.make(PUSH, randomize=RANGES, observe_parameters=True)
    check_env(env.unwrapped, skip_render_check=True)
    assert not [w for w in recwarn if issubclass(w.category, UserWarning)]


# --- errors ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ranges", "error", "message"),
    [
        ({"masss": (1, 2)}, ValueError, "randomize must be one of ['mass', 'friction', "),
        ({"mass": (0.0, 1.0)}, ValueError, "randomize['mass'] must be above 0, got (0.0, 1.0)"),
        ({"mass": (2.0, 1.0)}, ValueError, "randomize['mass'] must be (low, high) with low"),
        ({"mass": (1.0, 2.0, 3.0)}, ValueError, "randomize['mass'] must be (low, high) or a"),
        ({"mass": "heavy"}, TypeError, "randomize['mass'] must be a number, got 'heavy'"),
        ({"friction": (-0.1, 1)}, ValueError, "randomize['friction'] must be at least 0"),
        ({"restitution": (0, 1.5)}, ValueError, "at least 0 and at most 1, got (0, 1.5)"),
        ({"noise": (0, np.nan)}, ValueError, "randomize['noise'] high must be finite, got nan"),
        ({"size": (1e-4, 1)}, ValueError, "randomize={'size': (0.0001, 1"),
        ({"size": (1e-4, 1)}, ValueError, "is too small for Fidelity.substep"),
        ([("mass", (1, 2))], TypeError, "randomize must be a dict"),
    ],
)
def test_bad_ranges_are_named_at_construction_and_at_reset(ranges, error, message):
    with pytest.raises(error, match=re.escape(message)):
        Runner("push", 1, randomize=ranges)
    env = gym.make(PUSH).unwrapped
    env.reset(seed=0)
    before = env.get_state()
    with pytest.raises(error, match=re.escape(message)):
        env.reset(seed=1, options={"randomize": ranges})
    after = env.get_state()
    for name in ("seeds", "episodes", "elapsed", "goals", "drawn", "ranges"):
        np.testing.assert_array_equal(before[name], after[name])


def test_a_task_without_bodies_draws_only_noise():
    Runner("reach", 1, randomize={"noise": (0.0, 0.1)})
    with pytest.raises(ValueError, match=r"randomize\['mass'\]: this task has no bodies, got 2"):
        Runner("reach", 1, randomize={"noise": 0.1, "mass": 2.0})


def test_a_task_for_one_size_accepts_no_other():
    class OneSize(Push):
        size_range = None

    with pytest.raises(ValueError, match=r"randomize\['size'\]: this task supports only the sizes"):
        Runner(OneSize, 1, randomize={"size": (0.9, 1.1)})


@pytest.mark.parametrize(
    ("task", "size", "wanted"),
    [
        ("push", (1.0, 3.0), "at most 2.5 in this task, got (1.0, 3.0)"),
        (("push", {"block": "t", "obstacles": 4}), (1.0, 1.6), "at most 1.58"),
        ("stack", (0.4, 1.0), "within 0.5 and 1.5 in this task, got (0.4, 1.0)"),
        ("stack", 1.6, "within 0.5 and 1.5 in this task, got (1.6, 1.6)"),
        ("throw", (1.0, 2.0), "within 0.5 and 1.75 in this task, got (1.0, 2.0)"),
    ],
)
def test_unsupported_sizes_raise(task, size, wanted):
    name, options = task if isinstance(task, tuple) else (task, {})
    with pytest.raises(ValueError, match=re.escape(f"randomize['size'] must be {wanted}")):
        Runner(name, 1, randomize={"size": size}, **options)


def test_observed_parameters_need_ranges_and_options_stay_within_them():
    with pytest.raises(ValueError, match="observe_parameters needs randomize"):
        Runner("push", 1, observe_parameters=True)
    env = gym.make(PUSH, randomize={"mass": (0.5, 2.0)}, observe_parameters=True).unwrapped
    env.reset(seed=0, options={"randomize": {"mass": (1.0, 1.5)}})
    with pytest.raises(ValueError, match=r"randomize\['mass'\] in options must stay within"):
        env.reset(options={"randomize": {"mass": (1.0, 2.5)}})

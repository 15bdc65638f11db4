"""Push accepts a T or any Compound: fair, physical and drawn correctly, as the cube."""

import functools
import pickle

import numpy as np
import pytest

from physics import Box, Capsule, Compound, Sphere
from physics.rotation import from_yaw, rotate
from rigid_envs.rendering import scene_view
from rigid_envs.rendering.renderer import Renderer
from rigid_envs.rendering.view import Item
from rigid_envs.tasks.block import BAR, HALF, STEM, Block
from rigid_envs.tasks.push import MASS, POST_RADIUS, POSTS, RANGE, THRESHOLD
from rigid_envs.tasks.rewards import distance
from tests.rigid_envs.rollout import EPISODE, assert_same, make, make_vec, random_actions, steps_of
from training.scripted.push import push

T = Block.of("t")
U = Compound(
    [(Box((0.01, 0.03, 0.015)), (x, 0, 0)) for x in (-0.02, 0.02)]
    + [(Box((0.01, 0.01, 0.015)), (0, -0.02, 0))]
)


def corners(block):
    """[n, 3] m of a block of boxes, in its frame."""
    return np.concatenate([part.ends[0] for part in block.shape.parts])


def test_a_t_is_as_heavy_as_the_cube_and_about_its_size():
    cube = Block.of("cube")
    assert T.shape.volume == pytest.approx(1.125 * cube.shape.volume)
    body = make(block="t")._runner.world.scene.bodies[0]
    assert body.mass == MASS
    assert [part.shape.half_extents for part in T.shape.parts] == [BAR, STEM]
    assert T.height == pytest.approx(BAR[2])
    assert T.radius == pytest.approx(np.hypot(0.04, 0.02))


def test_blocks_start_flat_anywhere_at_any_yaw_and_unsolved():
    observation, info = make_vec(4000, block="t").reset(seed=0)
    assert not info["is_success"].any()
    assert distance(observation["achieved_goal"], observation["desired_goal"]).min() > THRESHOLD
    place, turn = observation["achieved_goal"], observation["observation"][:, 9:13]
    np.testing.assert_allclose(place[:, 2], T.height, atol=1e-6)
    assert np.abs(place[:, :2]).max() <= RANGE
    np.testing.assert_allclose(turn[:, :2], 0.0, atol=1e-7)
    yaw = 2.0 * np.arctan2(turn[:, 2], turn[:, 3])
    fraction = np.histogram(np.mod(yaw, 2.0 * np.pi), bins=8, range=(0.0, 2.0 * np.pi))[0] / 4000
    np.testing.assert_allclose(fraction, 1 / 8, atol=0.03)


def test_no_block_starts_on_a_post():
    envs = make_vec(2000, block="t", obstacles=4, randomize={"size": (0.7, 1.3)})
    observation, _ = envs.reset(seed=0)
    place, turn = observation["achieved_goal"].astype(float), observation["observation"][:, 9:13]
    size = envs._runner.world.parameters.size
    outline = T.shape.samples(0.002, 0.0).positions
    points = rotate(turn[:, None].astype(float), size[..., None] * outline) + place[:, None]
    apart = np.linalg.norm(points[:, :, None, :2] - POSTS, axis=-1)
    assert apart.min() > POST_RADIUS


def test_the_names_of_the_observation_are_those_of_a_block():
    env = make(block="t")
    names = [bound[0] for bound in env._runner.bounds]
    assert "block x" in names
    assert not any("cube" in name for name in names)
    assert "cube x" in [bound[0] for bound in make()._runner.bounds]


def test_block_cube_is_bitwise_identical_to_the_default():
    ends = []
    for options in ({}, {"block": "cube"}):
        envs = make_vec(20, reward_type="dense", **options)
        envs.reset(seed=0)
        *_, last = steps_of(envs, random_actions(20, 20))
        ends.append(last)
    assert_same(*ends)


@pytest.mark.parametrize(
    ("options", "least"),
    [
        ({"block": "t"}, 0.99),
        ({"block": "t", "obstacles": 2, "fidelity": "solid"}, 0.97),
        ({"block": "t", "obstacles": 2}, 0.97),
        ({"block": U}, 0.98),
    ],
)
def test_the_scripted_controller_solves_blocks(options, least, stress):
    envs = make_vec(300 if stress else 128, **options)
    known = {name: options[name] for name in ("block", "obstacles") if name in options}
    controller = functools.partial(push, **known)
    observation, _ = envs.reset(seed=0)
    for _ in range(EPISODE):
        observation, _, _, _, info = envs.step(controller(observation))
    assert info["is_success"].mean() >= least


def test_states_and_pickles_hold_the_block():
    env = make(block=U)
    env.reset(seed=1)
    env.step(np.ones(3))
    state = pickle.loads(pickle.dumps(env.get_state()))
    expected = env.step(np.zeros(3))
    env.set_state(state)
    assert_same(env.step(np.zeros(3)), expected)
    other = make(block="t")
    other.reset(seed=1)
    with pytest.raises(ValueError, match="another scene"):
        other.set_state(state)


# --- bad input ----------------------------------------------------------------------------------

TALL = Compound([(Box((0.03, 0.03, 0.02)), (0, 0, z)) for z in (-0.04, 0.0, 0.04)])
FLAT = Compound([(Box((0.03, 0.03, 0.005)), (0, 0, 0))])
WIDE = Compound([(Box((0.04, 0.02, 0.02)), (x, 0, 0)) for x in (-0.04, 0.04)])
ROLLING = Compound([(Capsule(0.02, 0.02), (0, 0, 0), (0.0, 1.0, 0.0, 1.0))])


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({"block": "T"}, ValueError, r"block must be one of \['cube', 't'\], got 'T'"),
        ({"block": 3}, TypeError, r"block, if not one of \['cube', 't'\], must be Compound, got 3"),
        ({"block": Sphere(0.02)}, TypeError, "must be Compound, got Sphere"),
        ({"block": TALL}, ValueError, r"must be 0.015 to 0.08 m high, .*, got 0.12 m"),
        ({"block": FLAT}, ValueError, r"must be 0.015 to 0.08 m high, .*, got 0.01 m"),
        ({"block": WIDE}, ValueError, r"must reach at most 0.07 m .*, got 0.08"),
        ({"block": ROLLING}, ValueError, r"must lie flat: .* at least 0.005 m inside"),
        ({"block": "t", "target_yaw": True}, ValueError, "target_yaw=True supports only the cube"),
    ],
)
def test_an_invalid_block_raises_an_error_that_says_why(options, error, match):
    with pytest.raises(error, match=match):
        make(**options)


def test_a_compound_of_one_box_is_a_valid_block():
    block = Block.of(Compound([(Box((HALF,) * 3), (0, 0, 0))]))
    assert block.height == HALF
    assert block.radius == pytest.approx(np.sqrt(2.0) * HALF)


# --- pictures -----------------------------------------------------------------------------------


def test_a_picture_shows_bar_and_stem_where_they_are():
    env = make(block="t", render_mode="rgb_array")
    env.reset(seed=0)
    yaw, place = 0.7, np.array([0.05, -0.03, T.height])
    env._runner.world.set_state(position=place, orientation=from_yaw(yaw))
    block, *others = scene_view.items(env._runner.world, np.zeros(1, int))
    along = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    bar = Item(Box(BAR), place + 0.01 * along, from_yaw(yaw), block.color)
    stem = Item(Box(STEM), place - 0.02 * along, from_yaw(yaw), block.color)
    renderer = Renderer(480, 480, env._runner.task.camera)
    markers = scene_view.markers(env._runner, 0)
    # both boxes have one place in the picture of the block, whatever rounding does to their borders
    apart = env.render() != renderer.frame([bar, stem, *others], markers=markers)
    assert apart.any(axis=2).sum() < 20
    for item in (bar, stem):
        alone = renderer.frame([item, *others], markers=markers)
        assert (env.render() != alone).any(axis=2).sum() > 50


def test_a_picture_of_particles_shows_each_sample_once():
    env = make(block="t", render_mode="rgb_array", show_particles=True)
    env.reset(seed=0)
    block, *_ = scene_view.items(env._runner.world, np.zeros(1, int), particles=True)
    samples, radius = env._runner.world.samples(0)
    np.testing.assert_array_equal(block.particles.positions, samples)
    np.testing.assert_array_equal(block.particles.radius, radius)
    assert env.render().shape == (480, 480, 3)

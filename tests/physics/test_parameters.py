"""Worlds with parameters of their own are, to the last bit, worlds of scenes that have them."""

import copy
import math
import pickle
import re
from functools import cache, partial

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Capsule,
    Drive,
    Ground,
    Material,
    Parameters,
    Scene,
    Sphere,
    Static,
    World,
)
from physics.compiler.jit import LANES
from physics.reference import scenes
from physics.reference.scenes import GRAVITY
from physics.scene.parameters import with_parameters
from tests.physics.test_world import digests

COUNT = LANES + 3  # a group, and a part of one


def everything(resistance=0.0):
    """All shapes, a static and a tool; sizes in which no body changes another's samples."""
    cube = Body(
        Box((0.02, 0.02, 0.025)),
        mass=0.2,
        position=(0.0, 0.0, 0.06),
        angular_velocity=(1.0, 2.0, 3.0),
        material=Material(
            0.4, 0.2, rolling_resistance=resistance, spinning_resistance=0.5 * resistance
        ),
    )
    ball = Body(Sphere(0.04), mass=0.05, position=(0.0, 0.0, 0.2), linear_velocity=(0.1, 0.0, 0.0))
    rod = Body(Capsule(0.03, 0.03), position=(0.1, 0.0, 0.2))
    statics = [Ground(), Static(Box((0.05, 0.05, 0.01)), (0.1, 0.0, 0.01))]
    return Scene([cube, ball, rod], statics, [Drive(Sphere(0.02), 0.05, 5.0, (-0.15, 0.0, 0.05))])


def drawn(scene, count=COUNT, seed=0):
    """Parameters of worlds that differ in all of them; the first has the scene's own.

    Sizes are powers of two, by which shapes scale without round-off, one a world.
    """
    rng = np.random.default_rng(seed)
    shape = (count, len(scene.bodies))
    values = {
        "mass": rng.uniform(0.2, 1.0, shape),
        "friction": rng.uniform(0.0, 1.0, shape),
        "restitution": rng.uniform(0.0, 1.0, shape),
        "size": 2.0 ** rng.integers(-1, 2, (count, 1)) * np.ones(shape),
    }
    values["friction"][1] = 0.0
    for name, own in Parameters.of(scene)._asdict().items():
        values[name][0] = own
    return values


def varied(scene, fidelity="balanced", count=COUNT, threads=1, **values):
    """Worlds that start from the scene's state with parameters of their own."""
    world = World(scene, fidelity, count, threads, per_world_parameters=True)
    world.set_parameters(**(values or drawn(scene, count)))
    world.reset()
    if scene.drives:
        world.command_drives((0.3, 0.0, 0.0))
    return world


def everything_of(world, i):
    """All arrays of one world's state, field by field."""
    state, (group, lane) = world._simulation.state, divmod(i, LANES)
    for table in (state.dynamic[i], state.half_pair[i], state.world[i]):
        yield from (table[name] for name in table.dtype.names)
    yield state.touch[..., i]
    yield state.sample_id[group, :, lane]
    yield from (state.candidate[n][group, ..., lane] for n in state.candidate.dtype.names)


@cache
def block():
    return scenes.block_on_ground(position=(0.0, 0.0, 0.05), linear_velocity=(0.5, 0.0, 0.0))


@pytest.mark.parametrize(
    ("make", "fidelity"),
    [
        (scenes.push_like, "fast"),
        (scenes.push_like, "balanced"),
        (scenes.push_like, "accurate"),
        (scenes.push_like, "solid"),
        (everything, "balanced"),
        (everything, "solid"),
        (partial(everything, 1e-3), "balanced"),
        (partial(everything, 1e-3), "solid"),
    ],
)
def test_a_world_with_parameters_is_a_world_of_a_scene_that_has_them_built_in(
    make, fidelity, stress
):
    if isinstance(make, partial) and not stress:
        pytest.skip("two kernels of its own; see make stress")
    scene = make()
    worlds = varied(scene, fidelity)
    for _ in range(4):
        worlds.advance(0.1)
    energy, rows = worlds.kinetic_energy(), worlds.read().rows
    for i in range(COUNT):
        built = World(with_parameters(scene, worlds.parameters.pick([i])), fidelity, threads=1)
        built.command_drives((0.3, 0.0, 0.0))
        for _ in range(4):
            built.advance(0.1)
        assert rows[i].tobytes() == built.read().rows[0].tobytes(), f"world {i}"
        # hidden state too; where a neighbour has more candidates, zeros may differ in their sign
        for mine, theirs in zip(everything_of(worlds, i), everything_of(built, 0), strict=True):
            np.testing.assert_array_equal(mine, theirs)
        assert energy[i] == pytest.approx(built.kinetic_energy()[0], rel=1e-12)
        assert worlds.potential_energy()[i] == pytest.approx(built.potential_energy()[0], rel=1e-12)
        assert worlds.penetration()[i] == built.penetration()[0]
        assert worlds.largest_stable_step(i) == built.largest_stable_step()
        assert worlds.contacts(i).force.tobytes() == built.contacts().force.tobytes()


def test_neighbours_and_threads_change_no_bit():
    scene, count = scenes.push_like(), 150
    values = drawn(scene, count)
    alone, shared = (varied(scene, count=count, threads=t, **values) for t in (1, 2))
    backwards = varied(scene, count=count, **{k: v[::-1] for k, v in values.items()})
    for world in (alone, shared, backwards):
        world.advance(0.4)
    assert digests(alone) == digests(shared) == digests(backwards)[::-1]


def test_any_size_is_that_shape_up_to_round_off():
    sizes = np.array([[0.7], [1.3], [1.9]])
    worlds = varied(block(), count=3, size=sizes, mass=[[0.1], [0.3], [0.05]])
    worlds.advance(0.3)
    for i in range(3):
        built = World(with_parameters(block(), worlds.parameters.pick([i])))
        built.advance(0.3)
        np.testing.assert_allclose(worlds.position[i], built.position[0], atol=1e-9)
        assert worlds.position[i, 0, 2] == pytest.approx(0.02 * sizes[i, 0], abs=2e-3)


def test_friction_may_come_with_the_parameters():
    scene = Scene(
        [Body(Sphere(0.02), mass=0.1, position=(0, 0, 0.02), linear_velocity=(1.0, 0, 0),
              material=Material(friction=0.0))],
        [Ground()],
    )  # fmt: skip
    worlds = varied(scene, count=2, friction=[[0.0], [0.5]])
    worlds.advance(1.0)
    assert worlds.linear_velocity[0, 0, 0] == pytest.approx(1.0, abs=1e-9)
    assert worlds.linear_velocity[1, 0, 0] == pytest.approx(5.0 / 7.0, rel=1e-2)  # it rolls


def test_the_distance_of_a_stop_follows_each_worlds_friction():
    friction = np.array([[0.1], [0.2], [0.8]])
    scene = scenes.block_on_ground(position=(0, 0, 0.02), linear_velocity=(0.5, 0, 0))
    ground = Ground(Material(friction=0.5))
    worlds = varied(Scene(scene.bodies, [ground]), "accurate", count=3, friction=friction)
    worlds.advance(1.0)
    pair = np.sqrt(0.5 * friction[:, 0])
    np.testing.assert_allclose(worlds.position[:, 0, 0], 0.25 / (2 * pair * GRAVITY), rtol=1e-2)


# --- what is kept -------------------------------------------------------------------------------


def test_parameters_are_the_scenes_until_they_are_set():
    scene = everything()
    for world in (World(scene, count=3), World(scene, count=3, per_world_parameters=True)):
        for mine, own in zip(world.parameters, Parameters.of(scene, 3), strict=True):
            np.testing.assert_array_equal(mine, own)


def test_only_what_is_given_changes_and_only_in_the_chosen_worlds():
    world = World(everything(), count=4, per_world_parameters=True)
    mask = np.array([True, False, False, True])
    world.set_parameters(mass=(1.0, 2.0, 3.0), worlds=mask)
    before = Parameters.of(world.scene, 4)
    np.testing.assert_array_equal(world.parameters.mass[mask], [[1.0, 2.0, 3.0]] * 2)
    np.testing.assert_array_equal(world.parameters.mass[~mask], before.mass[~mask])
    np.testing.assert_array_equal(world.parameters.friction, before.friction)
    world.parameters.mass[:] = 7.0  # a copy
    assert not np.any(world.parameters.mass == 7.0)


def test_velocities_stay_and_momenta_follow():
    world = World(everything(), count=3, per_world_parameters=True)
    linear, angular = world.linear_velocity.copy(), world.angular_velocity.copy()
    momentum = world.linear_momentum()
    world.set_parameters(mass=2.0 * world.parameters.mass, size=1.5)
    np.testing.assert_allclose(world.linear_velocity, linear, rtol=1e-14)
    np.testing.assert_allclose(world.angular_velocity, angular, rtol=1e-12)
    np.testing.assert_allclose(world.linear_momentum(), 2.0 * momentum, rtol=1e-14)
    momentum = world.linear_momentum()
    world.set_parameters(friction=0.9)
    assert world.linear_momentum().tobytes() == momentum.tobytes()


def test_reset_keeps_parameters():
    world = varied(scenes.push_like())
    own = world.parameters
    world.advance(0.2)
    once = digests(world)
    world.reset()
    world.command_drives((0.3, 0.0, 0.0))
    world.advance(0.2)
    assert digests(world) == once
    for now, before in zip(world.parameters, own, strict=True):
        np.testing.assert_array_equal(now, before)


@pytest.mark.parametrize("way", ["snapshot", "pickle", "deepcopy"])
def test_what_is_carried_over_continues_to_the_last_bit(way):
    world = varied(scenes.push_like())
    world.advance(0.2)
    if way == "snapshot":
        other = World(world.scene, count=COUNT, per_world_parameters=True)
        other.restore(pickle.loads(pickle.dumps(world.snapshot())))
    else:
        other = pickle.loads(pickle.dumps(world)) if way == "pickle" else copy.deepcopy(world)
    for each in (world, other):
        each.advance(0.2)
    assert digests(world) == digests(other)
    other.set_parameters(mass=5.0)  # nothing is shared
    assert not np.any(world.parameters.mass == 5.0)


def test_worlds_that_are_alike_share_one_model():
    scene = scenes.push_like()
    alike = [World(scene, count=n)._simulation.model.nbytes for n in (1, 800)]
    assert alike[0] == alike[1]
    assert not World(scene).features.per_world_parameters
    assert World(scene, per_world_parameters=True).features.per_world_parameters
    assert (
        World(scene, count=800, per_world_parameters=True).nbytes > World(scene, count=800).nbytes
    )


# --- what is refused ----------------------------------------------------------------------------


def test_worlds_that_are_alike_take_no_parameters():
    with pytest.raises(
        ValueError, match="needs a World that is built with per_world_parameters=True"
    ):
        World(scenes.push_like()).set_parameters(mass=1.0)
    with pytest.raises(TypeError, match="per_world_parameters must be bool, got 1"):
        World(scenes.push_like(), per_world_parameters=1)
    alike, other = World(scenes.push_like()), World(scenes.push_like(), per_world_parameters=True)
    with pytest.raises(ValueError, match="another per_world_parameters: False"):
        other.restore(alike.snapshot())
    with pytest.raises(ValueError, match="another per_world_parameters: True"):
        alike.restore(other.snapshot())


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mass": 0.0}, "mass must be above 0, got 0 for body 0 of world 1"),
        ({"mass": math.nan}, "mass must be finite, got nan"),
        ({"friction": -0.1}, "friction must be at least 0, got -0.1 for body 0 of world 1"),
        ({"restitution": 1.5}, "restitution must be at least 0 and at most 1, got 1.5 for body 0"),
        ({"size": -1.0}, "size must be above 0, got -1 for body 0 of world 1"),
        ({"size": "big"}, "size must be numbers of shape (2, 1), got 'big'"),
        ({"mass": np.ones((3, 1))}, "mass must be numbers of shape (2, 1), got shape (3, 1)"),
        ({"mass": 1.0, "friction": math.inf}, "friction must be finite, got inf"),
    ],
)
def test_bad_values_are_named_and_nothing_is_written(values, message):
    world = World(scenes.push_like(), count=3, per_world_parameters=True)
    before, hashes = world.parameters, digests(world)
    with pytest.raises(ValueError, match=re.escape(message)):
        world.set_parameters(**values, worlds=np.array([False, True, True]))
    assert digests(world) == hashes
    for now, own in zip(world.parameters, before, strict=True):
        np.testing.assert_array_equal(now, own)


@pytest.mark.parametrize(
    ("ranges", "error", "message"),
    [
        ({"weight": (1, 2)}, ValueError, "ranges must be one of ['mass', 'friction'"),
        ({"mass": 1.0}, TypeError, "ranges['mass'] must be a pair (low, high), got 1.0"),
        ({"mass": (2.0, 1.0)}, ValueError, "low at most high, got (2, 1) of body 0"),
        ({"mass": (0.0, 1.0)}, ValueError, "ranges['mass'] low must be above 0, got 0 for body 0"),
        ({"restitution": (0, 2)}, ValueError, "ranges['restitution'] high must be at least 0"),
        ({"size": (1, math.inf)}, ValueError, "ranges['size'] high must be finite"),
        ("mass", TypeError, "ranges must be a dict"),
    ],
)
def test_bad_ranges_are_named(ranges, error, message):
    with pytest.raises(error, match=re.escape(message)):
        World(scenes.push_like(), per_world_parameters=True).check_parameters(ranges)


def test_a_range_is_held_against_the_stable_step_before_anything_runs():
    scene = scenes.block_on_ground(stiffness=1000.0)
    world = World(scene, count=2, per_world_parameters=True)
    world.check_parameters({"mass": (0.1, 5.0)})
    message = r"mass 0\.001 kg.*Material\.stiffness 1000 .*body 0 limits it.*largest safe step is"
    with pytest.raises(ValueError, match=message):
        world.check_parameters({"mass": (0.001, 5.0)})
    with pytest.raises(ValueError, match=r"world 1.*mass 0\.001.*largest safe step"):
        world.set_parameters(mass=[[0.1], [0.001]])
    np.testing.assert_array_equal(world.parameters.mass, [[0.1], [0.1]])
    unstable = World(scene, count=2, per_world_parameters=True, allow_unstable=True)
    unstable.set_parameters(mass=0.001)
    with pytest.raises(ValueError, match=r"mass 0\.001.*largest safe step"):
        world.restore(unstable.snapshot())
    np.testing.assert_array_equal(world.parameters.mass, [[0.1], [0.1]])


def test_without_a_stiffness_any_mass_is_stable_and_the_smallest_size_may_sink():
    world = World(scenes.block_on_ground(), per_world_parameters=True)
    world.check_parameters({"mass": (1e-6, 1e6)})
    with pytest.raises(ValueError, match=r"size 0\.001.*too long for body 0.*would sink"):
        world.check_parameters({"size": (0.001, 1.0)})


def test_a_body_does_not_shrink_until_it_falls_between_samples():
    world = World(scenes.two_cubes(), count=2, per_world_parameters=True)
    world.set_parameters(size=[[0.6, 0.6], [1.0, 0.8]])
    with pytest.raises(ValueError, match=r"size 0\.4 makes body 1.* fall between"):
        world.check_parameters({"size": ([1.0, 0.4], [1.0, 1.0])})
    with pytest.raises(ValueError, match=r"size 0\.4 makes body 1 in world 1 .* fall between"):
        world.set_parameters(size=[[1.0, 1.0], [1.0, 0.4]])

"""The engine of a World is what was asked for, or an error that says why it can't be."""

import numpy as np
import pytest

from physics import Body, Drive, Fidelity, Ground, Scene, Sphere, World, explain
from physics.engines import MANY, choose_engine
from tests.physics.manybody.scenes import heap

BALLS = Scene(
    [Body(Sphere(0.02), mass=0.1, position=(0.1 * k, 0.0, 0.0195)) for k in range(3)], [Ground()]
)
DASHPOT = Fidelity(damping="dashpot", friction="viscous")


def test_auto_is_the_fastest_engine_that_can_simulate_the_scene():
    cubes = heap(MANY)
    assert choose_engine(heap(MANY - 1), Fidelity()) == "worlds"
    assert choose_engine(cubes, Fidelity()) == "bodies"
    assert choose_engine(cubes, Fidelity(), per_world_parameters=True) == "worlds"
    assert choose_engine(cubes, Fidelity(integrator="rk4")) == "worlds"
    balls = Scene([Body(Sphere(0.02), mass=0.1)] * MANY, [Ground()])
    assert choose_engine(balls, DASHPOT) == "particles"
    assert "\nengine: bodies\n" in explain(cubes, costs=False)


@pytest.mark.parametrize(
    ("engine", "fidelity", "per_world", "reason"),
    [
        ("bodies", Fidelity(integrator="rk4"), False,
         r"Fidelity.integrator must be 'midpoint' or 'euler', got 'rk4'; engine='worlds' can"),
        ("bodies", Fidelity(time_control="adaptive"), False, "Fidelity.time_control must be"),
        ("bodies", Fidelity(), True, "per_world_parameters must be False, got True"),
        ("particles", Fidelity(), False, "Fidelity.damping must be 'dashpot'"),
        ("lanes", Fidelity(), False, "engine must be one of .*, got 'lanes'"),
    ],
)  # fmt: skip
def test_an_engine_that_cannot_simulate_a_scene_says_why(engine, fidelity, per_world, reason):
    with pytest.raises(ValueError, match=reason):
        World(BALLS, fidelity, engine=engine, per_world_parameters=per_world)


def test_a_drive_alone_is_not_a_scene_of_bodies():
    alone = Scene([], drives=[Drive(Sphere(0.02), mass=0.1, force_limit=1.0)])
    with pytest.raises(ValueError, match=r"Scene\.bodies must hold at least one body, got none"):
        World(alone, engine="bodies")


def test_three_engines_simulate_one_scene():
    worlds = [World(BALLS, DASHPOT, engine=name) for name in ("worlds", "bodies", "particles")]
    for name, world in zip(("worlds", "bodies", "particles"), worlds, strict=True):
        world.advance(0.1)
        assert world.engine == name
        assert f"engine={name!r}" in repr(world)
    first, *others = worlds
    with pytest.raises(ValueError, match="another engine: 'worlds' instead of 'bodies'"):
        others[0].restore(first.snapshot())
    assert first.penetration()[0] > 0.0
    for world in others:
        assert world.position == pytest.approx(first.position, abs=1e-9)
        assert world.penetration() == pytest.approx(first.penetration(), abs=1e-9)
        assert world.elastic_energy() == pytest.approx(first.elastic_energy(), rel=1e-6)
        assert world.normal_force(0, "static 0") == pytest.approx(0.981, rel=0.05)
        assert world.largest_stable_step() == pytest.approx(first.largest_stable_step(), rel=1e-5)
        assert np.array_equal(world.contacts().pair, first.contacts().pair)

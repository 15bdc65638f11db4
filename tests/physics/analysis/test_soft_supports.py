"""A world warns of bodies that sink deep, and what it advises holds."""

import re
import warnings
from dataclasses import replace

import pytest

from physics import PRESETS, Body, Box, Drive, Ground, Material, Scene, Sphere, World
from physics.reference.scenes import tower
from physics.scene.fidelity import NEWTON


def loaded(ratio, width=0.04, more=()):
    """A cube of 0.1 kg per 4 cm under one that is `ratio` times as heavy."""
    half, mass = 0.5 * width, 0.1 * (width / 0.04) ** 3
    bodies = [
        Body(Box((half,) * 3), mass=mass * factor, position=(0, 0, (2 * n + 1) * half))
        for n, factor in enumerate((1.0, ratio) if ratio else (1.0,))
    ]
    return Scene([*bodies, *more], [Ground(Material(0.5))])


def warning_of(scene, fidelity):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        World(scene, fidelity)
    return str(caught[0].message) if caught else ""


@pytest.mark.parametrize("name", ["fast", "balanced"])
def test_a_heavy_cube_on_a_light_one_warns_and_the_advice_holds(name):
    scene = loaded(1000.0)
    text = warning_of(scene, name)
    assert "presses on body 0 with 100 kg" in text
    assert "solver='newton'" in text
    substep = float(re.search("use substep=([0-9.e-]+)", text)[1])
    shorter = replace(PRESETS[name], substep=substep)
    for fidelity in (shorter, NEWTON):
        # rounded to two digits, the step may be longer by as much
        assert warning_of(scene, replace(fidelity, substep=0.95 * fidelity.substep)) == ""
        world = World(scene, fidelity, allow_unstable=True)
        world.advance(1.0)
        # each of two contacts by a tenth, and as much again while it bounces
        assert 0.06 - world.position[0, 1, 2] < 2.0 * 2.0 * 0.1 * 0.04


def test_sweeps_are_advised_to_use_newton():
    text = warning_of(loaded(1000.0), "solid")
    assert "for at most 10 % use law='impulse' with solver='newton'" in text
    drive = Drive(Sphere(0.01), 1.0, 10.0, (1.0, 0.0, 1.0))
    driven = replace(loaded(1000.0), drives=(drive,))
    assert "for at most 10 % use substep=" in warning_of(driven, "solid")


def test_a_body_that_is_small_against_its_sink_warns():
    text = warning_of(loaded(0, 1e-3), "fast")
    assert "sinks into it by 0.32 mm at rest, 32 % of the width" in text
    assert warning_of(loaded(0, 1e-3), "solid") == ""


def test_ordinary_scenes_do_not_warn():
    for name in PRESETS:
        assert warning_of(tower(5), name) == ""
        assert warning_of(loaded(10.0), name) == ""
    assert warning_of(replace(loaded(1000.0), gravity=(0.0, 0.0, 0.0)), "fast") == ""
    beside = [Body(Box((0.02,) * 3), mass=100.0, position=(0.05, 0.0, 0.2))]
    assert warning_of(loaded(0, more=beside), "balanced") == ""


def test_with_a_given_stiffness_the_advice_is_stiffer_materials():
    soft = Material(0.5, 0.0, stiffness=200.0)
    cube = Body(Box((0.02,) * 3), mass=0.1, position=(0, 0, 0.02), material=soft)
    assert "use materials 2.5 times as stiff" in warning_of(Scene([cube], [Ground(soft)]), "fast")

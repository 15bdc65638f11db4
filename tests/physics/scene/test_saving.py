"""A scene and a fidelity are equal to what their JSON text gives, and run bit by bit alike."""

import json
import math

import numpy as np
import pytest

from physics import (
    PRESETS,
    Attractor,
    Body,
    Box,
    Capsule,
    Compound,
    Drag,
    Drive,
    Fidelity,
    Gripper,
    Ground,
    Material,
    PointSpring,
    Scene,
    Sphere,
    Static,
    World,
)
from rigid_envs.tasks.push import Push
from rigid_envs.tasks.stack import Stack
from rigid_envs.tasks.throw import Throw

TEE = Compound([(Box((0.04, 0.01, 0.015)), (0, 0, 0)), (Box((0.01, 0.02, 0.015)), (0, -0.03, 0))])
EVERYTHING = Scene(
    [
        Body(TEE, density=500.0, position=(0.1, 0.2, 0.3), orientation=(1, 2, 3, 4), name="tee"),
        Body(Sphere(1 / 3), linear_velocity=(0.1, 0, 0), material=Material(0.3, 0.7, 1e4, 0.1)),
        Body(Capsule(0.1, 0.2), mass=2.0, position=(0, 0, 2), angular_velocity=(1, 2, 3)),
    ],
    [Ground(height=-1.0), Static(Box((1, 1, 0.1)), (5, 0, 0), (0, 0, 1, -1))],
    [
        Drive(Sphere(0.1), 0.5, 3.0, (0, 2, 0), frequency=50.0),
        Gripper(Box((0.01, 0.01, 0.05)), 0.05, 20.0, 5.0, (0, -2, 0), 0.1),
    ],
    gravity=(0.1, 0.0, -9.81),
    fields=[
        PointSpring("tee", 3.0, 0.1, 0.2, (0.01, 0, 0), to=1, to_point=(0, 0.1, 0)),
        PointSpring(2, 3.0, to=(0, 0, 5)),
        Attractor((1, 2, 3), -0.5, 1.5, per_particle=True),
        Drag(0.1, 0.2, body="tee"),
    ],
)


@pytest.mark.parametrize(
    "scene", [EVERYTHING, Push().scene(), Stack().scene(), Throw().scene()],
    ids=["everything", "push", "stack", "throw"],
)  # fmt: skip
def test_a_scene_comes_back_equal(scene):
    assert Scene.from_json(scene.to_json()) == scene
    assert Scene.from_json(Scene.from_json(scene.to_json()).to_json()) == scene


def test_random_orientations_come_back_to_the_bit():
    rng = np.random.default_rng(0)
    for q in rng.normal(size=(500, 4)):
        scene = Scene([Body(Sphere(0.1), mass=0.1, orientation=tuple(q))])
        assert Scene.from_json(scene.to_json()) == scene


@pytest.mark.parametrize("fidelity", [*PRESETS.values(), Fidelity(substep=1 / 3000, spacing=0.3)])
def test_a_fidelity_comes_back_equal(fidelity):
    assert Fidelity.from_json(fidelity.to_json()) == fidelity


def test_a_scene_that_comes_back_runs_bit_by_bit_alike():
    scene = Scene([Body(Box((0.02, 0.02, 0.02)), mass=0.1, position=(0, 0, 0.05),
                        orientation=(0.1, 0.2, 0.3, 0.9))], [Ground()])  # fmt: skip
    worlds = [World(s) for s in (scene, Scene.from_json(scene.to_json()))]
    for world in worlds:
        world.advance(0.5)
    np.testing.assert_array_equal(worlds[0].position, worlds[1].position)


def test_a_field_that_is_missing_has_its_default():
    document = json.loads(Fidelity().to_json())
    document["value"] = {"type": "Fidelity", "substep": 1e-3}
    assert Fidelity.from_json(json.dumps(document)) == Fidelity(substep=1e-3)


def changed(change):
    document = json.loads(Scene([Body(Sphere(0.1), mass=1.0)]).to_json())
    change(document)
    return json.dumps(document)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "scene must be JSON text: Expecting"),
        ("[1, 2]", "must have the format 'rigid-envs scene', got None"),
        ('{"name": "cartpole"}', "must have the format 'rigid-envs scene', got None"),
        (Fidelity().to_json(), "format 'rigid-envs scene', got 'rigid-envs fidelity'"),
        ("[" * 100_000, "scene must be JSON text"),
        (changed(lambda d: d.update(version=2)), "must have version 1, .*, got 2"),
        (changed(lambda d: d.update(value=3)), "must hold a Scene, got int"),
        (changed(lambda d: d.update(value=d["value"]["bodies"][0])), "must hold a Scene, got Body"),
        (changed(lambda d: d["value"]["bodies"][0].update(mass=-1)),
         r"scene.bodies\[0\]: Body.mass must be .*got -1"),
        (changed(lambda d: d["value"]["bodies"][0].update(mass=math.nan)), "finite, got NaN"),
        (changed(lambda d: d["value"]["bodies"][0].update(colour="red")),
         r"scene.bodies\[0\]: Body has no field 'colour'; it has: shape, mass"),
        (changed(lambda d: d["value"]["bodies"][0]["shape"].update(type="os.system")),
         r"scene.bodies\[0\].shape.type must be one of \['Attractor', .*, got 'os.system'"),
        (changed(lambda d: d["value"]["bodies"][0].pop("shape")),
         r"scene.bodies\[0\]: .*missing .* 'shape'"),
    ],
)  # fmt: skip
def test_a_bad_text_is_refused_with_its_place(text, message):
    with pytest.raises(ValueError, match=message):
        Scene.from_json(text)


def test_no_text_is_a_type_error():
    with pytest.raises(TypeError, match="fidelity must be JSON text, got 3"):
        Fidelity.from_json(3)

"""What tells bodies apart without looking at their samples never misses one that is near."""

from types import SimpleNamespace

import numpy as np
import pytest

from physics import Body, Box, Capsule, Compound, Ground, Scene, Sphere
from physics.collision.separations import make_separations, separation_bound
from physics.model.build import build
from physics.rotation import rotation_matrix
from physics.scene.fidelity import PRESETS

BOX, BALL, ROD = Box((0.03, 0.02, 0.01)), Sphere(0.02), Capsule(0.01, 0.03)
T = Compound([(Box((0.04, 0.01, 0.015)), (0, 0, 0)), (Box((0.01, 0.02, 0.015)), (0, -0.03, 0))])


@pytest.mark.parametrize("shapes", [(BOX, BOX), (BOX, BALL), (ROD, BALL), (ROD, BOX), (T, BOX)])
@pytest.mark.parametrize("size", [None, 1.4])
def test_no_sample_is_nearer_than_the_gap_along_the_axes(shapes, size):
    scene = Scene([Body(shape, position=(x, 0, 0.1)) for x, shape in enumerate(shapes)], [Ground()])
    model, features = build(scene, PRESETS["balanced"], per_world_parameters=size is not None)
    model.half_pair["owner_size"] = size or 1.0
    measure, rng = make_separations(features), np.random.default_rng(0)
    gaps, touching = np.empty(model.half_pair["sample_count"].max()), 0
    for side in model.half_pair.view(np.recarray):
        for _ in range(200):
            quaternion = rng.normal(size=4)
            turn = rotation_matrix(quaternion / np.linalg.norm(quaternion))
            place = rng.uniform(-0.08, 0.08, 3)
            seen = SimpleNamespace(rotation=turn.reshape(9, 1), position=place[:, None])
            measure(model, side, 0, seen, gaps)
            nearest, bound = gaps[: side.sample_count].min(), separation_bound(side, 0, seen)
            assert bound <= nearest + 1e-12
            touching += nearest < 0.0
    assert touching > 20


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_of_boxes_side_by_side_it_is_the_gap(axis):
    scene = Scene([Body(BOX), Body(Box((0.02, 0.02, 0.02)), position=(1, 0, 0))])
    model, features = build(scene, PRESETS["balanced"])
    side = model.half_pair.view(np.recarray)[0]
    gaps = np.empty(side.sample_count)
    place = np.array([[0.01], [0.0], [0.005]])
    place[axis] = 0.3
    seen = SimpleNamespace(rotation=np.eye(3).reshape(9, 1), position=place)
    make_separations(features)(model, side, 0, seen, gaps)
    expected = 0.3 - (BOX.half_extents[axis] + 0.02)
    assert gaps.min() == pytest.approx(expected, rel=1e-12)
    assert separation_bound(side, 0, seen) == pytest.approx(expected, rel=1e-12)

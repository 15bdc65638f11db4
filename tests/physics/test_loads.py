"""Bodies that stand tip, slide and lean as theory says, as exactly as soft contacts let them.

`physics.analysis.standing` predicts what they cost; `explain` names it.
"""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from physics import (
    PRESETS,
    Body,
    Box,
    Cylinder,
    Fidelity,
    Ground,
    Material,
    Scene,
    Sphere,
    explain,
)
from physics.analysis.standing import base, tipping
from physics.model.rocking import outward_sides
from physics.reference.loads import (
    BOX,
    FRICTION,
    GRAVITY,
    leaning,
    leaning_angle,
    predicted_pull,
    predicted_tipping,
    pulled,
    tipping_slope,
)
from physics.scene.fidelity import NEWTON
from physics.scene.shapes import Samples

LEVELS = {**PRESETS, "newton": NEWTON}
SPRINGS = ("fast", "balanced", "accurate")
DOWN = np.array([0.0, 0.0, -1.0])
GRID = 0.0157 * math.atan2(*BOX)  # rad, between slopes that are tried

by_level = pytest.mark.parametrize("name", LEVELS)
by_springs = pytest.mark.parametrize("name", SPRINGS)


@by_level
@pytest.mark.parametrize("size", [1.0, 10.0])
def test_under_a_load_that_grows_a_box_tips_where_its_sink_says(name, size):
    predicted = predicted_tipping(LEVELS[name], size).gradual
    # the load grows within two seconds, in which the body still sways
    assert tipping_slope(LEVELS[name], True, size) == pytest.approx(predicted, rel=0.06)


@by_level
@pytest.mark.parametrize(("size", "restitution"), [(1.0, 0.0), (1.0, 1.0), (10.0, 0.0)])
def test_set_down_at_once_it_tips_no_earlier_than_its_energy_allows(name, size, restitution):
    predicted = predicted_tipping(LEVELS[name], size)
    found = tipping_slope(LEVELS[name], False, size, restitution)
    assert predicted.sudden <= found
    # a bouncing one may stand where it would tip under a load that grows
    assert found <= predicted.gradual + 2.0 * GRID + 0.03 * restitution


def test_what_a_box_that_is_set_down_loses_is_proportional_to_the_step():
    levels = [replace(PRESETS["balanced"], substep=h) for h in (2e-3, 1e-3, 0.5e-3)]
    lost = [predicted_tipping(f).rigid - tipping_slope(f, False) for f in levels]
    assert lost[0] / lost[1] == pytest.approx(2.0, rel=0.12)
    assert lost[1] / lost[2] == pytest.approx(2.0, rel=0.2)


def test_newton_tips_a_box_at_the_angle_of_a_rigid_one():
    rounded = math.atan2(0.975 * BOX[0], BOX[1])
    for slow in (False, True):
        assert tipping_slope(NEWTON, slow) == pytest.approx(rounded, abs=1.5 * GRID)
    sharp = replace(NEWTON, rounding=0.002)
    assert tipping_slope(sharp, False) == pytest.approx(math.atan2(*BOX), rel=0.02)


@by_springs
def test_a_pull_that_friction_holds_moves_a_cube_as_far_as_its_springs_give_way(name):
    moved, speed = pulled(name, 0.5, True)
    assert moved == pytest.approx(predicted_pull(name, 0.5).gradual, rel=0.01)
    assert speed == pytest.approx(0.0, abs=1e-9)
    predicted = predicted_pull(name, 0.9)
    assert predicted.gradual < pulled(name, 0.9, True)[0] < 2.0 * predicted.gradual
    assert predicted.gradual < pulled(name, 0.9, False)[0] < predicted.sudden
    slides = predicted_pull(name, 1.01)
    excess = pulled(name, 1.01, False)[1] - 0.01 * FRICTION * GRAVITY * 2.0
    assert 0.0 < excess < slides.speed


@pytest.mark.parametrize("name", ["solid", "newton"])
def test_with_impulses_a_pull_that_friction_holds_moves_nothing(name):
    for slow in (False, True):
        moved, speed = pulled(LEVELS[name], 0.9, slow)
        assert 0.0 <= moved < 2e-5
        assert abs(speed) < 1e-6
    _, speed = pulled(LEVELS[name], 1.01, False)
    assert speed == pytest.approx(0.01 * FRICTION * GRAVITY * 2.0, rel=0.05)


def test_what_a_pull_costs_converges_with_the_square_of_the_step_and_the_speed_with_the_step():
    coarse, fine = (replace(PRESETS["balanced"], substep=h) for h in (1e-3, 0.5e-3))
    assert pulled(coarse, 0.9, False)[0] / pulled(fine, 0.9, False)[0] == pytest.approx(4, rel=0.2)
    exact = 0.01 * FRICTION * GRAVITY * 2.0
    a, b = (pulled(f, 1.01, False)[1] - exact for f in (coarse, fine))
    assert a / b == pytest.approx(2.0, rel=0.2)


@by_level
def test_the_least_angle_at_which_a_stick_leans_is_that_of_coulombs_friction(name):
    for slow in (False, True):
        put, stands = leaning(LEVELS[name], slow)
        assert stands == pytest.approx(leaning_angle(), rel=0.02)
        if name in ("solid", "newton"):
            assert put == pytest.approx(leaning_angle(), rel=0.02)


def samples_of(shape, spacing=0.5, rounding=0.0):
    return shape.samples(spacing * shape.width, rounding)


def test_a_base_is_the_side_that_faces_down_and_its_nearest_edge():
    brick = Box((0.03, 0.02, 0.05))
    stands = base(samples_of(brick), outward_sides(brick), DOWN)
    assert stands.height == pytest.approx(0.05)
    assert stands.arms[0] == pytest.approx(0.02)  # the nearer edge
    assert stands.parts.sum() == pytest.approx(1.0)
    lying = base(samples_of(brick), outward_sides(brick), np.array([1.0, 0.0, 0.0]))
    assert lying.height == pytest.approx(0.03)
    drum = Cylinder(0.02, 0.05)
    stands = base(samples_of(drum), outward_sides(drum), DOWN)
    assert stands.height == pytest.approx(0.05)
    assert 0.019 < stands.arms[0] <= 0.02 * (1.0 + 1e-9)
    # a ball rolls, whatever is below it
    ball = Sphere(0.02)
    assert base(ball.samples(0.01, 0.0), outward_sides(ball), DOWN) is None


def test_a_rigid_body_tips_at_the_angle_of_its_edge_and_one_that_sinks_earlier():
    """Two rows: both press until the body has tilted by twice its sink over its width."""
    corners = np.array([[x, y, -0.06] for x in (0.02, -0.02) for y in (0.02, -0.02)])
    four = Samples(corners, np.full(4, 0.25), 0.0)
    stands = base(four, outward_sides(Box((0.02, 0.02, 0.06))), DOWN)
    assert tipping(stands, 0.0) == pytest.approx([math.atan2(0.02, 0.06)] * 3)
    sink = 1e-4
    found = tipping(stands, sink)
    assert math.tan(found.gradual) == pytest.approx(1.0 / 3.0 - 2.0 * sink / 0.04)
    early = math.sqrt(2.0 * sink / math.hypot(0.02, 0.06))
    assert found.sudden == pytest.approx(found.rigid - early)


def test_explain_says_where_a_body_that_stands_tips_and_what_would_be_better():
    block = Body(Box((0.02, 0.02, 0.06)), mass=0.1, position=(0, 0, 0.06), material=Material(1.0))
    scene = Scene([block], [Ground(material=Material(1.0))])
    predicted = predicted_tipping("fast")
    text = explain(scene, PRESETS["fast"], costs=False)
    line = re.search(r"tips at 18\.4°.*here at ([\d.]+)°.*from ([\d.]+)°", text)
    assert float(line[1]) == pytest.approx(math.degrees(predicted.gradual), abs=0.05)
    assert float(line[2]) == pytest.approx(math.degrees(predicted.sudden), abs=0.05)
    better = re.search(r"at most 5 % of that angle by sinking: substep=([\d.]+), or (.*)", text)
    lost = predicted_tipping(replace(PRESETS["fast"], substep=float(better[1])))
    assert 1.0 - lost.sudden / lost.rigid == pytest.approx(0.05, rel=0.1)
    assert eval(better[2]) == Fidelity(law="impulse", contact_resolution=50.0, solver="newton")
    assert "to lose" not in explain(scene, NEWTON, costs=False)
    cube = Scene([replace(block, shape=Box((0.02,) * 3), material=Material(0.25))], [Ground()])
    assert "half its friction" in explain(cube, PRESETS["fast"], costs=False)
    ball = Scene([Body(Sphere(0.02), mass=0.1, position=(0, 0, 0.02))], [Ground()])
    assert "Standing" not in explain(ball, PRESETS["fast"], costs=False)

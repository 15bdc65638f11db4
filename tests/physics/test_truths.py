"""What theory says where closed forms of single bodies on a plane say nothing.

The right values stand in `physics.reference.truths`; a test has the fidelities that were wrong, and
one of the other law. `python -m benchmarks.truths` shows all of them.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from physics import PRESETS, Box, Fidelity, Ground, Mesh, Particles, Scene, Sphere, explain
from physics.model.pairs import Layout
from physics.reference import blocks, meshes, truths
from physics.scene.fidelity import NEWTON

BALL, CUBE = Sphere(truths.RADIUS), Box((truths.RADIUS,) * 3)


@pytest.mark.parametrize(
    "level", ["balanced", "solid", NEWTON], ids=["balanced", "solid", "newton"]
)
def test_a_ring_presses_on_a_ball_with_its_weight_and_its_inertia(level, stress):
    if level is NEWTON and not stress:
        pytest.skip("a kernel of its own for six seconds; see make stress")
    assert truths.swinging_force(level) == pytest.approx(3.0, rel=2e-3)
    assert truths.circling_forces(level) == pytest.approx((1.0, 1.0, 1.0), rel=3e-3)


@pytest.mark.parametrize(
    "level", ["balanced", "solid", NEWTON], ids=["balanced", "solid", "newton"]
)
def test_a_cube_slides_down_a_dome_with_the_force_of_theory(level):
    assert blocks.dome_slide(level) == pytest.approx((1.0, 1.0), rel=5e-3)


@pytest.mark.parametrize(("level", "error"), [("balanced", 0.05), ("solid", 0.02), (NEWTON, 0.02)])
def test_a_ball_leaves_a_dome_where_theory_says(level, error):
    assert truths.leaving_cosine(level) == pytest.approx(1.0, abs=error)


@pytest.mark.parametrize("others", [0, 33])
@pytest.mark.parametrize(
    "level", ["balanced", "solid", NEWTON], ids=["balanced", "solid", "newton"]
)
def test_impacts_without_friction_keep_their_energy(level, others):
    if others and level is NEWTON:
        pytest.skip("Newton's method has at most 32 bodies")
    assert truths.cradle_energy(level, others=others) == pytest.approx(1.0, abs=5e-3)
    if level != "balanced":  # all five separate together: relative speeds become -e times as fast
        energy = (1.0 + 4.0 * 0.5**2) / 5.0
        assert truths.cradle_energy(level, 0.5, others) == pytest.approx(energy, abs=1e-5)


@pytest.mark.parametrize("others", [0, 33])
@pytest.mark.parametrize("level", ["fast", "solid", NEWTON], ids=["fast", "solid", "newton"])
@pytest.mark.parametrize(("restitution", "speed"), [(1.0, 0.05), (0.1, 0.1), (0.5, 0.02)])
def test_impacts_without_a_load_have_their_restitution_however_slow(
    level, restitution, speed, others, stress
):
    if others and level is NEWTON:
        pytest.skip("Newton's method has at most 32 bodies")
    if others and level == "fast" and not stress:
        pytest.skip("a kernel of its own for ten seconds; see make stress")
    measured = truths.falling_restitution(level, restitution, speed, others=others)
    assert measured == pytest.approx(restitution, abs=1.5e-3)
    if not others:
        measured = truths.falling_restitution(level, restitution, speed, wall=True)
        assert measured == pytest.approx(restitution, abs=1.5e-3)


@pytest.mark.parametrize("level", ["fast", "accurate", "solid"])
@pytest.mark.parametrize(("friction", "spin"), [(0.3, 0.0), (0.1, 30.0)])
def test_a_ball_that_slides_through_a_plastic_impact_feels_all_of_its_friction(
    level, friction, spin
):
    ratios = truths.plastic_friction(level, friction, spin)
    assert ratios == pytest.approx(np.ones(len(ratios)), abs=1e-3)


@pytest.mark.parametrize("shape", [BALL, CUBE], ids=["ball", "cube"])
@pytest.mark.parametrize(("level", "error"), [("fast", 3e-3), ("accurate", 1e-4), ("solid", 1e-5)])
def test_an_impact_in_the_first_step_has_its_restitution(shape, level, error):
    for restitution in (0.5, 1.0):
        ratios = truths.early_restitution(level, shape, restitution)
        assert ratios == pytest.approx(np.ones(len(ratios)), abs=error)


@pytest.mark.parametrize(
    ("level", "error"), [("fast", 0.03), ("balanced", 0.03), ("accurate", 1e-3), ("solid", 1e-9)]
)
def test_a_ball_that_falls_from_ten_metres_keeps_its_energy_in_ten_bounces(level, error):
    energies = truths.bounced_energy(level)
    assert energies == pytest.approx(np.ones(len(energies)), abs=error)


@pytest.mark.parametrize("level", ["solid", NEWTON], ids=["solid", "newton"])
def test_a_rocking_block_keeps_its_angular_momentum_about_the_edge_that_it_hits(level):
    """In the mean: at 2 ms the impact comes up to half a step early or late."""
    assert blocks.rocking(level).mean() == pytest.approx(blocks.ROCKING, rel=0.015)


def test_springs_rock_a_slim_block_right_at_the_substep_that_explain_names():
    """Edges sink: `balanced` loses 9 % too much."""
    assert blocks.rocking("balanced").mean() < 0.95 * blocks.ROCKING
    block = truths.Body(Box((blocks.BLOCK[0], *blocks.BLOCK)), mass=truths.MASS)
    text = explain(Scene([block], [Ground()]), PRESETS["balanced"], costs=False)
    substep = re.search("at most 5 % of that angle by sinking: substep=([0-9.e-]+)", text)[1]
    better = replace(PRESETS["balanced"], substep=float(substep))
    assert blocks.rocking(better).mean() == pytest.approx(blocks.ROCKING, rel=0.02)


@pytest.mark.parametrize("level", ["solid", "fast", "accurate"])
def test_a_ball_of_particles_is_a_ball(level, stress):
    if level != "solid" and not stress:
        pytest.skip("kernels of its own for twenty seconds; see make stress")
    ball = Particles([[0.0, 0.0, 0.0]], truths.RADIUS)
    for name, _, value in truths.BALLS if stress else truths.BALLS[5:6]:
        assert value(level, ball) == pytest.approx(value(level, BALL), rel=1e-6), name


@pytest.mark.parametrize("level", [*PRESETS.values(), NEWTON], ids=[*PRESETS, "newton"])
def test_a_mesh_within_the_sink_of_a_ball_touches_as_that_ball(level: Fidelity, stress):
    """A coarser one is a polyhedron, whose corners hop where a ball slides."""
    vertices, faces = meshes.ball(truths.RADIUS, 128)
    mesh = Mesh(vertices=vertices, faces=faces)
    cube = truths.Body(Box((truths.RADIUS,) * 3), mass=truths.MASS, position=(0.1, 0.0, 0.0))
    balls = [truths.Body(mesh, mass=truths.MASS, position=(x, 0.0, 0.0)) for x in (0.2, 0.3)]
    pairs = Layout.of(Scene([cube, *balls], [Ground(height=-0.1)]), level).half_pairs
    of_balls = [pair for pair in pairs if 0 not in (pair.owner, pair.other)]
    assert len(of_balls) == 3  # with each other and with the ground
    for pair in of_balls:
        assert pair.samples.positions == pytest.approx(np.zeros((1, 3)))
        assert pair.samples.radius == pytest.approx(truths.RADIUS, rel=1e-3)
    assert all(pair.surface.mesh is None for pair in pairs)
    if stress:
        for name, _, value in truths.BALLS:
            assert value(level, mesh) == pytest.approx(value(level, BALL), rel=2e-3), name


def test_a_mesh_with_a_cavity_is_no_ball():
    """A body may be in it."""
    vertices, faces = meshes.hollow_ball(0.05, 0.035)
    shell = truths.Body(Mesh(vertices=vertices, faces=faces), mass=truths.MASS)
    inside = truths.Body(Sphere(0.01), mass=truths.MASS)
    pairs = Layout.of(Scene([shell, inside]), PRESETS["fast"]).half_pairs
    assert [pair.surface.mesh is not None for pair in pairs] == [True]

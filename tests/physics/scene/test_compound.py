"""Compounds have the mass, the samples and the surfaces of their parts put together."""

import itertools
import math
import pickle

import numpy as np
import pytest

from physics import Body, Box, Capsule, Compound, Fidelity, Ground, Part, Scene, Sphere, World
from physics.rotation import from_rotation_vector
from physics.scene.internal_faces import hidden_faces
from physics.scene.shapes import Shape

BAR, STEM = Box((0.04, 0.01, 0.015)), Box((0.01, 0.02, 0.015))
T = Compound([(BAR, (0.3, 0.01, 0.2)), (STEM, (0.3, -0.02, 0.2))])
HALVES = Compound([(Box((0.01, 0.02, 0.02)), (x, 0, 0)) for x in (-0.01, 0.01)])
DUMBBELL = Compound(
    [(Sphere(0.02), (0, 0, z)) for z in (-0.05, 0.05)] + [(Capsule(0.01, 0.02), (0, 0, 0))]
)
QUARTER = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))


# --- mass ---------------------------------------------------------------------------------------


def test_a_t_has_the_mass_properties_of_its_boxes():
    a, b, c = 2.0 / 3.0, 1.0 / 3.0, np.array([[0, 0.01, 0], [0, -0.02, 0]])
    assert T.volume == pytest.approx(72e-6)
    np.testing.assert_allclose([part.position for part in T.parts], c, atol=1e-15)
    own = a / 3 * np.array([0.01**2 + 0.015**2, 0.04**2 + 0.015**2, 0.04**2 + 0.01**2])
    own += b / 3 * np.array([0.02**2 + 0.015**2, 0.01**2 + 0.015**2, 0.01**2 + 0.02**2])
    apart = a * 0.01**2 + b * 0.02**2
    np.testing.assert_allclose(T.inertia(0.1), 0.1 * (own + np.array([apart, 0.0, apart])))
    assert T.inertia(np.array([1.0, 2.0])).shape == (2, 3)
    assert T.width == 0.02
    assert T.reach == pytest.approx(math.sqrt(0.04**2 + 0.02**2 + 0.015**2))


def test_a_lattice_of_particles_agrees_on_a_compound_of_turned_parts():
    turn = tuple(from_rotation_vector(np.array([0.4, 0.0, 0.0])))
    shape = Compound([(Box((0.05, 0.02, 0.02)), (0, 0, 0), turn), (Sphere(0.03), (0.08, 0, 0))])
    cell = 0.24 / 141
    axis = cell * (np.arange(141) - 70.0)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = points[np.min([part.distance(points) for part in shape.parts], axis=0) < 0.0]
    assert len(inside) * cell**3 == pytest.approx(shape.volume, rel=0.01)
    np.testing.assert_allclose(inside.mean(axis=0), 0.0, atol=3e-4)
    squares = np.mean(inside**2, axis=0)
    expected = [squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1]]
    np.testing.assert_allclose(shape.inertia(1.0), expected, rtol=0.01)


def test_other_sizes_scale_as_lengths_do():
    large = T.scaled(3.0)
    assert large.volume == pytest.approx(27.0 * T.volume)
    np.testing.assert_allclose(large.inertia(1.0), 9.0 * T.inertia(1.0))
    assert large.reach == pytest.approx(3.0 * T.reach)


def test_a_compound_of_one_part_is_that_part():
    box = Box((0.01, 0.02, 0.03))
    one = Compound([(box, (1.0, 2.0, 3.0))])
    assert one.only == box
    assert one.parts[0].position == (0.0, 0.0, 0.0)
    np.testing.assert_array_equal(one.inertia(0.3), box.inertia(0.3))
    np.testing.assert_array_equal(one.samples(0.01, 1e-4).weights, box.samples(0.01, 1e-4).weights)
    assert one.surface(1e-4) == box.surface(1e-4)
    assert T.only is None
    with pytest.raises(ValueError, match="a surface for each of its parts"):
        T.surface(1e-4)


def test_compounds_are_values():
    assert Compound(T.parts) == T
    assert hash(T) == hash(Compound(T.parts))
    assert pickle.loads(pickle.dumps(T)) == T
    assert isinstance(T, Shape)


# --- bad input ----------------------------------------------------------------------------------


def test_skewed_axes_are_refused_with_the_turn_that_rights_them():
    parts = [(BAR, (0.0, 0.0, 0.0)), (STEM, (0.03, -0.03, 0.0))]
    with pytest.raises(
        ValueError, match=r"product of inertia J_xy of .* by the quaternion"
    ) as told:
        Compound(parts)
    text = str(told.value)
    turn = np.array([float(x) for x in text[text.rindex("(") + 1 : text.rindex(")")].split(",")])
    whole = Part(Sphere(1.0), (0, 0, 0), tuple(turn))
    turned = [(shape, tuple(whole.outward(np.array(place))), tuple(turn)) for shape, place in parts]
    assert np.all(Compound(turned).inertia(1.0) > 0.0)


@pytest.mark.parametrize(
    ("parts", "error", "match"),
    [
        ([], ValueError, "at least one part, got none"),
        ("box", TypeError, "must be a sequence of parts, got 'box'"),
        (BAR, TypeError, "must be a sequence of parts"),
        ([BAR], TypeError, r"parts\[0\] must be a Part, \(shape, position\)"),
        ([(BAR, (0, 0, 0)), (BAR,)], TypeError, r"parts\[1\] must be a Part"),
        ([(T, (0, 0, 0))], TypeError, r"parts\[0\]: Part.shape must be Sphere or Box or Capsule"),
        ([(BAR, (0, 0))], ValueError, r"parts\[0\]: Part.position must be 3 numbers"),
        ([(BAR, (0, 0, math.nan))], ValueError, "Part.position must be finite"),
        ([(BAR, (0, 0, 0), (0, 0, 0, 0))], ValueError, "Part.orientation must be a quaternion"),
    ],
)
def test_parts_that_are_none_are_refused_by_name(parts, error, match):
    with pytest.raises(error, match=match):
        Compound(parts)


def test_particles_of_a_compound_are_refused_by_name():
    with pytest.raises(ValueError, match=r"Fidelity.geometry 'particle' does not support a Com"):
        World(Scene([Body(T)], [Ground()]), Fidelity(geometry="particle"))


# --- samples ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [T, HALVES, DUMBBELL])
@pytest.mark.parametrize("spacing", [0.01, 0.005])
def test_samples_lie_on_the_core_of_the_whole(shape, spacing):
    for group, sharp in shape.sample_sets(spacing, 2e-4):
        apart = np.min([part.distance(group.positions) for part in shape.parts], axis=0)
        least = 2e-4 if sharp else group.radius
        assert np.all(apart > -1.8 * least)  # a corner's inset is sqrt(3) times the rounding
        inset = apart < -0.99 * least
        assert inset.all() or (np.count_nonzero(~inset) == 4 and apart.max() < 1e-12)  # on the seam


@pytest.mark.parametrize("shape", [T, HALVES, DUMBBELL])
def test_the_heaviest_side_weighs_one(shape):
    found = shape.samples(0.01, 0.0)
    sums = []
    for normal in (*np.eye(3), *-np.eye(3)):
        height = found.positions @ normal - found.radius
        sums.append(found.weights[height < height.min() + 1e-9].sum())
    assert max(sums) == pytest.approx(1.0)


def test_a_flat_compound_bears_under_its_centre_of_mass():
    found = T.samples(0.01, 0.0)
    low = found.positions[:, 2] < -0.0149
    middle = found.weights[low] @ found.positions[low] / found.weights[low].sum()
    np.testing.assert_allclose(middle[:2], 0.0, atol=1e-3)


def test_no_sample_lies_on_a_seam_but_where_it_ends_in_an_edge():
    points = T.samples(0.01, 0.0).positions
    on_seam = np.isclose(points[:, 1], 0.0) & (np.abs(points[:, 0]) < 0.0101)
    ends = {tuple(row) for row in np.round(points[on_seam], 6).tolist()}
    assert ends == {(x, 0.0, z) for x in (-0.01, 0.01) for z in (-0.015, 0.015)}
    # two halves have one sample where both have a corner, in line with its neighbours
    points = HALVES.samples(0.01, 2e-4).positions
    assert np.isclose(points[:, 0], 0.0).sum() == 4
    assert len(points) == len(np.unique(np.round(points, 9), axis=0))


def test_samples_of_one_radius_make_a_group():
    assert [group.samples.radius for group in DUMBBELL.sample_sets(0.01, 1e-4)] == [0.02, 0.01]
    assert len(T.sample_sets(0.01, 1e-4)) == 1
    assert T.sample_sets(0.01, 1e-4)[0].face_normals


def test_a_ball_that_a_box_swallows_has_no_sample():
    shape = Compound([(Box((0.05, 0.05, 0.05)), (0, 0, 0)), (Sphere(0.01), (0, 0, 0))])
    (group,) = shape.sample_sets(0.05, 1e-4)
    assert group.face_normals


# --- seams --------------------------------------------------------------------------------------


def test_a_seam_hides_what_the_other_box_stands_on():
    of_bar, of_stem = hidden_faces(T.parts)
    (bar,), (stem,) = of_bar, of_stem
    # the axes after y are z and x: flush above and below, and as wide as the stem
    # to 20 µm within the stem, the latter of the two
    assert (bar.axis, bar.sign, bar.face) == (1, -1.0, pytest.approx(0.01 + 2e-5))
    np.testing.assert_allclose([bar.low, bar.high], [(-math.inf, -0.01), (math.inf, 0.01)])
    assert (stem.axis, stem.sign, stem.face) == (1, 1.0, pytest.approx(0.02 - 2e-5))
    assert stem.low == (-math.inf, -math.inf)
    assert stem.high == (math.inf, math.inf)


def test_a_box_turned_by_a_quarter_hides_as_much():
    turned = Compound([(BAR, (0, 0, 0)), (Box((0.02, 0.01, 0.015)), (0, -0.03, 0), QUARTER)])
    (bar,), _ = hidden_faces(turned.parts)
    np.testing.assert_allclose([bar.low, bar.high], [(-math.inf, -0.01), (math.inf, 0.01)])


def test_boxes_that_touch_at_an_edge_or_not_at_all_hide_nothing():
    for place in ((0.05, -0.03, 0.0), (0.0, -0.031, 0.0)):
        first, second = Part(BAR), Part(STEM, place)
        assert hidden_faces([first, second]) == [[], []]
    turn = tuple(from_rotation_vector(np.array([0.0, 0.0, 0.3])))
    assert hidden_faces([Part(BAR), Part(STEM, (0.0, -0.03, 0.0), turn)]) == [[], []]
    assert hidden_faces([Part(BAR), Part(Sphere(0.01), (0.0, -0.02, 0.0))]) == [[], []]


def test_every_pair_of_a_row_of_boxes_has_two_covers():
    row = Compound([(Box((0.01, 0.01, 0.01)), (0.02 * k, 0, 0)) for k in range(4)])
    assert [len(some) for some in hidden_faces(row.parts)] == [1, 2, 2, 1]
    assert all(c.axis == 0 for c in itertools.chain(*hidden_faces(row.parts)))

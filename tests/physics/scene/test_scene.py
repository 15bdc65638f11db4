"""A scene is checked as it is written: an error names the field, its value and what is right."""

import dataclasses
import math

import numpy as np
import pytest

from physics import Body, Box, Capsule, Drive, Ground, Material, Scene, Sphere, Static

BALL = Sphere(0.1)
GOOD = {
    Material: {},
    Body: {"shape": BALL},
    Static: {"shape": BALL},
    Ground: {},
    Drive: {"shape": BALL, "mass": 1.0, "force_limit": 10.0},
    Scene: {"bodies": [Body(BALL)]},
    Sphere: {"radius": 0.1},
    Box: {"half_extents": (0.1, 0.2, 0.3)},
    Capsule: {"radius": 0.1, "half_length": 0.2},
}
AT_LEAST_ZERO = [(Material, "friction"), (Drive, "damping_ratio")]
ABOVE_ZERO = [
    (Material, "stiffness"),
    (Body, "mass"),
    (Body, "density"),
    (Drive, "mass"),
    (Drive, "force_limit"),
    (Drive, "frequency"),
    (Sphere, "radius"),
    (Capsule, "radius"),
    (Capsule, "half_length"),
]
NUMBERS = [*AT_LEAST_ZERO, *ABOVE_ZERO, (Material, "restitution"), (Ground, "height")]
VECTORS = [
    (Body, "position"),
    (Body, "linear_velocity"),
    (Body, "angular_velocity"),
    (Static, "position"),
    (Drive, "position"),
    (Scene, "gravity"),
    (Box, "half_extents"),
]
TURNS = [(Body, "orientation"), (Static, "orientation"), (Drive, "orientation")]
NOT_NUMBERS = ["1", None, True, [1.0], 1j, np.ones(1)]
TYPES = [
    (Body, "shape", "Shape"),
    (Static, "shape", "Shape"),
    (Drive, "shape", "Shape"),
    (Body, "material", "Material"),
    (Static, "material", "Material"),
    (Ground, "material", "Material"),
    (Drive, "material", "Material"),
]
NAME = {"ids": lambda x: x.__name__ if isinstance(x, type) else str(x)}


def refused(kind, field, value, error, *words):
    with pytest.raises(error) as caught:
        kind(**{**GOOD[kind], field: value})
    message = str(caught.value)
    for word in (f"{kind.__name__}.{field}", *words):
        assert word in message


@pytest.mark.parametrize("kind", GOOD, **NAME)
def test_good_fields_are_accepted_and_frozen(kind):
    made = kind(**GOOD[kind])
    for field in dataclasses.fields(kind):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(made, field.name, 1.0)
    assert made == kind(**GOOD[kind])


@pytest.mark.parametrize(("kind", "field"), NUMBERS, **NAME)
def test_what_is_not_a_number_is_refused(kind, field):
    for value in NOT_NUMBERS:
        if value is None and (kind, field) in {
            (Body, "mass"),
            (Body, "density"),
            (Material, "stiffness"),
        }:
            continue
        refused(kind, field, value, TypeError, "must be a number", repr(value))


@pytest.mark.parametrize(("kind", "field"), NUMBERS, **NAME)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_nan_and_infinity_are_refused(kind, field, value):
    refused(kind, field, value, ValueError, "finite", repr(value))


@pytest.mark.parametrize(("kind", "field"), ABOVE_ZERO, **NAME)
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_what_must_be_above_zero_is(kind, field, value):
    refused(kind, field, value, ValueError, "above 0", repr(value))


@pytest.mark.parametrize(("kind", "field"), AT_LEAST_ZERO, **NAME)
def test_what_must_not_be_negative_is_not(kind, field):
    refused(kind, field, -1e-9, ValueError, "at least 0", "-1e-09")
    kind(**{**GOOD[kind], field: 0.0})


@pytest.mark.parametrize("value", [-0.01, 1.01])
def test_restitution_lies_between_zero_and_one(value):
    refused(Material, "restitution", value, ValueError, "at least 0 and at most 1", repr(value))


@pytest.mark.parametrize(("kind", "field"), VECTORS, **NAME)
def test_a_vector_has_three_finite_numbers(kind, field):
    refused(kind, field, (1.0, 2.0), ValueError, "3 numbers (x, y, z)", "(1.0, 2.0)")
    refused(kind, field, 1.0, ValueError, "3 numbers (x, y, z)")
    refused(kind, field, [[1.0, 2.0, 3.0]], ValueError, "3 numbers (x, y, z)", "[[1.0, 2.0, 3.0]]")
    refused(kind, field, (1.0, math.nan, 1.0), ValueError, "finite", "nan")
    refused(kind, field, (1.0, math.inf, 1.0), ValueError, "finite", "inf")
    refused(kind, field, "abc", TypeError, "3 numbers", "'abc'")
    made = kind(**{**GOOD[kind], field: np.array([1, 2, 3])})
    assert getattr(made, field) == (1.0, 2.0, 3.0)


def test_a_box_has_three_positive_extents():
    with pytest.raises(ValueError, match=r"Box\.half_extents \(y\) must be .*got -0\.2"):
        Box((0.1, -0.2, 0.3))


@pytest.mark.parametrize(("kind", "field"), TURNS, **NAME)
def test_a_quaternion_has_a_length_and_is_normalised(kind, field):
    refused(kind, field, (0, 0, 0, 0), ValueError, "non-zero length", "(0, 0, 0, 1)")
    refused(kind, field, (0, 0, 1), ValueError, "4 numbers (x, y, z, w)")
    refused(kind, field, (0, 0, math.nan, 1), ValueError, "finite")
    made = kind(**{**GOOD[kind], field: (0, 3, 0, 4)})
    np.testing.assert_allclose(getattr(made, field), (0, 0.6, 0, 0.8))


@pytest.mark.parametrize(("kind", "field", "wanted"), TYPES, **NAME)
def test_a_part_of_the_wrong_type_is_refused(kind, field, wanted):
    for value in (None, 1.0, "ball", Sphere, Material):
        refused(kind, field, value, TypeError, f"must be {wanted}", repr(value))


@pytest.mark.parametrize("kind", GOOD, **NAME)
def test_an_unknown_name_is_refused(kind):
    with pytest.raises(TypeError, match="bounce"):
        kind(**GOOD[kind], bounce=1.0)


def test_mass_follows_from_density_and_excludes_it():
    assert Body(Box((0.1, 0.1, 0.1))).mass == pytest.approx(8.0)
    assert Body(Box((0.1, 0.1, 0.1)), density=500.0).mass == pytest.approx(4.0)
    with pytest.raises(ValueError, match=r"mass or density, not both: got mass=1\.0, density=2\.0"):
        Body(BALL, mass=1.0, density=2.0)


@pytest.mark.parametrize("field", ["bodies", "statics", "drives"])
def test_members_of_a_scene_are_named_by_their_place(field):
    refused(Scene, field, "bodies", TypeError, "sequence", "'bodies'")
    refused(Scene, field, 3, TypeError, "sequence", "3")
    good = {"bodies": Body(BALL), "statics": Ground(), "drives": Drive(BALL, 1.0, 1.0)}[field]
    refused(Scene, field, [good, BALL], TypeError, f"Scene.{field}[1]", "Sphere")
    assert getattr(Scene(**{"bodies": [Body(BALL)], field: [good]}), field) == (good,)


def test_a_scene_holds_something_that_moves():
    with pytest.raises(ValueError, match=r"Scene\.bodies must hold at least one Body"):
        Scene(statics=[Ground()])
    Scene(drives=[Drive(BALL, 1.0, 1.0)])

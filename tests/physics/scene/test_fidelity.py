"""Fidelity refuses what it can't mean, and its presets are what their names say."""

import dataclasses
import math

import pytest

from physics import PRESETS, Fidelity
from physics.scene.fidelity import resolve

LIMITS = {"contact_resolution": 0.7, "spacing": 1.0, "rounding": 0.5, "skin": 1.0}


def test_presets_grow_finer():
    steps = [PRESETS[name].substep for name in ("fast", "balanced", "accurate")]
    assert steps == [0.02 / 7, 2e-3, 0.25e-3]
    spacings = [PRESETS[name].spacing for name in ("fast", "balanced", "accurate")]
    assert spacings == sorted(spacings, reverse=True)
    assert Fidelity() == PRESETS["balanced"]


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_found_by_its_name(name):
    assert resolve(name) is PRESETS[name]
    assert resolve(PRESETS[name]) is PRESETS[name]


def test_an_unknown_preset_is_named_with_the_nearest():
    with pytest.raises(ValueError, match=r"fidelity.*'balanced'.*got 'ballanced'.*did you mean"):
        resolve("ballanced")


@pytest.mark.parametrize("value", [None, 3, {"substep": 1e-3}, Fidelity])
def test_what_is_no_fidelity_is_refused(value):
    with pytest.raises(TypeError, match=r"fidelity must be one of.*got"):
        resolve(value)


@pytest.mark.parametrize("field", ["law", "geometry", "damping"])
@pytest.mark.parametrize("value", ["impuls", None, 3])
def test_an_unknown_choice_is_named_with_the_valid_ones(field, value):
    with pytest.raises(
        ValueError, match=rf"Fidelity\.{field} must be one of \[.*\], got {value!r}"
    ):
        Fidelity(**{field: value})


@pytest.mark.parametrize("field", ["substep", *LIMITS])
def test_a_number_is_finite_positive_and_within_its_limits(field):
    for value in (0.0, -1.0, math.nan, math.inf):
        wanted = rf"Fidelity\.{field}.* must be finite and (at least|above)"
        with pytest.raises(ValueError, match=wanted):
            Fidelity(**{field: value})
    for value in ("1", None, True):
        wanted = rf"Fidelity\.{field}.* must be a number, got {value!r}"
        with pytest.raises(TypeError, match=wanted):
            Fidelity(**{field: value})
    if field in LIMITS:
        Fidelity(**{field: LIMITS[field]})
        with pytest.raises(ValueError, match=rf"Fidelity\.{field}"):
            Fidelity(**{field: LIMITS[field] * 1.01})


def test_each_law_has_its_largest_contact_resolution():
    with pytest.raises(ValueError, match=r"Fidelity\.contact_resolution .*at most 0\.7, got 1\.8"):
        Fidelity(contact_resolution=1.8)
    assert Fidelity(law="impulse", contact_resolution=2.0).contact_resolution == 2.0
    with pytest.raises(ValueError, match=r"Fidelity\.contact_resolution .*at most 2, got 2\.1"):
        Fidelity(law="impulse", contact_resolution=2.1)


def test_damping_by_a_dashpot_belongs_to_the_spring_law():
    with pytest.raises(ValueError, match=r"Fidelity\.damping 'dashpot' requires law='spring'"):
        Fidelity(law="impulse", damping="dashpot")


def test_collision_substeps_are_counted_from_one():
    with pytest.raises(ValueError, match=r"Fidelity\.collision_substeps must be at least 1, got 0"):
        Fidelity(collision_substeps=0)
    for value in (1.0, "5", True):
        with pytest.raises(TypeError, match=r"Fidelity\.collision_substeps must be an integer"):
            Fidelity(collision_substeps=value)


def test_a_fidelity_is_frozen_and_has_no_other_field():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Fidelity().substep = 1.0
    with pytest.raises(TypeError, match="substeps"):
        Fidelity(substeps=3)

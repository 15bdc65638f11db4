"""Random scenes and arguments raise errors that name the field, or run and stay finite."""

import pytest

from benchmarks.fuzz import outcomes
from benchmarks.fuzz.arguments import findings
from benchmarks.fuzz.families import FAMILIES
from benchmarks.fuzz.outcomes import FINDING, RAN, REFUSED, outcome_of

ONE_BOX = next(family for family in FAMILIES if family.name == "one box")


@pytest.fixture(scope="module")
def drawn():
    return [outcome_of(ONE_BOX, number) for number in range(100)]


def test_a_hundred_scenes_of_a_box_are_refused_or_stay_finite(drawn):
    kinds = [outcome.kind for outcome in drawn]
    assert set(kinds) == {REFUSED, RAN}
    assert 20 < kinds.count(RAN) < 95


def test_scenes_of_a_family_share_a_kernel(drawn):
    assert len({outcome.features for outcome in drawn if outcome.kind == RAN}) == 1


def test_scenes_depend_on_their_number_only(drawn):
    assert [outcome_of(ONE_BOX, number) for number in (7, 3)] == [drawn[7], drawn[3]]


def test_a_message_without_a_field_is_a_finding(monkeypatch):
    def refuse(*_, **__):
        raise ValueError("no")

    monkeypatch.setattr(outcomes, "World", refuse)
    assert {outcome_of(ONE_BOX, number).kind for number in range(3)} == {FINDING}


def test_garbage_is_refused_by_name():
    calls, wrong = findings()
    assert calls > 5000
    assert wrong == []

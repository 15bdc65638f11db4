"""Components of vectors, as settings list them."""

import pytest

from training.settings.components import component_indices
from training.settings.errors import UsageError


@pytest.mark.parametrize(
    ("listed", "expected"),
    [
        ([0, -1], [0, 6]),
        (["2:4", 6], [2, 3, 6]),
        (["0:-1:3"], [0, 3]),
        (["-2:", ":1"], [5, 6, 0]),
        (["3:7"], [3, 4, 5, 6]),
        ([], []),
    ],
)
def test_indices_and_slices_are_counted_from_zero(listed, expected):
    assert component_indices("components", listed, 7) == expected


@pytest.mark.parametrize("entry", [7, -8, "7:", "0:8", "-8:2", "3:3", "4:2"])
def test_components_out_of_range_raise(entry):
    with pytest.raises(UsageError, match=rf"units: {entry} in .* of the goal, -7 to 6"):
        component_indices("units", [entry], 7, "goal")


@pytest.mark.parametrize("listed", [[2, 2], [0, -7], ["0:3", 1]])
def test_components_that_are_listed_twice_raise(listed):
    with pytest.raises(UsageError, match=r"lists component \d of the observation twice"):
        component_indices("components", listed, 7)


@pytest.mark.parametrize("wrong", ["3", "-:3", "3:-", "1:2:0", "a:b", 0.5, True])
def test_malformed_slices_raise(quick_ppo, wrong):
    with pytest.raises(UsageError, match=r"components is a list of indices, as in \[0, 1, -1\]"):
        quick_ppo.replace(
            policy="training.policies.symlog.SymlogActorCriticPolicy",
            policy_kwargs={"components": [wrong]},
        )

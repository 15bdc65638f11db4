"""Mistakes in a custom task raise an error with the method's name, at the first reset."""

import numpy as np
import pytest

from rigid_envs import RigidEnv
from rigid_envs.tasks.push import Push


class Forgetful(Push):
    def observe(self, world, now, out):
        whole = np.empty_like(out)
        super().observe(world, now, whole)
        out[:, :-2] = whole[:, :-2]


class FlatStart(Push):
    def start(self, world, mask, draws):
        return super().start(world, mask, draws)[0]


class TooFewGoals(Push):
    def achieved(self, world, now):
        return super().achieved(world, now)[:, :2]


class NoGoals(Push):
    def achieved(self, world, now):
        pass


class NoTerms(Push):
    def terms(self, *args):
        pass


class LackingTerm(Push):
    def terms(self, *args):
        return {}


class OneTermForAll(Push):
    def terms(self, *args):
        return {"reach": -0.1}


class TallTerm(Push):
    def terms(self, *args):
        return {"reach": super().terms(*args)["reach"][:, None]}


class OwnSuccess(Push):
    def terms(self, *args):
        return {**super().terms(*args), "is_success": np.ones(1)}


@pytest.mark.parametrize(
    ("task", "message"),
    [
        (Forgetful, r"Forgetful\.observe must write all components of out; NaN is left in \["),
        (FlatStart, r"FlatStart\.start must return goals of shape \(1, 3\), .*got shape \(3,\)"),
        (TooFewGoals, r"TooFewGoals\.achieved must .*shape \(1, 3\).*got shape \(1, 2\)"),
        (NoGoals, r"NoGoals\.achieved must .*got None"),
        (NoTerms, r"NoTerms\.terms must return a dict .*got None"),
        (LackingTerm, r"LackingTerm\.terms must .*\['reach'\] is missing from \[\]"),
        (OneTermForAll, r"OneTermForAll\.terms must .*shape \(1,\).*got -0\.1 for 'reach'"),
        (OwnSuccess, r"OwnSuccess\.terms must not return \['is_success'\]"),
        (TallTerm, r"TallTerm\.terms must .*got shape \(1, 1\) for 'reach'"),
    ],
)
def test_an_invalid_result_of_a_task_is_named(task, message):
    with pytest.raises(ValueError, match=message):
        RigidEnv(task).reset(seed=0)

"""RLlib on the vector environment."""

import math
import runpy
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from training.cluster.rllib import check_gymnasium
from training.settings.errors import UsageError

EXAMPLE = Path(__file__).parents[3] / "examples" / "rllib_push.py"


def test_another_gymnasium_than_rllib_needs_is_named(monkeypatch):
    versions = {"ray": "2.60.0", "gymnasium": "1.4.0"}
    needed = ["gymnasium==1.2.2; extra == 'all'", 'gymnasium==1.2.2; extra == "rllib"', "numpy"]
    monkeypatch.setattr(metadata, "version", versions.__getitem__)
    monkeypatch.setattr(metadata, "requires", lambda _: needed)
    with pytest.raises(
        UsageError, match=r"gymnasium is 1.4.0, but RLlib of ray 2.60.0 needs 1.2.2"
    ):
        check_gymnasium()
    versions["gymnasium"] = "1.2.2"
    check_gymnasium()


def test_a_missing_ray_names_its_extra(monkeypatch):
    def missing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", missing)
    with pytest.raises(UsageError, match=r"RLlib requires ray; to install: pip install"):
        check_gymnasium()


@pytest.mark.skipif(find_spec("ray") is None, reason="needs Ray")
def test_the_example_steps_all_worlds_in_one_call_and_learns(joined):
    check_gymnasium()
    example = runpy.run_path(str(EXAMPLE))
    words = ["--num-envs", "32", "--num-steps", "50", "--total-steps", "3200", "--threads", "1"]
    options = example["parse"]([*words, "--evaluate-every", "2", "--episodes", "32"])
    algorithm = example["configured"](options).build_algo()
    try:
        worlds = algorithm.env_runner.env.unwrapped
        assert type(worlds).__name__ == "RigidVectorEnv"
        assert worlds.num_envs == 32
        assert worlds.autoreset_mode.name == "NEXT_STEP"
        before = algorithm.get_module().state_dict()
        before = {name: value.clone() for name, value in before.items()}
        results = [algorithm.train() for _ in range(2)]
        after = algorithm.get_module().state_dict()
        assert any(not np.array_equal(before[name], after[name]) for name in before)
        steps = results[-1]["env_runners"]["num_env_steps_sampled_lifetime"]
        assert 3200 <= steps < 3300
        success = results[-1]["evaluation"]["env_runners"]["success"]
        assert 0.0 <= success <= 1.0
        assert not math.isnan(success)
    finally:
        algorithm.stop()

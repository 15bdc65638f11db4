"""rl-baselines3-zoo reads the packaged settings with its own reader and builds models from them.

It runs in a separate process, because importing it changes Gymnasium's TimeLimit.
"""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml

from training.settings.algorithms import ALGORITHMS
from training.settings.config_file import CONFIG_FOLDER, load_config, packaged_environments

ROOT = Path(__file__).parents[3]
ZOO = """
import json, sys
from argparse import Namespace
from copy import deepcopy
import rigid_envs
from rl_zoo3 import ALGOS
from rl_zoo3.exp_manager import ExperimentManager

algo, config, log_folder, *env_ids = sys.argv[1:]
found = {}
for env_id in env_ids:
    manager = ExperimentManager(Namespace(), algo, env_id, log_folder, config=config, verbose=0)
    read = manager.read_hyperparameters()[0]
    settings, manager.env_wrapper, *_ = manager._preprocess_hyperparams(read)
    envs = manager.create_envs(1, no_log=True)
    model = ALGOS[algo](env=envs, seed=0, device="cpu", **deepcopy(settings))
    settings = {
        name: value(1.0) if name in ("learning_rate", "clip_range") else value
        for name, value in settings.items()
    }
    if isinstance(settings["policy"], type):
        settings["policy"] = f"{settings['policy'].__module__}.{settings['policy'].__name__}"
    if "replay_buffer_class" in settings:
        settings["replay_buffer_class"] = settings["replay_buffer_class"].__name__
    settings |= {"n_envs": manager.n_envs, "n_timesteps": manager.n_timesteps}
    settings |= {"env_kwargs": manager.env_kwargs, "normalize": manager.normalize}
    chosen = {key: one for key, one in manager.normalize_kwargs.items() if key != "gamma"}
    if manager.normalize and chosen:
        settings["normalize"] = chosen
    found[env_id] = {"settings": settings, "gamma": model.gamma, "net_arch": model.policy.net_arch}
    found[env_id]["env_wrapper"] = manager.env_wrapper is not None
print()
print(json.dumps(found))
"""

pytestmark = [
    pytest.mark.packaging,
    pytest.mark.skipif(find_spec("rl_zoo3") is None, reason="rl_zoo3 is not installed"),
]


def read_with_the_zoo(algo: str, log_folder: Path) -> dict[str, Any]:
    """By environment: the settings as the zoo reads them, and properties of the model."""
    file = CONFIG_FOLDER / f"{algo}.yaml"
    result = subprocess.run(
        [sys.executable, "-c", ZOO, algo, str(file), str(log_folder), *packaged_environments(algo)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    found: dict[str, Any] = json.loads(result.stdout.splitlines()[-1])
    return found


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_zoo_reads_the_same_settings_and_builds_a_model(algo, tmp_path):
    for env_id, found in read_with_the_zoo(algo, tmp_path).items():
        own = load_config(algo, env_id).as_mapping()
        for name in {"learning_rate", "clip_range"} & set(own):  # the zoo's, at the start of a run
            own[name] = float(str(own[name]).removeprefix("lin_"))
        theirs = found["settings"]
        assert theirs == {name: own[name] for name in theirs}
        # the zoo reads every setting that the file has
        written = yaml.safe_load((CONFIG_FOLDER / f"{algo}.yaml").read_text())[env_id]
        assert set(theirs) == (set(written) | {"normalize"}) - {"env_wrapper"}
        wrapper = own["env_wrapper"]
        assert found["env_wrapper"] == (wrapper is not None)
        assert found["gamma"] == own["gamma"]
        assert found["net_arch"] is not None

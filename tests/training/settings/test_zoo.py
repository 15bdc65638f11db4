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
from training.settings.config_file import CONFIG_FOLDER, load_config
from training.settings.environment_ids import dense_id

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

BATCHED = """
import sys
import numpy as np
import gymnasium as gym
import rigid_envs
from rigid_envs.wrappers import ActionPenalty
from stable_baselines3.common.env_util import make_vec_env
from training import zoo

def make(**kwargs):
    return gym.spec("RigidEnvs/Push-v0").make(**kwargs)

arguments = {"reward_type": "dense", "max_episode_steps": 7, "fidelity": "fast"}
kinds = [
    make_vec_env(
        make, n_envs=4, seed=3, env_kwargs=arguments, vec_env_cls=kind, monitor_dir=folder,
        wrapper_class=lambda env: ActionPenalty(env, weight=0.1),
        monitor_kwargs={"info_keywords": ("is_success",)},
    )
    for kind, folder in zip((zoo.batched, None), sys.argv[1:])
]
seen = [kind.reset() for kind in kinds]
rng, ended = np.random.default_rng(0), 0
for _ in range(16):
    for key in seen[0]:
        np.testing.assert_array_equal(seen[0][key], seen[1][key])
    actions = rng.uniform(-1.0, 1.0, (4, 3)).astype(np.float32)
    steps = [kind.step(actions) for kind in kinds]
    np.testing.assert_allclose(steps[0][1], steps[1][1], rtol=1e-6)
    np.testing.assert_array_equal(steps[0][2], steps[1][2])
    for one, other in zip(steps[0][3], steps[1][3]):
        if "terminal_observation" in other:
            ended += 1
            assert one["TimeLimit.truncated"] and other["TimeLimit.truncated"]
            assert one["episode"]["l"] == other["episode"]["l"] == 7
            for key, value in other["terminal_observation"].items():
                np.testing.assert_array_equal(one["terminal_observation"][key], value)
    seen = [step[0] for step in steps]
assert ended == 8
from gymnasium.wrappers import TransformReward
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

class Own(ActionPenalty):
    pass

class OwnEnv(rigid_envs.RigidEnv):
    pass

for wrap in (lambda env: TransformReward(env, abs), lambda env: Own(env, weight=0.1)):
    try:
        zoo.batched([lambda: wrap(make())])
    except zoo.UsageError as error:
        print(error)
assert isinstance(zoo.batched([lambda: OwnEnv("reach")]), DummyVecEnv)
endless = zoo.batched([lambda: gym.make("RigidEnvs/Push-v0", max_episode_steps=-1)] * 2)
endless.reset()
assert not any(endless.step(np.zeros((2, 3)))[2].any() for _ in range(60))
kinds = [
    VecNormalize(make_vec_env(make, n_envs=3, seed=1, env_kwargs=arguments, vec_env_cls=kind))
    for kind in (zoo.batched, None)
]
seen = [kind.reset() for kind in kinds]
for _ in range(9):
    for key in seen[0]:
        np.testing.assert_allclose(seen[0][key], seen[1][key], rtol=1e-6)
    actions = rng.uniform(-1.0, 1.0, (3, 3)).astype(np.float32)
    seen = [kind.step(actions)[0] for kind in kinds]
"""

pytestmark = [
    pytest.mark.packaging,
    pytest.mark.skipif(find_spec("rl_zoo3") is None, reason="rl_zoo3 is not installed"),
]


def read_with_the_zoo(algo: str, log_folder: Path) -> dict[str, Any]:
    """By environment: the settings as the zoo reads them, and properties of the model."""
    file = CONFIG_FOLDER / f"{algo}.yaml"
    ids = [name for name in yaml.safe_load(file.read_text()) if name.startswith("RigidEnvs/")]
    assert {dense_id(name) for name in ids} <= set(ids) or algo != "ppo"
    result = subprocess.run(
        [sys.executable, "-c", ZOO, algo, str(file), str(log_folder), *ids],
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


def test_batched_worlds_are_those_of_single_environments(tmp_path):
    folders = [str(tmp_path / name) for name in ("batched", "single")]
    result = subprocess.run(
        [sys.executable, "-c", BATCHED, *folders], cwd=ROOT, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    for name in ("TransformReward", "Own"):
        assert f"env_wrapper is {name}, should be one of rigid_envs.wrappers" in result.stdout
    (log,) = (tmp_path / "batched").glob("*.monitor.csv")
    assert log.read_text().count(",7,") == 8


def test_the_zoo_trains_on_all_worlds_at_once(tmp_path):
    command = [sys.executable, "-m", "rl_zoo3.train", "--algo", "ppo"]
    command += ["--env", "RigidEnvs/PushDense-v0", "-conf", str(CONFIG_FOLDER / "ppo.yaml")]
    command += ["--gym-packages", "rigid_envs", "training.zoo", "-n", "12800", "-f", str(tmp_path)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    (log,) = tmp_path.rglob("*.monitor.csv")  # of one environment; single ones have one each
    assert log.read_text().count("\n") == 2 + 256
    assert list(tmp_path.rglob("RigidEnvs-PushDense-v0.zip"))

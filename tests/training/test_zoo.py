"""rl-baselines3-zoo takes our settings as they are: by its own reader, down to the model."""

from argparse import Namespace

import pytest
import yaml
from stable_baselines3 import HerReplayBuffer

import rigid_envs  # noqa: F401  (registers the ids)
from training.config import ALGORITHMS, PACKAGED, TARGET, load_config
from training.train import ALGORITHM_CLASSES

manager = pytest.importorskip("rl_zoo3.exp_manager", reason="rl_zoo3 is not installed")
PAIRS = [
    (algo, env_id)
    for algo in ALGORITHMS
    for env_id in yaml.safe_load((PACKAGED / f"{algo}.yaml").read_text())
    if env_id != TARGET
]


def read(algo: str, env_id: str, log_folder):
    """The zoo's manager, with the settings that it would hand on to Stable-Baselines3."""
    experiment = manager.ExperimentManager(
        Namespace(), algo, env_id, str(log_folder), config=str(PACKAGED / f"{algo}.yaml"), verbose=0
    )
    settings, _ = experiment.read_hyperparameters()
    return experiment, experiment._preprocess_hyperparams(settings)[0]


@pytest.mark.parametrize(("algo", "env_id"), PAIRS)
def test_the_zoo_reads_what_we_read(algo, env_id, tmp_path):
    experiment, theirs = read(algo, env_id, tmp_path)
    ours = load_config(algo, env_id)
    assert experiment.n_envs == ours.n_envs
    assert experiment.n_timesteps == ours.n_timesteps
    assert experiment.env_kwargs == ours.env_kwargs
    assert bool(experiment.normalize) == ours.normalize
    assert theirs.pop("learning_rate")(1.0) == ours.learning_rate
    if "clip_range" in theirs:
        assert theirs.pop("clip_range")(1.0) == ours.clip_range
    if "replay_buffer_class" in theirs:
        assert theirs.pop("replay_buffer_class") is HerReplayBuffer
        assert ours.replay_buffer_class == "HerReplayBuffer"
    assert theirs == {name: ours.as_mapping()[name] for name in theirs}


@pytest.mark.parametrize(("algo", "env_id"), PAIRS)
def test_stable_baselines3_takes_what_the_zoo_hands_on(algo, env_id, tmp_path):
    experiment, theirs = read(algo, env_id, tmp_path)
    model = ALGORITHM_CLASSES[algo](
        env=experiment.create_envs(1, no_log=True), seed=0, device="cpu", **theirs
    )
    ours = load_config(algo, env_id)
    assert model.gamma == ours.gamma
    assert model.policy.net_arch is not None
    assert model.n_envs == 1

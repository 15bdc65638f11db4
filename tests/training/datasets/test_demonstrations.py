"""Demonstrations: read from a dataset, sampled in every batch; an error where they do not fit."""

import json
import shutil
import zipfile
from dataclasses import replace

import numpy as np
import pytest

minari = pytest.importorskip("minari", reason="needs the extra data")

from stable_baselines3.common.callbacks import BaseCallback  # noqa: E402

from training.commands import cli  # noqa: E402
from training.datasets import demonstrations  # noqa: E402
from training.datasets.demonstrations import read_demonstrations  # noqa: E402
from training.datasets.minari_store import random_policy, write_dataset  # noqa: E402
from training.policies.policy import scripted_policy  # noqa: E402
from training.policies.policy_file import load_policy_file  # noqa: E402
from training.runs.run_folder import RunFolder  # noqa: E402
from training.sb3.build import worlds_and_model  # noqa: E402
from training.sb3.train import resume, train  # noqa: E402
from training.settings.algorithms import SACConfig  # noqa: E402
from training.settings.errors import UsageError  # noqa: E402

REACH, NAME = "RigidEnvs/Reach-v0", "reach/scripted-v0"
FAST = {"fidelity": "fast"}
HER = {"replay_buffer_class": "HerReplayBuffer", "replay_buffer_kwargs": {"n_sampled_goal": 4}}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Minari's folder of datasets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    return tmp_path


@pytest.fixture
def config():
    """A hundred updates of a small network."""
    return SACConfig(
        env_id=REACH, n_envs=4, n_timesteps=400, batch_size=32, buffer_size=1000,
        learning_starts=120, train_freq=2, eval_freq=0, seed=3, env_kwargs=FAST,
        policy_kwargs={"net_arch": [8]}, demonstrations=NAME, **HER,
    )  # fmt: skip


def write(episodes=4, policy=None, **arguments):
    return write_dataset(policy or scripted_policy(REACH, **FAST), episodes, NAME, **arguments)


@pytest.mark.parametrize("hindsight", [True, False])
@pytest.mark.parametrize("normalize", [True, False])
def test_half_of_a_batch_is_from_the_demonstrations(config, hindsight, normalize):
    write()
    config = config.replace(normalize=normalize)
    if not hindsight:
        config = config.replace(replay_buffer_class=None, replay_buffer_kwargs={})
    episodes = read_demonstrations(config)
    with worlds_and_model(config, "cpu", 1) as (worlds, model):
        buffer = model.replay_buffer
        observation, worlds_done = worlds.reset(), np.zeros(4, dtype=bool)
        for _ in range(25):  # an episode
            actions = np.full((4, 3), 0.123, dtype=np.float32)
            after, rewards, worlds_done, infos = worlds.step(actions)
            buffer.add(observation, after, actions, rewards, worlds_done, infos)
            observation = after
        batch = buffer.sample(32, model.get_vec_normalize_env())
    own = (batch.actions == np.float32(0.123)).all(axis=1).numpy()
    assert own.tolist() == [True] * 16 + [False] * 16
    shown = {tuple(action) for episode in episodes for action in episode.actions}
    assert all(tuple(action) in shown for action in batch.actions[16:].numpy())
    # a row of the demonstrations is one step of an episode: state, action and what follows
    for action, before, after, reward, done in zip(
        batch.actions[16:].numpy(), batch.observations["observation"][16:].numpy(),
        batch.next_observations["observation"][16:].numpy(), batch.rewards[16:, 0].numpy(),
        batch.dones[16:, 0].numpy(), strict=True,
    ):  # fmt: skip
        assert done == 0.0  # a truncated episode isn't at its end
        assert reward in (-1.0, 0.0)
        if normalize:
            continue
        steps = [
            (episode.observations["observation"][t], episode.observations["observation"][t + 1])
            for episode in episodes
            for t in np.flatnonzero((episode.actions == action).all(axis=1))
        ]
        assert any((before == a).all() and (after == b).all() for a, b in steps)


def test_hindsight_replaces_goals_of_demonstrations_too(config):
    write(policy=random_policy(REACH, **FAST))
    goals = {tuple(e.observations["desired_goal"][0]) for e in read_demonstrations(config)}
    with worlds_and_model(config, "cpu", 1) as (_, model):
        batch = model.replay_buffer.demonstrations.sample(200)
    own = [tuple(goal) in goals for goal in batch.observations["desired_goal"].numpy()]
    assert 0.1 < np.mean(own) < 0.35  # one in five is not replaced


def test_demonstrations_change_what_is_learned_and_a_run_resumes_with_them(config, folder):
    write()
    plain = train(config.replace(demonstrations=None), folder, quiet=True).folder
    shown = train(config, folder, quiet=True).folder
    first, other = (load_policy_file(f.policy).layers for f in (plain, shown))
    assert any((a[0] != b[0]).any() for a, b in zip(first, other, strict=True))

    class Interrupt(BaseCallback):
        def _on_step(self):
            if self.num_timesteps > 200:
                raise KeyboardInterrupt
            return True

    half = train(config, folder, quiet=True, callbacks=[Interrupt()]).folder
    with zipfile.ZipFile(half.model) as stored:
        assert "replay_buffer_kwargs" not in json.loads(stored.read("data"))  # the demonstrations
    replaced = RunFolder(shutil.copytree(half.path, folder / "copy"))
    assert resume(half, quiet=True).steps >= 400
    assert half.config().demonstrations == NAME
    write(seed=7, replace_existing=True)
    with pytest.raises(UsageError, match=r"demonstrations of .* have been replaced by other ones"):
        resume(replaced, quiet=True)


@pytest.mark.parametrize(
    ("written", "settings", "message"),
    [
        (None, {}, "demonstrations is 'reach/scripted-v0', but there is no such dataset; it"),
        ({"policy": random_policy("RigidEnvs/Push-v0", **FAST)}, {},
         r"a dataset of RigidEnvs/Push-v0; it should be of RigidEnvs/Reach-v0"),
        ({"reward_type": "dense"}, {}, r"the dense reward; training has the sparse one: record"),
        ({"observe_task_guide": True}, {}, r"observations .*\(9,\).*those of training .*\(6,\)"),
        ({"episodes": 1}, {"batch_size": 64}, r"1 episodes with 25 steps .* at least 32 steps"),
    ],
)  # fmt: skip
def test_demonstrations_that_do_not_fit_raise(config, folder, written, settings, message):
    if written is not None:
        write(**written)
    with pytest.raises(UsageError, match=message):
        train(config.replace(**settings), folder / "runs", quiet=True)
    assert not (folder / "runs").exists() or not list((folder / "runs").rglob("config.yaml"))


def test_settings_that_contradict_demonstrations_raise(config):
    with pytest.raises(UsageError, match="env_wrapper cannot be used with demonstrations"):
        config.replace(env_wrapper="rigid_envs.wrappers.TimePenalty")
    with pytest.raises(UsageError, match="demonstration_fraction is 1"):
        config.replace(demonstration_fraction=1.0)
    for fraction, size, shown in ((0.01, 32, 0), (0.9, 2, 2)):
        with pytest.raises(
            UsageError, match=rf"fraction is {fraction}, which is {shown} of {size}"
        ):
            config.replace(demonstration_fraction=fraction, batch_size=size)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"actions": np.zeros((3, 2), np.float32)}, r"actions of shape \(2,\); .* have \(3,\)"),
    ],
)
def test_datasets_of_other_programs_are_checked(config, monkeypatch, changed, message):
    write()
    iterate = minari.MinariDataset.iterate_episodes

    def others(dataset):
        return [replace(episode, **changed) for episode in iterate(dataset)]

    monkeypatch.setattr(minari.MinariDataset, "iterate_episodes", others)
    with pytest.raises(UsageError, match=message):
        read_demonstrations(config)
    monkeypatch.setattr(minari.MinariDataset, "iterate_episodes", lambda _: [])
    with pytest.raises(UsageError, match="no episodes: record some"):
        read_demonstrations(config)


def test_without_minari_the_extra_is_named(config, monkeypatch):
    monkeypatch.setattr(demonstrations.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r'-c constraints.txt -e "\.\[data\]"'):
        read_demonstrations(config)


def test_the_command_needs_an_algorithm_that_learns_from_others(capsys):
    assert cli.main(["train", "--demonstrations", NAME]) == 2
    assert "--demonstrations is 'reach/scripted-v0', but ppo learns" in capsys.readouterr().err


def test_demonstrations_of_another_task_raise(config):
    push, name = "RigidEnvs/Push-v0", "push/scripted-v0"
    write_dataset(scripted_policy(push, **FAST), 4, name)
    arguments = {**config.as_mapping(), "demonstrations": name}
    for kwargs, message in (
        ({**FAST, "obstacles": 2}, r"Push-v0 with obstacles 0; training has 2: record it with"),
        ({**FAST, "block": "t"}, r"Push-v0 with block 'cube'; training has 't'"),
    ):
        other = SACConfig.from_mapping(push, {**arguments, "env_kwargs": kwargs}, "test")
        with pytest.raises(UsageError, match=message):
            read_demonstrations(other)
    drawn = {**FAST, "block": "cube", "randomize": {"mass": [0.5, 2.0]}, "max_episode_steps": 60}
    assert read_demonstrations(SACConfig.from_mapping(push, {**arguments, "env_kwargs": drawn}, ""))

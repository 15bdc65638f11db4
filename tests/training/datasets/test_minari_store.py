"""Datasets: Minari reads them back, its environment steps, and episodes can be played again."""

import os
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

minari = pytest.importorskip("minari", reason="needs the extra data")

from training.commands import cli  # noqa: E402
from training.datasets import minari_store  # noqa: E402
from training.datasets.minari_store import default_id, random_policy, write_dataset  # noqa: E402
from training.policies.policy import scripted_policy  # noqa: E402
from training.policies.trained_policy import shipped_policy  # noqa: E402
from training.settings.errors import UsageError  # noqa: E402

PUSH, STACK, THROW = (f"RigidEnvs/{task}-v0" for task in ("Push", "Stack", "Throw"))
FAST = {"fidelity": "fast"}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Minari's folder of datasets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    return tmp_path


def replayed(env: gym.Env, episode, seed):
    """Observations and rewards of an episode's actions after a reset with its seed."""
    observation, _ = env.reset(seed=seed)
    observations, rewards = [observation], []
    for action in episode.actions:
        observation, reward, *_ = env.step(action)
        observations.append(observation)
        rewards.append(reward)
    return {key: np.stack([o[key] for o in observations]) for key in observations[0]}, rewards


@pytest.mark.parametrize(
    ("env_id", "arguments"),
    [
        (PUSH, {"reward_type": "dense"}),
        (PUSH, {"terminate_on_success": True, "randomize": {"mass": (0.5, 2.0), "noise": 0.1}}),
        (THROW, {}),
    ],
)
def test_every_episode_can_be_played_again_bit_for_bit(env_id, arguments):
    policy = scripted_policy(env_id, **FAST, **arguments)
    written = write_dataset(policy, 5, "again-v0", seed=7)
    dataset = minari.load_dataset("again-v0")
    metadata = list(dataset.storage.get_episode_metadata(range(5)))
    assert [one["seed"] for one in metadata] == [7, 8, 9, 10, 11]
    env = dataset.recover_environment()
    assert env.spec.id == env_id
    steps = 0
    for episode, one in zip(dataset.iterate_episodes(), metadata, strict=True):
        observations, rewards = replayed(env, episode, int(one["seed"]))
        for key, values in observations.items():
            np.testing.assert_array_equal(episode.observations[key], values, strict=True)
        np.testing.assert_array_equal(episode.rewards, rewards)
        assert (episode.terminations | episode.truncations).tolist() == [False] * (
            len(rewards) - 1
        ) + [True]
        assert len(episode.infos["is_success"]) == len(rewards) + 1
        steps += len(rewards)
    assert written.steps == steps == dataset.total_steps
    env.close()


def test_pixels_are_stored_without_loss():
    policy = random_policy(PUSH, obs_type="pixels", pixel_size=16, **FAST)
    assert write_dataset(policy, 2, "pixels-v0").high_score is None
    dataset = minari.load_dataset("pixels-v0")
    env = dataset.recover_environment()
    for episode in dataset.iterate_episodes():
        seed = next(iter(dataset.storage.get_episode_metadata([episode.id])))["seed"]
        observations, _ = replayed(env, episode, int(seed))
        np.testing.assert_array_equal(
            episode.observations["observation"], observations["observation"], strict=True
        )
    env.close()


def test_scores_are_those_of_random_actions_and_of_the_policy():
    dense = {"reward_type": "dense", **FAST}
    written = write_dataset(scripted_policy(PUSH, **dense), 20, "scores-v0")
    storage = minari.load_dataset("scores-v0").storage
    assert storage.metadata["ref_min_score"] == written.low_score < 0.5 * written.high_score
    assert storage.metadata["ref_max_score"] == written.high_score
    assert storage.metadata["algorithm_name"] == "scripted"
    assert written.high_score == pytest.approx(written.mean_return, rel=0.4)  # 100 and 20 episodes
    # of random actions, the expert is the scripted controller
    drawn = write_dataset(random_policy(PUSH, **dense), 20, "random-v0")
    assert drawn.high_score == written.high_score
    assert drawn.mean_return < 0.5 * written.mean_return


def test_slowed_movements_and_what_was_intended_are_recorded():
    policy = scripted_policy(STACK, **FAST)
    written = write_dataset(policy, 20, slowdown=1.0, seed=7)
    assert written.dataset_id == "rigid-envs/stack/scripted-slowdown-1-0-v0"
    dataset = minari.load_dataset(written.dataset_id)
    assert dataset.storage.metadata["algorithm_name"] == "scripted with slowdown 1"
    for episode in dataset:
        intended = episode.infos["intended_action"]
        assert np.isnan(intended[0]).all()
        seen = {key: values[:-1] for key, values in episode.observations.items()}
        np.testing.assert_allclose(intended[1:], policy.act(seen), rtol=1e-6)
        actions, moves = episode.actions, np.abs(intended[1:, :3]) > 1e-3
        np.testing.assert_array_equal(actions[:, 3], intended[1:, 3])  # the grip
        part = actions[:, :3][moves] / intended[1:, :3][moves]
        assert part.min() >= 0.0
        assert part.max() <= 1.0
        assert 0.4 < part.mean() < 0.6


def test_noise_on_actions_is_recorded_as_the_environment_took_it():
    policy = scripted_policy(PUSH, **FAST)
    plain = write_dataset(policy, 20, "plain-v0")
    noisy = write_dataset(policy, 20, "noisy-v0", action_noise=0.3)
    unnamed = write_dataset(policy, 20, action_noise=0.3)
    assert unnamed.dataset_id == "rigid-envs/push/scripted-noise-0-3-v0"
    first, second, third = (
        minari.load_dataset(name) for name in ("plain-v0", "noisy-v0", unnamed.dataset_id)
    )
    actions, other, same = (np.stack([e.actions for e in d]) for d in (first, second, third))
    np.testing.assert_array_equal(other, same)
    assert np.abs(other).max() == 1.0  # clipped
    drawn = other[:, 0] - actions[:, 0]  # of the same observations
    inside = np.abs(other[:, 0]) < 1.0
    assert 0.2 < drawn[inside].std() < 0.4
    assert second.storage.metadata["algorithm_name"] == "scripted with action noise 0.3"
    assert noisy.high_score == plain.high_score  # the expert's, without noise


def test_a_dataset_is_replaced_only_if_asked(folder):
    policy = random_policy(PUSH, **FAST)
    write_dataset(policy, 2)
    name = "rigid-envs/push/random-v0"
    with pytest.raises(UsageError, match=rf"{name}' exists.*--replace"):
        write_dataset(policy, 3)
    assert minari.load_dataset(name).total_episodes == 2
    write_dataset(policy, 3, replace_existing=True)
    assert minari.load_dataset(name).total_episodes == 3


def test_an_error_leaves_what_was_there(folder):
    policy = random_policy(PUSH, **FAST)
    write_dataset(policy, 2, "kept-v0")

    def fails(observation):
        raise RuntimeError("a bug")

    broken = scripted_policy(PUSH, **FAST)
    object.__setattr__(broken, "act", fails)
    with pytest.raises(RuntimeError, match="a bug"):
        write_dataset(broken, 2, "kept-v0", replace_existing=True)
    with pytest.raises(RuntimeError, match="a bug"):
        write_dataset(broken, 2, "new-v0")
    assert minari.load_dataset("kept-v0").total_episodes == 2
    assert [path.name for path in folder.iterdir()] == ["kept-v0"]


def test_a_dataset_that_another_process_wrote_meanwhile_is_kept(folder, monkeypatch):
    policy = random_policy(PUSH, **FAST)
    write_dataset(policy, 3, "other-v0")
    write = minari_store._write

    def both(*arguments):
        write(*arguments)
        (folder / "other-v0").rename(folder / "same-v0")

    monkeypatch.setattr(minari_store, "_write", both)
    with pytest.raises(UsageError, match="'same-v0' exists"):
        write_dataset(policy, 2, "same-v0")
    assert [path.name for path in folder.iterdir()] == ["same-v0"]
    assert minari.load_dataset("same-v0").total_episodes == 3


@pytest.mark.parametrize("fails_at", ["write", "rename"])
def test_a_dataset_to_be_replaced_is_kept_if_anything_fails(folder, monkeypatch, fails_at):
    policy, name = random_policy(PUSH, **FAST), "replaced/same-v0"
    write_dataset(policy, 3, name)
    write, rename = minari_store._write, Path.rename

    def writing(*arguments):
        write(*arguments)
        if fails_at == "write":
            raise KeyboardInterrupt

    def renaming(path, target):
        if fails_at == "rename" and path.name == "same-v0" and ".unfinished" in str(path.parent):
            raise KeyboardInterrupt
        return rename(path, target)

    with monkeypatch.context() as patched:
        patched.setattr(minari_store, "_write", writing)
        patched.setattr(Path, "rename", renaming)
        with pytest.raises(KeyboardInterrupt):
            write_dataset(policy, 2, name, replace_existing=True)
    assert minari.load_dataset(name).total_episodes == 3
    assert [path.name for path in folder.iterdir()] == ["replaced"]
    write_dataset(policy, 2, name, replace_existing=True)
    assert minari.load_dataset(name).total_episodes == 2
    assert os.environ["MINARI_DATASETS_PATH"] == str(folder)


@pytest.mark.parametrize(
    ("env_id", "policy", "arguments", "expected"),
    [
        ("RigidEnvs/PushDense-v0", "ppo (runs/a b)", {}, "push-dense/ppo"),
        ("RigidEnvs/Push-v0", "scripted", {"reward_type": "dense"}, "push-dense/scripted"),
        ("RigidEnvs/PushDense-v0", "scripted", {"reward_type": "sparse"}, "push/scripted"),
        ("RigidEnvs/Stack-v0", "scripted", {"blocks": 3, "fidelity": "fast"},
         "stack/scripted-blocks-3"),
        ("RigidEnvs/PushT-v0", "trained-PushT-v0", {}, "push-t/trained"),
    ],
)  # fmt: skip
def test_names(env_id, policy, arguments, expected):
    assert default_id(env_id, policy, arguments, (0.0, 0.0)) == f"rigid-envs/{expected}-v0"


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--dataset-id", "no version"], "name of the dataset is 'no version', should be like"),
        (["--dataset-id", "../up-v0"], "should be like rigid-envs/push/scripted-v0"),
        (["--dataset-id", "x/push-v0"], "parts of at least two letters, digits, - or _"),
        (["--dataset-id", "data/push-v0"], "should be like rigid-envs/push/scripted-v0"),
        (["--dataset-id", "ä/push-v0"], "should be like rigid-envs/push/scripted-v0"),
        (["--env-kwargs", "max_episode_steps:-1"], "max_episode_steps is -1, should be at least"),
        (["--env-kwargs", "obs_type:pixels"], "a scripted controller acts from the state"),
        (["--env-kwargs", "slowdown:0.5"], "'slowdown' is not allowed here: it is no argument"),
        (["--episodes", "0"], "should be an integer of at least 1"),
        (["--action-noise", "-0.1"], "action_noise is -0.1, should be a number of at least 0"),
        (["--slowdown", "1.5"], "slowdown is 1.5, should be a number from 0 to 1"),
        (["--action-noise", "nan"], "action_noise is nan, should be a number of at least 0"),
        (["--policy", "nowhere"], "--policy is 'nowhere', should be scripted, trained, random"),
        (["--env", "RigidEnvs/Posh-v0"], "did you mean 'RigidEnvs/Push-v0'?"),
        (["--env-kwargs", "fidelity:quick"], "quick"),
    ],
)
def test_mistakes_give_one_line(words, complaint, capsys, folder):
    assert cli.main(["dataset", *words]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    assert not list(folder.iterdir())


def test_the_command_writes_a_dataset(capsys):
    words = "dataset --policy random --episodes 3 --fidelity fast --dataset-id mine/few-v0"
    assert cli.main(words.split()) == 0
    shown = capsys.readouterr().out
    assert "mine/few-v0: 3 episodes, 150 steps" in shown
    assert 'minari.load_dataset("mine/few-v0")' in shown
    assert minari.load_dataset("mine/few-v0").total_episodes == 3


@pytest.mark.parametrize("policy", [scripted_policy(PUSH), shipped_policy(PUSH)])
def test_a_policy_of_the_state_records_pixels(policy):
    pixels = {"obs_type": "pixels+state", "pixel_size": 16}
    written = write_dataset(policy, 20, "seen-v0", **pixels)
    assert written.success > 0.8
    episode = minari.load_dataset("seen-v0")[0]
    assert episode.observations["observation"].shape == (51, 16, 16, 3)
    assert episode.observations["state"].shape == (51, 22)

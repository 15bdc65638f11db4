"""The adapter, training and evaluation on Push."""

import numpy as np
import pytest
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecMonitor
from stable_baselines3.her import HerReplayBuffer

from training.policies.trained_policy import trained_policy
from training.results.evaluate import evaluate
from training.results.plot import plot_learning_curves
from training.results.video import record
from training.sb3.train import train
from training.sb3.vec_env import RigidVecEnv
from training.settings.config_file import load_config
from training.settings.environments import make_vector_env

PUSH = "RigidEnvs/Push-v0"
WORLDS = 4
EPISODE = 50


@pytest.fixture
def push():
    env = RigidVecEnv(make_vector_env(PUSH, WORLDS, reward_type="sparse"))
    yield env
    env.close()


def random_actions(env, random) -> np.ndarray:
    return random.uniform(-1, 1, (env.num_envs, *env.action_space.shape)).astype(np.float32)


def test_observations_and_rewards_are_within_their_spaces(push):
    push.seed(0)
    observation = push.reset()
    random = np.random.default_rng(0)
    for _ in range(5):
        for world in range(WORLDS):
            one = {key: value[world] for key, value in observation.items()}
            assert push.observation_space.contains(one)
        observation, rewards, dones, infos = push.step(random_actions(push, random))
        assert rewards.dtype == np.float32
        assert dones.dtype == bool
        assert len(infos) == WORLDS


def test_truncated_episodes_have_their_own_terminal_observation(push):
    push.seed(0)
    first = push.reset()
    goals = first["desired_goal"].copy()
    random = np.random.default_rng(0)
    for step in range(1, EPISODE + 1):
        observation, rewards, dones, infos = push.step(random_actions(push, random))
        assert dones.tolist() == [step == EPISODE] * WORLDS
    for world, info in enumerate(infos):
        terminal = info["terminal_observation"]
        assert info["TimeLimit.truncated"] is True
        assert isinstance(info["is_success"], bool)
        np.testing.assert_array_equal(terminal["desired_goal"], goals[world])
        assert not np.array_equal(observation["desired_goal"][world], goals[world])
        relabelled = push.env_method(
            "compute_reward",
            terminal["achieved_goal"][None],
            terminal["desired_goal"][None],
            [{}],
            indices=[world],
        )
        assert relabelled[0] == rewards[world]


def test_later_steps_do_not_change_terminal_observations(push):
    push.seed(0)
    push.reset()
    random = np.random.default_rng(0)
    for _ in range(EPISODE):
        _, _, _, infos = push.step(random_actions(push, random))
    expected_observations = [
        {k: v.copy() for k, v in info["terminal_observation"].items()} for info in infos
    ]
    for _ in range(EPISODE):
        push.step(random_actions(push, random))
    for info, expected in zip(infos, expected_observations, strict=True):
        for key, value in info["terminal_observation"].items():
            np.testing.assert_array_equal(value, expected[key])


def test_her_relabels_transitions_of_push(push):
    model = SAC(
        "MultiInputPolicy",
        VecMonitor(push),
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 4},
        learning_starts=EPISODE * WORLDS,
        buffer_size=2000,
        batch_size=32,
        policy_kwargs={"net_arch": [16]},
        seed=0,
    )
    model.learn(EPISODE * WORLDS + 20)
    rewards = model.replay_buffer.sample(64).rewards.numpy()
    assert set(np.unique(rewards)) <= {-1.0, 0.0}
    assert 0.0 in rewards  # a cube at rest reaches every goal from its future


def test_short_run_trains_evaluates_records_and_plots(tmp_path):
    config = load_config("ppo", PUSH).replace(
        n_envs=16, n_timesteps=16 * 100, n_steps=50, batch_size=400, target_success_rate=None
    )
    folder = train(config, tmp_path, quiet=True).folder
    policy = trained_policy(folder.path)
    result = evaluate(policy, 20, quiet=True)
    assert len(result.success_at_end) == 20
    assert (result.length == EPISODE).all()
    video, still = record(policy, folder.path / "video.mp4", episodes=1, quiet=True)
    assert video.stat().st_size > 0
    assert still.stat().st_size > 0
    assert plot_learning_curves([folder]).stat().st_size < 300_000


def test_packaged_sac_settings_train(tmp_path):
    packaged = load_config("sac", PUSH)
    first = packaged.n_envs * EPISODE
    config = packaged.replace(
        n_timesteps=first + 2 * packaged.n_envs, learning_starts=first, buffer_size=2 * first
    )
    assert train(config, tmp_path, quiet=True).steps > first

"""Torch has one thread in rollouts, and the requested number in updates."""

import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.policies import MultiInputActorCriticPolicy as Policy

from training.sb3.train import train
from training.settings.config_file import load_config


@pytest.mark.parametrize("threads", [1, 2])
def test_rollouts_have_one_thread_and_updates_the_requested_number(tmp_path, monkeypatch, threads):
    seen = {"rollout": set(), "update": set()}

    def recording(name, function):
        def call(self, *arguments, **named):
            seen[name].add(torch.get_num_threads())
            return function(self, *arguments, **named)

        return call

    monkeypatch.setattr(PPO, "train", recording("update", PPO.train))
    monkeypatch.setattr(Policy, "forward", recording("rollout", Policy.forward))
    config = load_config("ppo", "RigidEnvs/Push-v0").replace(
        n_envs=8, n_timesteps=800, n_steps=50, batch_size=100
    )
    before = torch.get_num_threads()
    train(config, tmp_path, num_threads=threads, quiet=True)
    assert seen == {"rollout": {1}, "update": {threads}}
    assert torch.get_num_threads() == before

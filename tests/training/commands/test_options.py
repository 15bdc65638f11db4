"""Options of train that change more than one setting."""

import pytest

from training.commands.cli import _parser
from training.commands.options import config_of

STACK = ["train", "--env", "RigidEnvs/Stack-v0"]


def config(*words):
    return config_of(_parser().parse_args([*STACK, *words]))


def stage_of(made):
    return made.n_timesteps, made.finetune_timesteps


@pytest.mark.parametrize("steps", [["-n", "13000000"], ["--hyperparams", "n_timesteps:13000000"]])
def test_the_length_of_a_run_scales_its_last_stage(steps):
    packaged = config()
    assert stage_of(packaged) == (6_500_000, 3_500_000)
    made = config(*steps)
    assert stage_of(made) == (13_000_000, 7_000_000)
    assert made.finetune_env_kwargs == packaged.finetune_env_kwargs
    assert stage_of(config("-n", "6500000")) == stage_of(packaged)


def test_a_stage_is_dropped_where_it_would_be_shorter_than_a_rollout_of_the_run():
    assert stage_of(config("-n", "30000")) == (30_000, 16_153)
    many = ["--n-envs", "4096"]
    assert stage_of(config("-n", "30000", *many)) == (30_000, 0)
    few = ["--n-envs", "16", "--hyperparams", "batch_size:400"]
    assert stage_of(config("-n", "20000", *few)) == (20_000, 10_769)


def test_a_stage_that_is_given_is_not_scaled():
    made = config("-n", "13000000", "--hyperparams", "finetune_timesteps:1000000")
    assert stage_of(made) == (13_000_000, 1_000_000)


def test_arguments_of_the_environment_hold_in_all_stages_and_evaluations():
    made = config("--env-kwargs", "blocks:5", "max_episode_steps:200", "--fidelity", "solid")
    given = {"blocks": 5, "max_episode_steps": 200, "fidelity": "solid"}
    for kwargs in (made.env_kwargs, made.last_stage_kwargs, made.final_env_kwargs):
        assert given.items() <= kwargs.items()
    assert made.env_kwargs["near_grasp_start_prob"] == 0.6
    assert made.final_env_kwargs["near_grasp_start_prob"] == 0.0
    assert "blocks" not in made.finetune_env_kwargs

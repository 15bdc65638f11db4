"""Settings files: valid settings are read, and mistakes name key, value and valid values."""

import dataclasses

import gymnasium as gym
import pytest

import rigid_envs  # noqa: F401  (registers the ids)
from training.settings.algorithms import ALGORITHMS, PPOConfig
from training.settings.config_file import load_config, packaged_environments
from training.settings.environment_ids import dense_id, plain_id
from training.settings.errors import UsageError, nearest

ENV = "RigidEnvs/Push-v0"


def load(write_yaml, settings: str, algo: str = "ppo"):
    return load_config(algo, ENV, write_yaml(f"{ENV}: {settings}"))


@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_packaged_settings_of_push_are_valid(algo):
    config = load_config(algo, ENV)
    assert config.env_id == ENV
    assert config.algo == algo


def test_sparse_push_learns_with_hindsight():
    config = load_config("sac", ENV)
    assert config.env_kwargs["reward_type"] == "sparse"
    assert config.replay_buffer_class == "HerReplayBuffer"


@pytest.mark.parametrize("task", ["Push", "Stack", "Throw"])
def test_dense_id_has_the_settings_of_the_plain_id(task):
    plain = load_config("ppo", f"RigidEnvs/{task}-v0")
    dense = load_config("ppo", f"RigidEnvs/{task}Dense-v0")
    assert dense.env_id == f"RigidEnvs/{task}Dense-v0"
    assert dense.as_mapping() == plain.as_mapping()


def test_dense_id_does_not_have_settings_for_the_sparse_reward():
    with pytest.raises(UsageError, match=r"no settings for environment 'RigidEnvs/PushDense-v0'"):
        load_config("sac", "RigidEnvs/PushDense-v0")


def test_own_settings_of_a_dense_id_take_precedence(write_yaml):
    dense = dense_id(ENV)
    plain = "{n_timesteps: 10, env_kwargs: {reward_type: dense}}"
    file = write_yaml(f"{ENV}: {plain}\n{dense}: {{n_timesteps: 20}}")
    assert load_config("ppo", dense, file).n_timesteps == 20
    assert load_config("ppo", ENV, file).n_timesteps == 10


def test_every_registered_task_has_a_plain_and_a_dense_id():
    ids = [env_id for env_id in gym.registry if env_id.startswith("RigidEnvs/")]
    for env_id in ids:
        plain, dense = plain_id(env_id), dense_id(env_id)
        assert {plain, dense} <= set(ids)
        assert (plain_id(plain), dense_id(dense)) == (plain, dense)
        registered = {**gym.spec(plain).kwargs, "reward_type": "dense"}
        assert gym.spec(dense).kwargs == registered


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_settings_survive_writing_and_reading(algo, write_yaml):
    config = load_config(algo, ENV)
    assert load_config(algo, ENV, write_yaml(config.as_yaml())) == config


@pytest.mark.parametrize("kind", ALGORITHMS.values())
def test_every_field_has_a_docstring(kind):
    import inspect

    source = "".join(inspect.getsource(parent) for parent in kind.__mro__[:-1])
    for field in dataclasses.fields(kind):
        declaration = source.split(f"    {field.name}:", 1)[1].split("\n", 1)[1]
        assert declaration.lstrip().startswith('"""'), field.name


def test_target_is_a_setting_or_a_top_level_section(write_yaml):
    inside = f"{ENV}: {{n_timesteps: 10, target_success_rate: 0.9}}"
    section = f"{ENV}: {{n_timesteps: 10}}\ntarget_success_rate: {{{ENV}: 0.9}}"
    assert load_config("ppo", ENV, write_yaml(inside)) == load_config(
        "ppo", ENV, write_yaml(section)
    )
    assert load_config("ppo", ENV, write_yaml(inside)).target_success_rate == 0.9


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (f"{ENV}: {{n_timesteps: 10}}\ntarget_success_rate: 0.9", "is 0.9, should be keyed by"),
        (
            f"{ENV}: {{n_timesteps: 10}}\ntarget_success_rate: {{RigidEnvs/Posh-v0: 0.9}}",
            f"no settings for environment 'RigidEnvs/Posh-v0'; did you mean '{ENV}'",
        ),
        (
            f"{ENV}: {{n_timesteps: 10}}\ntarget_success_rate: {{{ENV}: 9}}",
            "target_success_rate is 9, should be a number above 0 and at most 1",
        ),
        (
            f"{ENV}: {{n_timesteps: 10, target_success_rate: 1}}\n"
            f"target_success_rate: {{{ENV}: 1}}",
            "target_success_rate is given twice",
        ),
        (f"target_success_rate: {{{ENV}: 1}}", "should be a mapping from environment ids"),
    ],
)
def test_invalid_target_raises(write_yaml, text, complaint):
    with pytest.raises(UsageError, match=complaint):
        load_config("ppo", ENV, write_yaml(text))


def test_seed_is_0_by_default_and_may_be_null(write_yaml):
    assert load(write_yaml, "{n_timesteps: 10}").seed == 0
    assert load(write_yaml, "{n_timesteps: 10, seed: null}").seed is None


def test_unknown_key_names_itself_the_file_and_the_nearest_key(write_yaml):
    with pytest.raises(UsageError) as caught:
        load(write_yaml, "{n_timesteps: 100, learning_rat: 0.1}")
    for part in ("settings.yaml", ENV, "'learning_rat'", "did you mean 'learning_rate'?"):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("setting", "valid"),
    [
        ("n_envs: true", "an integer of at least 1"),
        ("n_envs: 0", "an integer of at least 1"),
        ("n_envs: -4", "an integer of at least 1"),
        ("n_envs: 1.5", "an integer of at least 1"),
        ('n_envs: "8"', "an integer of at least 1"),
        ("n_envs: null", "an integer of at least 1"),
        ("n_timesteps: .inf", "an integer of at least 1"),
        ("gamma: .nan", "a number above 0 and at most 1"),
        ("gamma: 1.01", "a number above 0 and at most 1"),
        ("gamma: false", "a number above 0 and at most 1"),
        ("gae_lambda: -0.1", "a number of at least 0 and at most 1"),
        ("learning_rate: 3e-4", "write 3.0e-4"),
        ("learning_rate: 0", "a number above 0"),
        ("learning_rate: lin_x", "lin_3e-4"),
        ("learning_rate: lin_-1", "lin_3e-4"),
        ("learning_rate: .inf", "lin_3e-4"),
        ("normalize: 1", "true, false, or a mapping of norm_obs, norm_reward, epsilon"),
        ("normalize: {epsilon: 0}", "a mapping in which epsilon is a number above 0"),
        ('normalize: "yes"', "true, false, or a mapping of norm_obs, norm_reward"),
        ("normalize: {norm_obs: 0}", "a mapping in which norm_obs is true or false"),
        ("policy: MultiInputPolicee", "did you mean 'MultiInputPolicy'?"),
        ("policy_kwargs: dict(net_arch=[64, 64])", "a mapping"),
        ("policy_kwargs: {net_arch: 64}", "in which net_arch is a list of layer widths"),
        ("policy_kwargs: {net_arch: [64, 0]}", "in which net_arch is a list of layer widths"),
        ("policy_kwargs: {activation: thanh}", "did you mean 'tanh'?"),
        ("policy_kwargs: {net_arc: [64]}", "did you mean 'net_arch'"),
        ("env_kwargs: [dense]", "a mapping"),
        ("env_kwargs: {1: dense}", "keys are text"),
        ("target_success_rate: 95", "a number above 0 and at most 1, or null"),
        ("seed: -1", "an integer of at least 0 and at most 4294967295, or null"),
        ("seed: 4294967296", "an integer of at least 0 and at most 4294967295, or null"),
        ("batch_size: 1", "an integer of at least 2"),
    ],
)
def test_invalid_value_names_key_value_file_and_valid_values(setting, valid, write_yaml):
    key = setting.split(":")[0]
    timesteps = "" if key == "n_timesteps" else "n_timesteps: 100\n  "
    with pytest.raises(UsageError) as caught:
        load(write_yaml, f"\n  {timesteps}{setting}")
    message = str(caught.value)
    for part in ("settings.yaml", ENV, f"{key} is ", "should be", valid):
        assert part in message


@pytest.mark.parametrize("value", ["auto", "auto_0.1", "0.2"])
def test_entropy_coefficient_of_sac_may_be_learned(value, write_yaml):
    assert load(write_yaml, f"{{n_timesteps: 100, ent_coef: {value}}}", "sac")


@pytest.mark.parametrize("value", ["automatic", "auto_", "auto_x", "auto_0", "auto_-1", "-0.1"])
def test_other_entropy_coefficients_raise(value, write_yaml):
    with pytest.raises(UsageError, match=r'ent_coef is .*should be .*"auto"'):
        load(write_yaml, f"{{n_timesteps: 100, ent_coef: {value}}}", "sac")


def test_large_counts_may_be_written_as_floats(write_yaml):
    assert load(write_yaml, "{n_timesteps: !!float 1e6}").n_timesteps == 1_000_000


def test_unknown_top_level_section_raises(write_yaml):
    file = write_yaml(f"{ENV}: {{n_timesteps: 100}}\ntarget_succes_rate: {{{ENV}: 0.5}}\n")
    with pytest.raises(UsageError, match=r"'target_succes_rate' is neither .* did you mean 'targ"):
        load_config("ppo", ENV, file)


def test_nearest_name_ignores_case():
    assert nearest("PPO", ["sac", "ppo"]) == "ppo"


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("gradient_steps: 0", "gradient_steps is 0, should be an integer of at least 1, or -1"),
        ("policy_kwargs: {log_std_init: -1}", "log_std_init requires algorithm ppo"),
    ],
)
def test_settings_of_sac_that_have_no_effect_raise(write_yaml, setting, message):
    with pytest.raises(UsageError, match=message):
        load(write_yaml, f"{{n_timesteps: 100, {setting}}}", "sac")
    assert load(write_yaml, "{n_timesteps: 100, gradient_steps: -1}", "sac").gradient_steps == -1


def test_missing_n_timesteps_raises(write_yaml):
    with pytest.raises(UsageError, match="n_timesteps is missing"):
        load(write_yaml, "{n_envs: 8}")


def test_batch_larger_than_the_rollout_raises(write_yaml):
    with pytest.raises(UsageError, match=r"batch_size is 64, should be at most .* = 20"):
        load(write_yaml, "{n_timesteps: 100, n_envs: 2, n_steps: 10, batch_size: 64}")


def test_her_settings_without_her_raise(write_yaml):
    with pytest.raises(
        UsageError, match="replay_buffer_kwargs requires replay_buffer_class: HerReplayBuffer"
    ):
        load(write_yaml, "{n_timesteps: 100, replay_buffer_kwargs: {n_sampled_goal: 4}}", "sac")


def test_her_with_an_observed_guide_raises(write_yaml):
    guide = "{observe_task_guide: true}"
    text = f"{{n_timesteps: 100, replay_buffer_class: HerReplayBuffer, env_kwargs: {guide}}}"
    with pytest.raises(UsageError, match="observe_task_guide cannot be used with HerReplayBuffer"):
        load(write_yaml, text, "sac")
    assert load(write_yaml, text.replace("true", "false"), "sac")


@pytest.mark.parametrize("name", ["ActionPenalty", "SmoothnessPenalty"])
def test_her_with_a_penalty_on_actions_raises(write_yaml, name):
    wrapper = f"{{rigid_envs.wrappers.{name}: {{weight: 0.1}}}}"
    text = f"{{n_timesteps: 100, env_wrapper: {wrapper}, replay_buffer_class: HerReplayBuffer}}"
    with pytest.raises(UsageError, match=rf"{name} cannot be used with HerReplayBuffer"):
        load(write_yaml, text, "sac")
    assert load(write_yaml, text.replace("HerReplayBuffer", "null"), "sac")


def test_unknown_algorithm_and_environment_suggest_the_nearest():
    with pytest.raises(UsageError, match=r"'pp0'; did you mean 'ppo'\?"):
        load_config("pp0", ENV)
    with pytest.raises(UsageError, match=r"isn't registered; did you mean 'RigidEnvs/Push-v0'\?"):
        load_config("ppo", "Push-v0")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "should be a mapping from environment ids"),
        ("- 1", "should be a mapping from environment ids"),
        ("{", "not valid YAML"),
        (f"{ENV}: 3", "should be a mapping of settings"),
        (f"{ENV}:", "should be a mapping of settings"),
        (f"{ENV}: !!python/object/apply:os.getcwd []", "not valid YAML"),
    ],
)
def test_damaged_file_raises(text, complaint, write_yaml):
    with pytest.raises(UsageError, match=rf"settings\.yaml: .*{complaint}|{complaint}"):
        load_config("ppo", ENV, write_yaml(text))


def test_missing_file_raises(tmp_path):
    with pytest.raises(UsageError, match=r"none\.yaml does not exist; it should be a YAML file"):
        load_config("ppo", ENV, tmp_path / "none.yaml")


def test_replaced_values_are_validated(quick_ppo):
    assert quick_ppo.replace(n_envs=4).n_envs == 4
    with pytest.raises(UsageError, match=r"command line: .*n_envs is 0"):
        quick_ppo.replace(n_envs=0)


def test_settings_are_frozen(quick_ppo: PPOConfig):
    with pytest.raises(dataclasses.FrozenInstanceError):
        quick_ppo.n_envs = 4


def test_a_registered_task_without_settings_has_those_of_default():
    """A hundred updates or more: with too few, nothing is learned."""
    gym.register("Own-v0", entry_point="rigid_envs:RigidEnv", kwargs={"task": "reach"})
    try:
        config = load_config("ppo", "Own-v0")
    finally:
        del gym.registry["Own-v0"]
    assert config.n_timesteps >= 100 * config.rollout
    assert "default" not in packaged_environments("ppo")
    with pytest.raises(UsageError, match="no settings for environment 'Own-v0'"):
        load_config("ppo", "Own-v0")  # it isn't registered any more

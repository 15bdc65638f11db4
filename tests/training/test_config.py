import dataclasses

import pytest

from training.settings.config import ALGORITHMS, PPOConfig, load_config
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


def test_a_target_stands_among_the_settings_or_beside_them(write_yaml):
    among = f"{ENV}: {{n_timesteps: 10, target_success_rate: 0.9}}"
    beside = f"{ENV}: {{n_timesteps: 10}}\ntarget_success_rate: {{{ENV}: 0.9}}"
    assert load_config("ppo", ENV, write_yaml(among)) == load_config("ppo", ENV, write_yaml(beside))
    assert load_config("ppo", ENV, write_yaml(among)).target_success_rate == 0.9


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
def test_wrong_targets_are_named(write_yaml, text, complaint):
    with pytest.raises(UsageError, match=complaint):
        load_config("ppo", ENV, write_yaml(text))


def test_training_is_seeded_unless_a_file_says_otherwise(write_yaml):
    assert load(write_yaml, "{n_timesteps: 10}").seed == 0
    assert load(write_yaml, "{n_timesteps: 10, seed: null}").seed is None


def test_unknown_key_names_itself_the_file_and_the_nearest_key(write_yaml):
    with pytest.raises(UsageError) as caught:
        load(write_yaml, "{n_timesteps: 100, learning_rat: 0.1}")
    for part in ("settings.yaml", ENV, "'learning_rat'", "did you mean 'learning_rate'?"):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("setting", "right"),
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
        ("gae_lambda: -0.1", "a number at least 0 and at most 1"),
        ("learning_rate: 3e-4", "write 3.0e-4"),
        ("learning_rate: 0", "a number above 0"),
        ("learning_rate: lin_x", "lin_3e-4"),
        ("learning_rate: lin_-1", "lin_3e-4"),
        ("learning_rate: .inf", "lin_3e-4"),
        ("normalize: 1", "true or false"),
        ('normalize: "yes"', "true or false"),
        ("policy: MultiInputPolicee", "did you mean 'MultiInputPolicy'?"),
        ("policy_kwargs: dict(net_arch=[64, 64])", "a mapping"),
        ("policy_kwargs: {net_arch: 64}", "net_arch to be a list of layer widths"),
        ("policy_kwargs: {net_arch: [64, 0]}", "net_arch to be a list of layer widths"),
        ("policy_kwargs: {activation: thanh}", "did you mean 'tanh'?"),
        ("policy_kwargs: {net_arc: [64]}", "did you mean 'net_arch'"),
        ("env_kwargs: [dense]", "a mapping"),
        ("env_kwargs: {1: dense}", "keys are text"),
        ("target_success_rate: 95", "a number above 0 and at most 1, or null"),
        ("seed: -1", "an integer of at least 0, or null"),
        ("batch_size: 1", "an integer of at least 2"),
    ],
)
def test_wrong_value_names_key_value_file_and_what_would_be_right(setting, right, write_yaml):
    key = setting.split(":")[0]
    timesteps = "" if key == "n_timesteps" else "n_timesteps: 100\n  "
    with pytest.raises(UsageError) as caught:
        load(write_yaml, f"\n  {timesteps}{setting}")
    message = str(caught.value)
    for part in ("settings.yaml", ENV, f"{key} is ", "should be", right):
        assert part in message


@pytest.mark.parametrize("value", ["auto", "auto_0.1", "0.2"])
def test_entropy_coefficient_of_sac_may_be_learned(value, write_yaml):
    assert load(write_yaml, f"{{n_timesteps: 100, ent_coef: {value}}}", "sac")


@pytest.mark.parametrize("value", ["automatic", "auto_", "auto_x", "-0.1"])
def test_entropy_coefficient_otherwise_is_refused(value, write_yaml):
    with pytest.raises(UsageError, match=r'ent_coef is .*should be .*"auto"'):
        load(write_yaml, f"{{n_timesteps: 100, ent_coef: {value}}}", "sac")


def test_large_counts_may_be_written_as_floats(write_yaml):
    assert load(write_yaml, "{n_timesteps: !!float 1e6}").n_timesteps == 1_000_000


def test_a_key_beside_the_environments_is_one_that_is_known(write_yaml):
    file = write_yaml(f"{ENV}: {{n_timesteps: 100}}\ntarget_succes_rate: {{{ENV}: 0.5}}\n")
    with pytest.raises(UsageError, match=r"'target_succes_rate' is neither .* did you mean 'targ"):
        load_config("ppo", ENV, file)


def test_names_are_known_in_whatever_case():
    assert nearest("PPO", ["sac", "ppo"]) == "ppo"


def test_missing_length_of_training_is_named(write_yaml):
    with pytest.raises(UsageError, match="n_timesteps is missing"):
        load(write_yaml, "{n_envs: 8}")


def test_batch_larger_than_the_rollout_is_refused(write_yaml):
    with pytest.raises(UsageError, match=r"batch_size is 64, should be at most .* = 20"):
        load(write_yaml, "{n_timesteps: 100, n_envs: 2, n_steps: 10, batch_size: 64}")


def test_hindsight_settings_without_hindsight_are_refused(write_yaml):
    with pytest.raises(UsageError, match="replay_buffer_class: HerReplayBuffer"):
        load(write_yaml, "{n_timesteps: 100, replay_buffer_kwargs: {n_sampled_goal: 4}}", "sac")


def test_hindsight_and_guides_are_refused_together(write_yaml):
    text = "{n_timesteps: 100, replay_buffer_class: HerReplayBuffer, env_kwargs: {guided: true}}"
    with pytest.raises(UsageError, match=r"env_kwargs has guided: true, should be without"):
        load(write_yaml, text, "sac")
    assert load(write_yaml, text.replace("guided: true", "guided: false"), "sac")


@pytest.mark.parametrize("name", ["ActionPenalty", "SmoothnessPenalty"])
def test_hindsight_and_penalties_on_actions_are_refused_together(write_yaml, name):
    wrapper = f"{{rigid_envs.wrappers.{name}: {{weight: 0.1}}}}"
    text = f"{{n_timesteps: 100, env_wrapper: {wrapper}, replay_buffer_class: HerReplayBuffer}}"
    with pytest.raises(UsageError, match=rf"env_wrapper has .*{name}, should be without"):
        load(write_yaml, text, "sac")
    assert load(write_yaml, text.replace("HerReplayBuffer", "null"), "sac")


def test_unknown_algorithm_and_environment_name_the_nearest():
    with pytest.raises(UsageError, match=r"'pp0'; did you mean 'ppo'\?"):
        load_config("pp0", ENV)
    with pytest.raises(UsageError, match=r"'Push-v0'; did you mean 'RigidEnvs/Push-v0'\?"):
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
def test_damaged_file_is_named(text, complaint, write_yaml):
    with pytest.raises(UsageError, match=rf"settings\.yaml: .*{complaint}|{complaint}"):
        load_config("ppo", ENV, write_yaml(text))


def test_missing_file_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"none\.yaml: No such file"):
        load_config("ppo", ENV, tmp_path / "none.yaml")


def test_changes_are_checked_like_a_file(quick_ppo):
    assert quick_ppo.replace(n_envs=4).n_envs == 4
    with pytest.raises(UsageError, match=r"command line: .*n_envs is 0"):
        quick_ppo.replace(n_envs=0)


def test_settings_are_frozen(quick_ppo: PPOConfig):
    with pytest.raises(dataclasses.FrozenInstanceError):
        quick_ppo.n_envs = 4

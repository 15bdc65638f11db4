"""Policy files: they act as Stable-Baselines3's policies, and damaged files are rejected."""

import base64
import json
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save
from threadpoolctl import threadpool_info

from tests.training.reach import ReachVectorEnv
from training.commands import cli
from training.policies.policy_file import (
    ACTIVATIONS,
    ENTRY,
    checksum,
    load_policy_file,
    read_policy,
)
from training.policies.trained_policy import trained_policy
from training.results.evaluate import evaluate
from training.results.results import SOURCE
from training.sb3.train import train
from training.settings.algorithms import ALGORITHMS, BOUNDED_POLICY
from training.settings.config_file import load_config, packaged_environments
from training.settings.errors import UsageError

KEYS = ("observation", "achieved_goal", "desired_goal")


def points(filters: list[list[int]], key: str = "observation") -> dict:
    """Keypoints of a header."""
    return {"key": key, "filters": filters}


def observations(count: int = 200, scale: float = 2.0) -> dict[str, np.ndarray]:
    random = np.random.default_rng(0)
    return {key: random.normal(0, scale, (count, 2)).astype(np.float32) for key in KEYS}


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> Path:
    """A policy file of PPO with observation statistics."""
    config = load_config("ppo", "RigidEnvs/Reach-v0").as_mapping() | {
        "n_envs": 8,
        "n_timesteps": 160,
        "n_steps": 10,
        "batch_size": 40,
        "target_success_rate": None,
        "env_kwargs": {"reward_type": "dense"},
    }
    config = ALGORITHMS["ppo"].from_mapping("Test/Reach-v0", config, "test")
    return train(config, tmp_path_factory.mktemp("runs"), quiet=True).folder.policy


def parts(path: Path):
    """Entry of the metadata, and tensors, as any program can read them."""
    with safe_open(path, "numpy") as file:
        entry = json.loads(file.metadata()[ENTRY])
        return entry, {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118


def rewritten(path: Path, tmp_path: Path, extra: bool = False, **changes) -> Path:
    """A copy with a changed header or an additional tensor, and a valid checksum."""
    entry, tensors = parts(path)
    if extra:
        tensors["layer.9.bias"] = np.zeros(1, np.float32)
    header = entry["header"]
    for name, value in changes.items():
        at = header
        *groups, last = name.split("__")
        for group in groups:
            at = at[group]
        at[last] = value
    entry["sha256"] = checksum(header, tensors)
    changed = tmp_path / "changed.safetensors"
    changed.write_bytes(save(tensors, {ENTRY: json.dumps(entry)}))
    return changed


@pytest.mark.parametrize("normalize", [False, True])
@pytest.mark.parametrize("activation", ["tanh", "relu", "elu"])
def test_file_acts_as_ppo(quick_ppo, tmp_path, normalize, activation):
    network = {"net_arch": [16, 8], "activation": activation, "log_std_init": 0.0}
    config = quick_ppo.replace(normalize=normalize, policy_kwargs=network, learning_rate=0.05)
    folder = train(config, tmp_path, quiet=True).folder
    expected = trained_policy(folder.model, trust_pickle=True)
    # large enough that normalised values are clipped; otherwise within six digits of float32
    for scale in (0.3, 50.0 if normalize else 2.0):
        action = read_policy(folder.policy).act(observations(scale=scale))
        assert action.dtype == np.float32
        np.testing.assert_allclose(action, expected.act(observations(scale=scale)), atol=1e-6)


def test_file_acts_as_a_bounded_policy(quick_ppo, tmp_path):
    network = {"net_arch": [16, 8], "min_std": 0.1}
    config = quick_ppo.replace(policy=BOUNDED_POLICY, policy_kwargs=network, learning_rate=0.05)
    folder = train(config, tmp_path, quiet=True).folder
    expected = trained_policy(str(folder.model), trust_pickle=True)
    for scale in (0.3, 3.0):
        action = read_policy(folder.policy).act(observations(scale=scale))
        np.testing.assert_allclose(action, expected.act(observations(scale=scale)), atol=1e-6)
    assert 0.1 < np.abs(action).max() <= 1.0


@pytest.mark.parametrize("normalize", [False, True])
def test_file_acts_as_sac(quick_sac, tmp_path, normalize, monkeypatch):
    monkeypatch.setattr(
        ReachVectorEnv, "__init__", with_asymmetric_actions(ReachVectorEnv.__init__)
    )
    folder = train(quick_sac.replace(normalize=normalize), tmp_path, quiet=True).folder
    action = read_policy(str(folder.policy)).act(observations())
    expected = trained_policy(folder.model, trust_pickle=True).act(observations())
    np.testing.assert_allclose(action, expected, rtol=1e-6, atol=1e-6)


def with_asymmetric_actions(init):
    """Action bounds other than ±1, to which a squashed output must be scaled."""

    def made(self, *args, **kwargs):
        init(self, *args, **kwargs)
        low, high = np.float32([-0.5, -2.0]), np.float32([0.25, 3.0])
        self.single_action_space = gym.spaces.Box(low, high)

    return made


def test_action_does_not_depend_on_the_number_of_worlds(saved):
    policy, batch = read_policy(saved), observations()
    together = policy.act(batch)
    alone = [policy.act({k: v[i : i + 1] for k, v in batch.items()})[0] for i in range(50)]
    np.testing.assert_allclose(alone, together[:50], atol=1e-7)


def test_file_that_is_no_policy_raises(tmp_path):
    (tmp_path / "README.md").write_text("# Policies")
    with pytest.raises(UsageError, match=r"README.md is not a policy; it should be .* model.zip$"):
        trained_policy(tmp_path / "README.md")


def test_observation_without_batch_axis_raises(saved):
    with pytest.raises(UsageError, match=r"no batch axis; add one: .* value\[None\]"):
        read_policy(saved).act({key: value[0] for key, value in observations().items()})


def test_reading_imports_neither_torch_nor_stable_baselines(saved):
    code = (
        "import sys; from pathlib import Path;"
        "from training.policies.policy_file import load_policy_file;"
        "load_policy_file(Path(sys.argv[1]));"
        "sys.exit(any(name in sys.modules for name in ('torch', 'stable_baselines3')))"
    )
    words = [sys.executable, "-c", code, str(saved)]
    assert subprocess.run(words, cwd=Path(__file__).parents[3]).returncode == 0


def test_header_describes_the_training(saved):
    header = load_policy_file(saved).header
    assert header.algorithm == "ppo"
    assert header.environment.id == "Test/Reach-v0"
    assert header.environment.version == 0
    assert header.environment.kwargs == {"reward_type": "dense"}
    assert header.observation == dict.fromkeys(sorted(KEYS), (2,))
    assert header.network.widths == [6, 64, 64, 2]
    assert (header.steps, header.seed, header.success) == (160, 0, None)
    assert header.versions["torch"]
    entry, tensors = parts(saved)
    assert entry["header"]["algorithm"] == "ppo"
    assert tensors["layer.0.weight"].shape == (64, 6)
    assert tensors["mean.observation"].dtype == np.float64


def test_packaged_networks_take_less_than_300_kilobytes(tmp_path):
    for algo in ALGORITHMS:
        for env_id in packaged_environments(algo):
            short = {"n_timesteps": 16, "n_envs": 1, "eval_freq": 0, "target_success_rate": None}
            short |= {"finetune_timesteps": 0, "finetune_env_kwargs": {}}
            if algo == "ppo":
                short |= {"n_steps": 16, "batch_size": 16}
            else:
                short |= {"learning_starts": 8, "replay_buffer_class": None, "cloning_steps": 0}
                short |= {"replay_buffer_kwargs": {}, "gradient_steps": 1, "buffer_size": 100}
            config = load_config(algo, env_id).replace(**short)
            folder = train(config, tmp_path, quiet=True).folder
            assert folder.policy.stat().st_size < 300_000


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.data())
def test_any_changed_byte_raises(saved, tmp_path, data):
    whole = saved.read_bytes()
    if data.draw(st.booleans()):
        damaged = whole[: data.draw(st.integers(0, len(whole) - 1))]
    else:
        place = data.draw(st.integers(0, len(whole) - 1) | st.integers(0, 1000))
        other = whole[place] ^ data.draw(st.integers(1, 255))
        damaged = whole[:place] + bytes([other]) + whole[place + 1 :]
    damaged += data.draw(st.just(b"") | st.binary(max_size=3)) if len(damaged) < len(whole) else b""
    path = tmp_path / "damaged.safetensors"
    path.write_bytes(damaged)
    if damaged != whole:
        with pytest.raises(UsageError):
            load_policy_file(path)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)
FIELDS = ["algorithm", "environment", "observation", "network", "normalization", "success", "seed"]
FIELDS += ["steps", "commit", "versions", "environment__id", "network__widths", "network__low"]
FIELDS += [
    "network__activation",
    "network__features",
    "network__keypoints",
    "normalization__keys",
    "normalization__clip",
]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(field=st.sampled_from(FIELDS), value=JSON)
def test_arbitrary_header_raises_or_acts(saved, tmp_path, field, value):
    try:
        policy = read_policy(rewritten(saved, tmp_path, **{field: value}))
    except UsageError:
        return
    assert policy.act(observations()).shape == (200, 2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"algorithm": "td4"}, "algorithm is 'td4', should be ppo or sac"),
        ({"network__activation": "gelu"}, "'gelu', should be tanh or relu or elu"),
        (
            {"network__features": "symlog", "network__widths": [6, 2]},
            "features is 'symlog', should be 'linear'",
        ),
        ({"network__keypoints": points([[3, 1]])}, r"filters is \[\[3, 1\]\], should be a list"),
        ({"network__keypoints": points([])}, r"filters is \[\], should be a list of \[outputs"),
        ({"network__keypoints": points([[3, 1, 1]])}, r"\(2,\), should be \(height, width, chan"),
        ({"network__keypoints": points([[3, 1, 1]], "state")}, "keypoints.key is 'state', should"),
        ({"network__squashing": "sine"}, "squashing is 'sine', should be clip or softsign"),
        ({"algorithm": "sac"}, "squashing is 'clip', should be tanh"),
        (
            {"network__widths": [6, 64, 32, 2]},
            r"requires float32 of shape \(32,\) for layer.1.bias",
        ),
        ({"network__widths": [7, 64, 64, 2]}, "starts with 7, should be 6"),
        ({"network__widths": [6, 2**40, 2**40, 2]}, "but the file has float32"),
        ({"network__low": [-1.0]}, "network.low has 1 entries, should have 2"),
        ({"observation": {"observation": [6]}}, "should be observation"),
        ({"environment__version": 1}, "version is 1, but environment.id"),
        ({"normalization__clip": -1}, "should be above 0"),
        ({"colour": "red"}, "missing or unknown: colour"),
        ({"extra": True}, "requires no tensor for layer.9.bias"),
    ],
)
def test_invalid_header_fields_are_named(saved, tmp_path, changes, message):
    with pytest.raises(UsageError, match=message):
        read_policy(rewritten(saved, tmp_path, **changes))


def test_other_files_raise(saved, tmp_path):
    path = tmp_path / "some.safetensors"
    with pytest.raises(UsageError, match="does not exist"):
        trained_policy(path)
    with pytest.raises(UsageError, match=r"does not exist; it should be a \.safetensors file"):
        read_policy(path)
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(UsageError, match="is not a policy file"):
        read_policy(path)
    path.write_bytes(save({"weight": np.zeros(3)}, {"format": "pt"}))
    with pytest.raises(UsageError, match="is not a policy file"):
        read_policy(path)
    entry, tensors = parts(saved)
    path.write_bytes(save(tensors, {ENTRY: json.dumps({**entry, "format": 3})}))
    with pytest.raises(UsageError, match="has format version 3, should be 2"):
        read_policy(path)


def test_another_version_of_the_environment_raises(saved, tmp_path):
    other = {"id": "Test/Reach-v7", "version": 7, "kwargs": {}}
    path = rewritten(saved, tmp_path, environment=other)
    with pytest.raises(
        UsageError, match="trained on Test/Reach-v7, but Test/Reach-v0 is installed"
    ):
        read_policy(path)
    assert read_policy(path, env_id="Test/Reach-v0").env_id == "Test/Reach-v0"


def test_arguments_that_an_id_sets_replace_those_of_training():
    file = SOURCE / "results/sac/RigidEnvs-Push-v0_seed0/policy.safetensors"
    assert read_policy(file).env_kwargs == {"reward_type": "sparse", "fidelity": "balanced"}
    dense = read_policy(file, env_id="RigidEnvs/PushDense-v0")
    assert dense.env_kwargs == {"reward_type": "dense", "fidelity": "balanced"}


def test_module_named_in_a_file_is_not_imported(saved, tmp_path, monkeypatch):
    (tmp_path / "intruder.py").write_text("raise AssertionError('imported')")
    monkeypatch.syspath_prepend(str(tmp_path))
    other = {"id": "intruder:RigidEnvs/Posh-v0", "version": 0, "kwargs": {}}
    with pytest.raises(UsageError, match=r"not registered; .* mean --env RigidEnvs/Push-v0"):
        read_policy(rewritten(saved, tmp_path, environment=other))


def test_diverged_policy_is_not_written(saved):
    content = load_policy_file(saved)
    content.layers[0] = (content.layers[0][0] * np.float32(np.nan), content.layers[0][1])
    with pytest.raises(UsageError, match="training has diverged"):
        content.to_bytes()


def test_observation_of_another_shape_raises(saved):
    with pytest.raises(UsageError, match=r"but the environment has \{'observation': "):
        read_policy(saved).act({"observation": np.zeros((1, 3), np.float32)})


def test_reserved_arguments_in_a_file_raise(saved, tmp_path):
    for name in ("env_id", "num_envs", "autoreset_mode"):
        kwargs = {"id": "Test/Reach-v0", "version": 0, "kwargs": {name: 3}}
        with pytest.raises(UsageError, match="rejects"):
            evaluate(read_policy(rewritten(saved, tmp_path, environment=kwargs)), 1, quiet=True)


class Intruder:
    """Creates a file when it is unpickled."""

    def __init__(self, trace: Path):
        self.trace = trace

    def __reduce__(self):
        return Path.touch, (self.trace,)


def test_nothing_is_unpickled_without_permission(quick_ppo, tmp_path, capsys):
    folder = train(quick_ppo.replace(normalize=True), tmp_path, quiet=True).folder
    trace = tmp_path / "trace"
    trap = pickle.dumps(Intruder(trace))
    folder.normalization.write_bytes(trap)
    with zipfile.ZipFile(folder.model, "w") as model:  # as Stable-Baselines3 packs objects
        packed = {":type:": "x", ":serialized:": base64.b64encode(trap).decode()}
        model.writestr("data", json.dumps({"policy_class": packed}))
    run, elsewhere = str(folder.path), str(tmp_path / "other.safetensors")
    Path(elsewhere).write_bytes(folder.model.read_bytes())
    for policy in (run, str(folder.policy)):
        assert cli.main(["evaluate", policy, "-n", "2"]) == 0
    for words in ([str(folder.model)], [elsewhere], [run, "--stochastic"]):
        assert cli.main(["evaluate", *words, "-n", "2"]) == 2
        assert cli.main(["record", *words, "-n", "1"]) == 2
    assert "--trust-pickle" in capsys.readouterr().err
    folder.policy.unlink()
    assert cli.main(["evaluate", run, "-n", "2"]) == 2
    assert not trace.exists()
    cli.main(["evaluate", str(folder.model), "-n", "2", "--trust-pickle"])
    assert trace.exists()  # the trap works


def test_export_copies_the_policy_of_a_run(quick_ppo, tmp_path, capsys):
    folder = train(quick_ppo.replace(normalize=True), tmp_path, quiet=True).folder
    out = tmp_path / "shared" / "reach.safetensors"
    assert cli.main(["export", str(folder.path), "-o", str(out), "-n", "20", "--sb3"]) == 0
    assert {path.name for path in out.parent.iterdir()} == {
        "reach.safetensors",
        "reach.zip",
        "reach.pkl",
    }
    success = load_policy_file(out).header.success
    assert (success.episodes, success.fidelity) == (20, None)
    assert cli.main(["evaluate", str(out), "-n", "20"]) == 0
    assert f"{success.rate:.1%}" in capsys.readouterr().out
    assert cli.main(["record", str(out), "-n", "1"]) == 0
    assert out.with_suffix(".mp4").exists()
    assert cli.main(["export", str(folder.path), "-o", str(tmp_path / "x.zip")]) == 2
    assert "should end in .safetensors" in capsys.readouterr().err
    assert cli.main(["export", str(tmp_path)]) == 2


def test_a_policy_acts_on_one_thread_of_blas(saved, monkeypatch):
    """The other threads would wait in a loop on the cores that the worlds need."""
    used = []

    def activation(x):
        used.extend(p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas")
        return np.tanh(x)

    monkeypatch.setitem(ACTIVATIONS, "tanh", activation)
    policy = load_policy_file(saved)
    assert policy.header.network.activation == "tanh"
    policy.act(observations())
    assert used
    assert set(used) == {1}

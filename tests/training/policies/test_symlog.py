"""SymlogPolicy: its features are logarithms of offsets, and its policy file acts as the policy."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import PPO, SAC

from tests.training.reach import ReachVectorEnv
from training.policies.features.symlog_features import UNITS, SymlogOffsets
from training.policies.policy_file import load_policy_file
from training.policies.symlog import (
    BoundedSymlogPolicy,
    SymlogActorCriticPolicy,
    SymlogPolicy,
)
from training.policies.trained_policy import trained_policy
from training.sb3.train import train
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import SYMLOG_POLICY, SYMLOG_PPO_POLICIES, SYMLOG_PPO_POLICY
from training.settings.config_file import load_config
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError

PAIRS = [[1, 0], [0, -1]]


def test_features_are_logarithms_of_observation_goal_offset_and_differences():
    env = RigidVecEnv(ReachVectorEnv(4))
    found = env.reset()
    tensors = {key: torch.as_tensor(value) for key, value in found.items()}
    for components in (None, [1], [0, -1], []):
        for units in (UNITS, (0.5,)):
            extractor = SymlogOffsets(env.observation_space, PAIRS, components, units)
            features = extractor(tensors)
            check(found, features, components, units)
            assert features.shape[1] == extractor.features_dim


def check(found, features, components, units):
    seen = found["observation"]
    difference = seen[:, [1]] - seen[:, [0]]
    offset = found["desired_goal"] - found["achieved_goal"]
    chosen = seen if components is None else seen[:, components]
    x = np.concatenate([chosen, offset, difference, -difference], axis=1)
    expected = [np.sign(x) * np.log(1.0 + np.abs(x) / unit) for unit in units]
    np.testing.assert_allclose(features, np.concatenate(expected, axis=1), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("algorithm", "policy"),
    [(SAC, SymlogPolicy), (PPO, SymlogActorCriticPolicy), (PPO, BoundedSymlogPolicy)],
)
def test_a_saved_policy_keeps_its_features(tmp_path, algorithm, policy):
    kwargs = {"differences": PAIRS, "components": [1], "units": [0.1]}
    model = algorithm(policy, RigidVecEnv(ReachVectorEnv(4)), policy_kwargs=kwargs)
    matrices = matrices_of(model.policy)
    model.save(tmp_path / "model.zip")
    model.policy.save(tmp_path / "policy.pt")
    kept = matrices_of(algorithm.load(tmp_path / "model.zip").policy)
    alone = matrices_of(policy.load(tmp_path / "policy.pt"))
    for one in (*matrices, *kept, *alone):
        assert torch.equal(one, matrices[0])


def matrices_of(policy):
    found = [one for one in policy.modules() if isinstance(one, SymlogOffsets)]
    assert found
    assert not any(list(one.parameters()) for one in found)
    return [one.matrix for one in found]


@pytest.mark.parametrize("policy", [SYMLOG_POLICY, *SYMLOG_PPO_POLICIES])
def test_policy_file_acts_as_the_policy(quick_sac, quick_ppo, tmp_path, policy):
    quick = quick_sac if policy == SYMLOG_POLICY else quick_ppo
    kwargs = {**quick.policy_kwargs, "differences": PAIRS, "components": [1], "units": [0.1]}
    normalize = {"norm_obs": False} if quick is quick_ppo else False
    config = quick.replace(policy=policy, policy_kwargs=kwargs, normalize=normalize)
    folder = train(config, tmp_path, quiet=True).folder
    content = load_policy_file(folder.policy)
    env = RigidVecEnv(ReachVectorEnv(50))
    env.seed(3)
    found = env.reset()
    expected = trained_policy(folder.model, trust_pickle=True).act(found)
    np.testing.assert_allclose(content.act(found), expected, atol=2e-5)
    assert content.header.network.features == "symlog"


def test_wrong_spaces_components_and_algorithms_raise(quick_ppo, quick_sac):
    box = spaces.Box(-1.0, 1.0, (3,))
    goals = spaces.Dict(dict.fromkeys(("observation", "achieved_goal", "desired_goal"), box))
    with pytest.raises(UsageError, match="require observations with goals, not Dict"):
        SymlogOffsets(spaces.Dict({"observation": box}))
    with pytest.raises(UsageError, match=r"differences: 3 in \[0, 3\], should .* -3 to 2"):
        SymlogOffsets(goals, [[0, 3]])
    with pytest.raises(UsageError, match=r"components: 3 in \[3\], should be .* -3 to 2"):
        SymlogOffsets(goals, components=[3])
    with pytest.raises(UsageError, match=r"policy is 'training.policies.symlog.SymlogPolicy'"):
        quick_ppo.replace(policy=SYMLOG_POLICY)
    with pytest.raises(UsageError, match=r"differences requires policy: training.policies.symlog"):
        quick_sac.replace(policy_kwargs={"differences": PAIRS})
    with pytest.raises(UsageError, match=r"components requires policy: training.policies.symlog"):
        quick_ppo.replace(policy_kwargs={"components": [1]})
    with pytest.raises(
        UsageError, match=r"in which components is a list of indices, as in \[0, 1, -1\]"
    ):
        quick_ppo.replace(policy=SYMLOG_PPO_POLICY, policy_kwargs={"components": [0.5]})
    for wrong in ([0.1, 0], []):
        with pytest.raises(UsageError, match=r"in which units is a list of one or more numbers ab"):
            quick_ppo.replace(policy=SYMLOG_PPO_POLICY, policy_kwargs={"units": wrong})
    with pytest.raises(UsageError, match=r"normalize is \{'norm_obs': False\}, should be true or"):
        quick_sac.replace(normalize={"norm_obs": False})
    for quick, policy in ((quick_sac, SYMLOG_POLICY), (quick_ppo, SYMLOG_PPO_POLICY)):
        with pytest.raises(UsageError, match=r"normalize is True, .* with training."):
            quick.replace(policy=policy, normalize=True)
    for wrong in ([[1]], [[1, 0.5]], [1, 2], "8-0"):
        with pytest.raises(UsageError, match=r"a list of pairs of indices, as in \[\[8, 0\]"):
            quick_sac.replace(policy=SYMLOG_POLICY, policy_kwargs={"differences": wrong})


@pytest.mark.parametrize("blocks", [2, 5])
def test_the_components_of_stack_are_those_that_its_settings_name(blocks):
    names = names_of("RigidEnvs/Stack-v0", blocks=blocks, randomize={"mass": [0.5, 2.0]})
    chosen = components_of("RigidEnvs/Stack-v0", names)
    guide = ("hand to next cube", "next cube to its goal")
    assert chosen == [
        "hand z", *(f"hand velocity {a}" for a in "xyz"), "opening", "opening velocity",
        "hand reference z", *(f"{name} {a}" for name in guide for a in "xyz"), "fraction placed",
    ]  # fmt: skip


def test_the_components_of_push_are_those_that_its_settings_name():
    assert components_of("RigidEnvs/Push-v0", names_of("RigidEnvs/Push-v0")) == [
        "finger z", *(f"finger velocity {a}" for a in "xyz"), "cube velocity x", "cube velocity y",
        *(f"finger to cube {a}" for a in "xyz"),
    ]  # fmt: skip


def names_of(env_id, **arguments):
    arguments = {**load_config("ppo", env_id).env_kwargs, **arguments}
    env = make_vector_env(env_id, 1, **arguments)
    task = env.unwrapped.task
    names = [name for name, *_ in task.bounds]
    if arguments.get("observe_task_guide"):
        names += [name for name, *_ in task.guide_bounds]
    assert len(names) == env.single_observation_space["observation"].shape[0]
    env.close()
    return names


def components_of(env_id, names):
    return [names[index] for index in load_config("ppo", env_id).policy_kwargs["components"]]

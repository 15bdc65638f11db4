"""Mirrored policies: the mirror image of a state gets that of the action."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.utils import FloatSchedule

from training.policies.features.reflections import reflection, unchanged
from training.policies.features.symlog_features import SymlogOffsets
from training.policies.mirrored import Average
from training.policies.policy_file import load_policy_file
from training.policies.symlog import BoundedSymlogPolicy
from training.sb3.train import train
from training.settings.algorithms import BOUNDED_SYMLOG_POLICY, SYMLOG_PPO_POLICY
from training.settings.config_file import load_config
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError

SPACE = spaces.Dict(
    achieved_goal=spaces.Box(-1.0, 1.0, (2,)),
    desired_goal=spaces.Box(-1.0, 1.0, (2,)),
    observation=spaces.Box(-1.0, 1.0, (5,)),
)
MIRRORS = [  # two components of each change places, or change their sign
    {"observation": [[0, 1], [2, -2]], "goal": [[0, 1]], "actions": [[0, 1], -1]},
    {"observation": ["0:4"], "goal": [0, 1], "actions": [0, 1]},
]
KEYS = (("observation", "observation"), ("goal", "desired_goal"))
DIFFERENCES = [[2, 0], [3, 1]]


def policy(mirrors=MIRRORS, **kwargs):
    torch.manual_seed(3)
    actions = spaces.Box(-1.0, 1.0, (3,))
    return BoundedSymlogPolicy(
        SPACE, actions, FloatSchedule(1e-2), mirrors=mirrors,
        **{"net_arch": [8, 12], "state_dependent_std": True, "log_std_init": -1.0,
           "differences": DIFFERENCES, **kwargs},
    )  # fmt: skip


def states(n=7):
    random = np.random.default_rng(0)
    return {
        key: torch.tensor(random.uniform(-1.0, 1.0, (n, *space.shape)), dtype=torch.float32)
        for key, space in SPACE.items()
    }


def mirrored(values, chosen):
    """Observations and actions [n, ...] in these mirrors."""
    names = {"achieved_goal": "goal", "desired_goal": "goal"}
    seen = dict(values)
    for mirror in chosen:
        for key, value in seen.items():
            image = reflection(mirror[names.get(key, key)], value.shape[1], key)
            seen[key] = value[:, image.source[0]] * image.sign[0]
    return seen


def answers(made, observation):
    distribution = made.get_distribution(observation).distribution
    return distribution.mean, distribution.stddev, made.predict_values(observation)


def assert_equivariant(made, tolerance=1e-5):
    observation = states()
    mean, std, value = answers(made, observation)
    assert mean.std() > 1e-3
    for chosen in ([MIRRORS[0]], [MIRRORS[1]], MIRRORS):
        image = answers(made, mirrored(observation, chosen))
        expected, spread = (mirrored({"actions": x}, chosen)["actions"] for x in (mean, std))
        for found, wanted in zip(image, (expected, spread.abs(), value), strict=True):
            torch.testing.assert_close(found, wanted, atol=tolerance, rtol=tolerance)


def test_a_new_policy_is_equivariant_and_no_smaller():
    made, plain = policy(), policy(mirrors=[])
    assert_equivariant(made)
    for one, other in zip(
        made.mlp_extractor.parameters(), plain.mlp_extractor.parameters(), strict=True
    ):
        assert float(one.detach().norm()) == pytest.approx(float(other.detach().norm()), rel=0.3)
    with pytest.raises(AssertionError):
        assert_equivariant(plain)


def test_a_policy_stays_equivariant_while_it_learns():
    made = policy()
    observation, actions = states(), torch.rand((7, 3))
    for _ in range(200):
        value, likelihood, _ = made.evaluate_actions(observation, actions)
        made.optimizer.zero_grad()
        ((value - actions[:, :1]).square().mean() - likelihood.mean()).backward()
        made.optimizer.step()
    assert made.std_net.weight.abs().max() > 0.01
    one, other, apart = made.log_std.tolist()
    assert one == other
    assert one != pytest.approx(apart, abs=1e-3)
    assert_equivariant(made, 1e-3)


def test_gradients_are_those_of_the_states_and_all_their_images():
    made, plain = policy(), policy(mirrors=[])
    plain.load_state_dict(made.state_dict())
    observation, actions = states(), torch.rand((7, 3))

    def loss(of, chosen):
        seen = mirrored({**observation, "actions": actions}, chosen)
        wanted = seen.pop("actions")
        value, likelihood, _ = of.evaluate_actions(seen, wanted)
        return value.square().mean() - likelihood.mean()

    loss(made, []).backward()
    (sum(loss(plain, chosen) for chosen in ([], MIRRORS[:1], MIRRORS[1:], MIRRORS)) / 4).backward()
    for one, other in zip(made.parameters(), plain.parameters(), strict=True):
        torch.testing.assert_close(one.grad, other.grad, atol=1e-5, rtol=1e-4)


def test_averages_follow_the_weights_to_their_device():
    average = Average(unchanged(3))
    assert average(torch.empty(3, device="meta")).device.type == "meta"


def test_a_saved_policy_keeps_its_mirrors(tmp_path):
    made = policy()
    made.save(tmp_path / "policy.pt")
    kept = BoundedSymlogPolicy.load(tmp_path / "policy.pt")
    assert kept.mirrors == MIRRORS
    assert torch.equal(kept.action_net.weight, made.action_net.weight)
    kept.evaluate_actions(states(), torch.rand((7, 3)))[0].sum().backward()
    torch.optim.SGD(kept.parameters(), 0.1).step()
    assert_equivariant(kept)


@pytest.mark.parametrize("name", [BOUNDED_SYMLOG_POLICY, SYMLOG_PPO_POLICY])
def test_training_writes_an_ordinary_policy_file(quick_ppo, tmp_path, name):
    mirror = {"observation": [0], "goal": [0], "actions": [0]}
    config = quick_ppo.replace(policy=name, policy_kwargs={"net_arch": [8], "mirrors": [mirror]})
    folder = train(config, tmp_path, quiet=True).folder
    model = PPO.load(folder.model)
    act = load_policy_file(folder.policy).act
    observation = {key: np.random.default_rng(1).uniform(-1, 1, (5, 2)) for key in SPACE.spaces}
    image = {key: value * (-1.0, 1.0) for key, value in observation.items()}
    np.testing.assert_allclose(act(image), act(observation) * (-1.0, 1.0), atol=1e-4)
    np.testing.assert_allclose(act(image), model.predict(image, deterministic=True)[0], atol=1e-4)


@pytest.mark.parametrize("blocks", [2, 3])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_mirrors_of_stack_are_those_of_its_physics(axis, blocks):
    config = load_config("ppo", "RigidEnvs/Stack-v0")
    kwargs = config.policy_kwargs
    envs = make_vector_env("RigidEnvs/Stack-v0", 64, **{**config.env_kwargs, "blocks": blocks})
    features = SymlogOffsets(
        envs.single_observation_space, kwargs["differences"], kwargs["components"], [1.0]
    )
    mirror = kwargs["mirrors"][axis]
    expected = features.images(
        *(reflection(mirror[key], features.sizes[vector], vector) for key, vector in KEYS)
    )
    assert mirror["actions"] == [axis]
    envs.reset(
        seed=1
    )  # with others round-off decides in one or two of 64 worlds what touches first
    runner = envs._runner
    begin, goals = runner.world.read(), runner._goals.copy()
    cubes, pads = begin.position[:, :blocks].copy(), begin.position[:, blocks:].copy()
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (8, 64, 4)).astype(np.float32)

    def rollout(flip):
        """Features and reward of an episode in which positions are multiplied by flip [3]."""
        runner.world.reset()
        fingers = flip * pads if flip[1] > 0 else flip * pads[:, ::-1]  # the left one is the first
        runner.world.set_state(position=flip * cubes, drive_position=fingers)
        runner._goals[:] = goals * [*np.tile(flip, blocks), 1.0]
        runner._now = runner.world.read()
        found = []
        for action in actions:
            observation, reward, *_ = envs.step(action * [*flip, 1.0])
            seen = {key: torch.as_tensor(value) for key, value in observation.items()}
            found.append((features(seen).numpy(), reward.copy()))
        return found

    images, apart = rollout(np.where(np.arange(3) == axis, -1.0, 1.0)), np.zeros(64, dtype=bool)
    for (direct, reward), (image, image_reward) in zip(rollout(np.ones(3)), images, strict=True):
        wanted = direct[:, expected.source[0]] * expected.sign.numpy()
        apart |= (np.abs(image - wanted) > 0.01).any(axis=1)
        apart |= np.abs(image_reward - reward) > 0.005
    # where both fingers of a hand arrive at once, round-off decides which one touches first
    assert apart.sum() <= 2
    envs.close()


def test_the_mirror_of_push_t_is_that_of_its_physics():
    config = load_config("ppo", "RigidEnvs/PushT-v0")
    envs = make_vector_env("RigidEnvs/PushT-v0", 64, **config.env_kwargs)
    (mirror,) = config.policy_kwargs["mirrors"]
    seen, goal, action = (
        reflection(mirror[key], space.shape[1], key)
        for key, space in (
            ("observation", envs.observation_space["observation"]),
            ("goal", envs.observation_space["desired_goal"]),
            ("actions", envs.action_space),
        )
    )
    envs.reset(seed=0)
    runner = envs._runner
    begin, desired = runner.world.read(), runner._goals.copy()
    position, orientation = begin.position.copy(), begin.orientation[:, :1].copy()
    assert np.abs(desired[:, goal.source[0]] * goal.sign.numpy() - desired).max() < 1e-6
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (12, 64, 2)).astype(np.float32)

    def rollout(image):
        """Observations and rewards of an episode, or of that in the mirror y = -x."""
        at, turned = position.copy(), orientation.copy()
        if image:
            at[:, :, :2] = -position[:, :, 1::-1]
            yaw = 0.5 * np.pi - 2.0 * np.arctan2(orientation[:, :, 2], orientation[:, :, 3])
            turned[:, :, 2], turned[:, :, 3] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
        runner.world.reset()
        runner.world.set_state(position=at[:, :1], orientation=turned, drive_position=at[:, 1:])
        runner._now = runner.world.read()
        found = []
        for step in actions:
            moved = step[:, action.source[0]] * action.sign.numpy() if image else step
            observation, reward, *_ = envs.step(moved)
            found.append((observation["observation"].copy(), reward.copy()))
        return found

    for (direct, reward), (image, image_reward) in zip(rollout(False), rollout(True), strict=True):
        expected = direct[:, seen.source[0]] * seen.sign.numpy()
        np.testing.assert_allclose(image, expected, atol=0.02)
        np.testing.assert_allclose(image_reward, reward, atol=0.02)
    envs.close()


def test_wrong_mirrors_raise(quick_ppo, quick_sac):
    first = {"observation": [[0, 1], [2, 3]], "goal": [[0, 1]]}
    for mirrors, message in (
        (
            [{"observation": [5]}],
            r"mirrors: 5 in \[5\], should be one or more components of the observation, -5 to 4",
        ),
        (
            [{"goal": [2]}],
            r"mirrors: 2 in \[2\], should be one or more components of the desired goal, -2 to 1",
        ),
        ([{"actions": [-4]}], r"mirrors: -4 in \[-4\], .* of the action, -3 to 2"),
        (
            [{"observation": [0]}],
            r"mirrors: the image of the difference \[2, 0\] is no feature: of components",
        ),
        (
            [{"observation": [0, [0, 1]]}],
            r"\[0, \[0, 1\]\] of the observation does not give it back",
        ),
        (
            [first, {"observation": [0, 2]}],
            "the image of the observation in mirrors 0 and 1 depends on their order",
        ),
        ([{"observation": ["0:2", 1]}], "lists component 1 of the observation twice"),
        ([{"goal": [[0, 1], [1, 0]]}], "lists component 0 of the desired goal twice"),
        ([{"actions": [[2, 2]]}], "lists component 2 of the action twice"),
        (
            [{"observation": ["5:7"]}],
            r"5:7 in \['5:7'\], should be one or more components of",
        ),
        ([{"actions": [0]}], "no feature changes in a mirror, so no action could"),
        ([{"action": [0]}], "key 'action', should be 'observation', 'goal' or 'actions'"),
    ):
        with pytest.raises(UsageError, match=message):
            policy(mirrors)
    for net_arch, message in (
        ([8, 6], "a layer of 6 units, should have multiples of 4 with 2 mirrors"),
        ([], "net_arch has no hidden layer, mirrors requires one or more"),
    ):
        with pytest.raises(UsageError, match=message):
            policy(net_arch=net_arch)
    with pytest.raises(UsageError, match=r"is \[-1.0, -2.0, -1.0\], should be the same for comp"):
        policy(log_std_init=[-1.0, -2.0, -1.0])
    assert policy(log_std_init=[-1.0, -1.0, -2.0]).log_std.tolist() == [-1.0, -1.0, -2.0]
    with pytest.raises(UsageError, match="requires that differences lists no pair twice"):
        policy(differences=[[2, 0], [0, 2], [3, 1], [1, 3]])
    for config in (quick_ppo, quick_sac):
        with pytest.raises(UsageError, match="mirrors requires"):
            config.replace(policy_kwargs={"mirrors": MIRRORS})
    lists = [{"goals": [0]}], [{"goal": 0}], [{"goal": ["-:3"]}], [{"goal": [[0]]}]
    for wrong in ("x", [[0]], *lists):
        with pytest.raises(UsageError, match="a list of what changes in each mirror, components t"):
            quick_ppo.replace(policy=SYMLOG_PPO_POLICY, policy_kwargs={"mirrors": wrong})

"""Features of the next object: only its block passes, in training as in policy files."""

import numpy as np
import pytest
import torch
from gymnasium import spaces

from training.policies.features.next_object import NextObject, pass_next
from training.policies.features.reflections import reflection
from training.policies.features.symlog_features import SymlogOffsets
from training.policies.policy_file import load_policy_file
from training.policies.policy_header import InvalidHeader, read_header
from training.policies.trained_policy import trained_policy
from training.sb3.train import train
from training.settings.algorithms import SYMLOG_PPO_POLICY
from training.settings.components import component_indices
from training.settings.config_file import load_config
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError

SPACE = spaces.Dict(
    {
        "achieved_goal": spaces.Box(-1.0, 1.0, (4,)),
        "desired_goal": spaces.Box(-1.0, 1.0, (4,)),
        "observation": spaces.Box(-1.0, 1.0, (5,)),
    }
)
OBJECTS = [
    {"components": [1], "differences": [[2, 0]]},
    {"components": [3], "differences": [[4, 0]]},
]
CHOICE = {"within": 0.3, "objects": OBJECTS}


def observations(n):
    rng = np.random.default_rng(2)
    found = {key: rng.uniform(-1, 1, (n, *one.shape)) for key, one in SPACE.spaces.items()}
    near = rng.random(n) < 0.5  # the first object is at its goal
    found["achieved_goal"][near, :2] = found["desired_goal"][near, :2] + 0.1
    return {key: value.astype(np.float32) for key, value in found.items()}, near


@pytest.mark.parametrize("kind", [np.asarray, torch.as_tensor])
def test_the_first_object_that_is_not_at_its_goal_passes(kind):
    blocks = [[0.5, 0.0, 1.0], [0.0, 0.5, 2.0], [0.0, 0.0, 3.0]]
    at = [0.0, 0.1]
    cases = [
        (blocks, 0),
        ([[*at, 1.0], *blocks[1:]], 1),
        ([[*at, 1.0], [*at, 2.0], blocks[2]], 2),  # the last one, though it is at its goal too
        ([blocks[0], [*at, 2.0], blocks[2]], 0),
    ]
    x = kind(np.array([[7.0, *np.ravel(case)] for case, _ in cases]))
    found = pass_next(x, NextObject(count=3, size=3, goal=2, within=0.2))
    for row, (case, chosen) in zip(np.asarray(found), cases, strict=True):
        expected = np.zeros((3, 3))
        expected[chosen] = case[chosen]
        np.testing.assert_array_equal(row, [7.0, *expected.ravel()])


def test_features_are_those_of_an_extractor_for_the_object_that_is_next():
    found, near = observations(200)
    tensors = {key: torch.as_tensor(value) for key, value in found.items()}
    features = SymlogOffsets(SPACE, [[0, 1]], [0], [0.1, 0.01], CHOICE)
    result = features(tensors).numpy().reshape(200, 2, -1)
    assert result.shape[2] * 2 == features.features_dim == len(features.names)
    offset = found["desired_goal"] - found["achieved_goal"]
    seen = found["observation"]
    second = near | (np.hypot(offset[:, 0], offset[:, 1]) <= 0.3)
    assert 80 < second.sum() < 150
    x = [seen[:, 0], *offset.T, seen[:, 0] - seen[:, 1]]
    for one, other in (
        (offset[:, 0], offset[:, 2]),
        (offset[:, 1], offset[:, 3]),
        (seen[:, 1], seen[:, 3]),
        (seen[:, 2] - seen[:, 0], seen[:, 4] - seen[:, 0]),
    ):
        x.append(np.where(second, other, one))
    for number, unit in enumerate((0.1, 0.01)):
        expected = [np.sign(one) * np.log1p(np.abs(one) / unit) for one in x]
        np.testing.assert_allclose(result[:, number], np.transpose(expected), rtol=1e-4, atol=1e-5)


def test_policy_file_acts_as_the_policy(quick_ppo, tmp_path):
    kwargs = {
        **quick_ppo.policy_kwargs,
        "next_object": {"within": 0.3, "objects": [{"components": [0]}, {"components": [1]}]},
    }
    config = quick_ppo.replace(
        policy=SYMLOG_PPO_POLICY, policy_kwargs=kwargs, normalize={"norm_obs": False}
    )
    folder = train(config, tmp_path, quiet=True).folder
    content = load_policy_file(folder.policy)
    rng = np.random.default_rng(1)
    shapes = content.header.observation
    found = {key: rng.uniform(-1, 1, (100, *shape)).astype("f4") for key, shape in shapes.items()}
    expected = trained_policy(folder.model, trust_pickle=True).act(found)
    np.testing.assert_allclose(content.act(found), expected, atol=2e-5)
    assert content.header.network.next_object == NextObject(count=2, size=2, goal=1, within=0.3)


@pytest.mark.parametrize(
    ("objects", "message"),
    [
        (OBJECTS[:1], "two or more objects in order"),
        ([{"components": [1]}, {"component": [3]}], "two or more objects in order"),
        ("0:3", "two or more objects in order"),
    ],
)
def test_settings_name_what_is_missing(quick_ppo, objects, message):
    with pytest.raises(UsageError, match=message):
        quick_ppo.replace(
            policy=SYMLOG_PPO_POLICY,
            policy_kwargs={"next_object": {"within": 0.1, "objects": objects}},
        )


def test_objects_that_cannot_be_told_apart_raise():
    three = {"within": 0.1, "objects": [{}, {}, {}]}
    with pytest.raises(UsageError, match="the goal has 4 components, which 3 objects cannot share"):
        SymlogOffsets(SPACE, next_object=three)
    unequal = {"within": 0.1, "objects": [{"components": [1]}, {"components": [1, 2]}]}
    with pytest.raises(UsageError, match="equal numbers of components"):
        SymlogOffsets(SPACE, next_object=unequal)


def test_a_mirror_changes_all_objects_alike():
    features = SymlogOffsets(SPACE, [], [0], [0.1], CHOICE)
    seen = reflection([0, 2, 4], 5, "observation")
    image = features.images(seen, reflection([0, 2], 4, "desired_goal"))
    # component 0; goal offsets; then of the next object: goal offset, component, difference
    assert image.sign[0].tolist() == [-1, -1, 1, -1, 1, -1, 1, 1, -1]
    assert image.source[0].tolist() == list(range(9))
    with pytest.raises(
        UsageError, match="image of what next_object observes depends on the object"
    ):
        features.images(seen, reflection([0, 3], 4, "desired_goal"))
    with pytest.raises(UsageError, match=r"is no feature|depends on the object"):
        features.images(seen, reflection([[0, 2], [1, 3]], 4, "desired_goal"))


@pytest.mark.parametrize(
    "changes",
    [{"count": 1}, {"goal": 0}, {"goal": 9}, {"size": 900}, {"within": 0.0}],
)
def test_a_header_that_contradicts_itself_raises(changes):
    header = example_header()
    assert read_header(header).network.next_object == NextObject(2, 3, 2, 0.1)
    header["network"]["next_object"].update(changes)
    with pytest.raises(InvalidHeader, match=r"network\.next_object"):
        read_header(header)


def example_header():
    network = {
        "widths": [13, 8, 10, 4, 1], "activation": "tanh", "squashing": "clip", "low": [-1.0],
        "high": [1.0], "features": "symlog",
        "next_object": {"count": 2, "size": 3, "goal": 2, "within": 0.1},
    }  # fmt: skip
    return {
        "algorithm": "ppo",
        "environment": {"id": "RigidEnvs/PandaStack-v0", "version": 0, "kwargs": {}},
        "observation": {key: list(one.shape) for key, one in SPACE.spaces.items()},
        "network": network, "normalization": None, "success": None, "seed": 0, "steps": 1,
        "commit": None, "versions": {},
    }  # fmt: skip


def test_panda_stack_observes_the_cube_whose_turn_it_is():
    config = load_config("ppo", "RigidEnvs/PandaStack-v0")
    envs = make_vector_env("RigidEnvs/PandaStack-v0", 4)
    kwargs = config.policy_kwargs
    names = [one[0] for one in envs.task.bounds]
    found = []
    for one in kwargs["next_object"]["objects"]:
        listed = [names[i] for i in component_indices("components", one["components"], len(names))]
        pairs = [f"{names[a]} minus {names[b]}" for a, b in one["differences"]]
        found.append([*listed, *pairs])
    first, second = found
    assert [name.replace("first", "second") for name in first] == second
    assert first[0] == "first cube rotation z"
    assert first[-1] == "first cube z minus hand z"
    envs.close()

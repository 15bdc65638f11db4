"""Writes policy files from Stable-Baselines3 models: the actor's layers and their statistics."""

import dataclasses
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from stable_baselines3.sac.policies import SACPolicy

from training.policies.bounded import BoundedPolicy
from training.policies.features.symlog_features import SymlogOffsets
from training.policies.offsets import GoalOffsets
from training.policies.pixels import SHARPNESS, KeypointFeatures
from training.policies.policy_file import SUFFIX, PolicyFile, load_policy_file
from training.policies.policy_header import (
    Environment,
    Header,
    Keypoints,
    Network,
    Normalization,
    Success,
)
from training.runs.run_folder import RunFolder, atomic_write, git_commit, package_versions
from training.settings.config import TrainConfig
from training.settings.errors import UsageError

ACTIVATIONS = {torch.nn.Tanh: "tanh", torch.nn.ReLU: "relu", torch.nn.ELU: "elu"}


def export_run(
    folder: RunFolder, output: Path, *, success: Success | None = None, sb3: bool = False
) -> list[Path]:
    """Copies the policy of a run folder into one file.

    Args:
        folder: The run.
        output: The file to write, with the suffix .safetensors.
        success: Measured success to store in the file.
        sb3: Also copy Stable-Baselines3's files, under the same name with .zip and .pkl.

    Returns:
        The files written.

    Raises:
        UsageError: The folder holds no policy, or the file cannot be written.
    """
    if output.suffix != SUFFIX:
        raise UsageError(f"output is {str(output)!r}, should end in {SUFFIX}")
    folder.config()
    if not folder.policy.exists():
        raise UsageError(f"{folder.path} has no checkpoint yet: {folder.policy.name} is missing")
    content = load_policy_file(folder.policy)
    if success is not None:
        header = dataclasses.replace(content.header, success=success)
        content = dataclasses.replace(content, header=header)
    written = [output]
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(output) as file:
            file.write(content.to_bytes())
        if sb3:
            for source, suffix in ((folder.model, ".zip"), (folder.normalization, ".pkl")):
                if source.exists():
                    written.append(Path(shutil.copyfile(source, output.with_suffix(suffix))))
    except OSError as error:
        raise UsageError(f"{output} cannot be written: {error.strerror}") from None
    return written


def policy_file_of(
    model: BaseAlgorithm, config: TrainConfig, success: Success | None = None
) -> PolicyFile:
    """The content of a policy file.

    Args:
        model: A PPO or SAC model, with its observation statistics if it has any.
        config: Its settings.
        success: Measured success of the policy, if any.

    Raises:
        UsageError: The model has parts that a policy file cannot describe.
    """
    space, actions = model.observation_space, model.action_space
    if not isinstance(space, spaces.Dict) or not isinstance(actions, spaces.Box):
        raise UsageError(
            f"policy files support dict observations and box actions, not {space}, {actions}"
        )
    layers, activation, features = _layers(model)
    shapes = {key: tuple(one.shape or ()) for key, one in space.spaces.items()}
    filters: list[tuple[np.ndarray, np.ndarray]] = []
    points = None
    extractor = _features_extractor(model)
    if isinstance(extractor, KeypointFeatures):
        filters, points = _keypoints(extractor)
        channels, height, width = shapes["observation"]  # as the network has it
        shapes = {
            "observation": (height, width, channels),
            "desired_goal": shapes["desired_goal"],
        }
    env_id = config.env_id.rpartition(":")[2]  # without "module:"
    version = re.search(r"-v(\d+)$", env_id)
    if version is None:
        raise UsageError(f"environment id is {env_id!r}, should end in a version such as -v0")
    normalization = model.get_vec_normalize_env()
    scaling, mean, variance = _statistics(normalization)
    header = Header(
        algorithm=config.algo,
        environment=Environment(env_id, int(version[1]), config.final_env_kwargs),
        observation=shapes,
        network=Network(
            widths=[layers[0][0].shape[1], *(len(biases) for _, biases in layers)],
            activation=activation,
            squashing=_squashing(model.policy),
            low=[float(x) for x in actions.low.flatten()],
            high=[float(x) for x in actions.high.flatten()],
            features=features,
            keypoints=points,
            next_object=extractor.objects if isinstance(extractor, SymlogOffsets) else None,
        ),
        normalization=scaling,
        success=success,
        seed=config.seed,
        steps=model.num_timesteps,
        commit=git_commit(),
        versions=package_versions(),
    )
    return PolicyFile(header, mean, variance, layers, filters)


def _squashing(policy: Any) -> str:
    """How the last layer's output becomes an action, as the header names it."""
    if isinstance(policy, BoundedPolicy):
        return "softsign"
    return "tanh" if isinstance(policy, SACPolicy) else "clip"


def _features_extractor(model: BaseAlgorithm) -> Any:
    """The actor's."""
    policy: Any = model.policy
    if isinstance(model, SAC):
        return policy.actor.features_extractor
    return policy.pi_features_extractor


def _layers(model: BaseAlgorithm) -> tuple[list[tuple[np.ndarray, np.ndarray]], str, str]:
    """The actor's weights and biases by layer, and the names of activation and features."""
    policy: Any = model.policy
    if isinstance(model, PPO):
        modules = [*policy.mlp_extractor.policy_net, policy.action_net]
    elif isinstance(model, SAC):
        modules = [*policy.actor.latent_pi, policy.actor.mu]
    else:
        raise UsageError(f"policy files support PPO and SAC, not {type(model).__name__}")
    extractor = _features_extractor(model)
    between = [module for module in modules if not isinstance(module, torch.nn.Linear)]
    kinds = {type(module) for module in between}
    own = isinstance(extractor, GoalOffsets | SymlogOffsets | KeypointFeatures)
    flat = own or all(isinstance(x, torch.nn.Flatten) for x in extractor.extractors.values())
    if not flat:
        raise UsageError(
            f"policy files cannot hold the features of a {type(extractor).__name__}; to act from "
            "pixels, use policy: training.policies.pixels.PixelPolicy"
        )
    alternate = len(modules) == 2 * len(between) + 1
    if not alternate or len(kinds) > 1 or not kinds <= ACTIVATIONS.keys():
        raise UsageError(
            f"policy files support linear layers with tanh, relu or elu, not {modules}"
        )
    linear = [module for module in modules if isinstance(module, torch.nn.Linear)]
    layers = [(_numbers(one.weight), _numbers(one.bias)) for one in linear]
    features = "linear"
    if isinstance(extractor, GoalOffsets):  # a linear map: merge it into the first layer
        layers[0] = (_numbers(linear[0].weight.double() @ extractor.matrix.double()), layers[0][1])
    if isinstance(extractor, KeypointFeatures):  # factors of the features: merge them likewise
        layers[0] = (layers[0][0] * _numbers(extractor.factors), layers[0][1])
    if isinstance(extractor, SymlogOffsets):
        chain = [_numbers(extractor.matrix)]
        if extractor.objects is not None:
            chain.append(_numbers(extractor.mix))
        layers[:0] = [(weights, np.zeros(len(weights), np.float32)) for weights in chain]
        features = "symlog"
    return layers, ACTIVATIONS[kinds.pop()] if kinds else "tanh", features


def _keypoints(
    extractor: KeypointFeatures,
) -> tuple[list[tuple[np.ndarray, np.ndarray]], Keypoints]:
    """Weights and biases of the convolutions, and their description."""
    chain = [module for module in extractor.net if isinstance(module, torch.nn.Conv2d)]
    filters = [(_numbers(one.weight), _numbers(one.bias)) for one in chain]
    filters[-1] = (SHARPNESS * filters[-1][0], SHARPNESS * filters[-1][1])
    sizes = [[one.out_channels, one.kernel_size[0], one.stride[0]] for one in chain]
    return filters, Keypoints("observation", sizes)


def _statistics(env: VecNormalize | None) -> tuple[Normalization | None, Any, Any]:
    """The scaling of observations, and their means and variances by key."""
    if env is None or not env.norm_obs:
        return None, {}, {}
    assert isinstance(env.obs_rms, dict)
    keys = list(env.norm_obs_keys or env.obs_rms)
    mean = {key: np.array(env.obs_rms[key].mean) for key in keys}
    variance = {key: np.array(env.obs_rms[key].var) for key in keys}
    return Normalization(keys, float(env.epsilon), float(env.clip_obs)), mean, variance


def _numbers(parameter: Any) -> np.ndarray:
    return parameter.detach().cpu().numpy().astype(np.float32)

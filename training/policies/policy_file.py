"""Policy files: a trained policy as text and numbers; reading one executes no code from it.

They are files of safetensors, which many programs can read. Their metadata have one entry,
`rigid-envs policy`: a JSON object with the version of the `format`, the `header`, and the `sha256`
of header and numbers. The tensors are `mean.KEY` and `variance.KEY` (float64) of each normalised
observation key, and `layer.N.weight` (outputs, inputs) and `layer.N.bias` (float32) of each layer;
if it acts from pixels, also `filter.N.weight` (outputs, inputs, k, k) and `filter.N.bias`.

A file with any changed byte is rejected. Stable-Baselines3's own files are pickles, which can run
any code when loaded.
"""

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save
from threadpoolctl import ThreadpoolController

import rigid_envs  # noqa: F401  (registers the ids)
from training.policies.features.keypoints import keypoints
from training.policies.features.next_object import pass_next
from training.policies.policy import Policy, check_shapes, of_state
from training.policies.policy_header import Header, InvalidHeader, read_header, reject_constant
from training.settings.environments import registered_arguments
from training.settings.errors import UsageError, check_exists, nearest
from training.settings.tasks import check_same_task

SUFFIX = ".safetensors"
FORMAT = 2
ENTRY = "rigid-envs policy"
"""Name of the entry of the metadata."""
MAX_BYTES = 2**28
"""Largest file that is read: far more than any policy needs, and less than the memory."""
ACTIVATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "symlog": lambda x: np.sign(x) * np.log1p(np.abs(x)),
}
SQUASHING_FUNCTIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "softsign": lambda x: x / (1.0 + np.abs(x)),
}

# NumPy's linear algebra library
_BLAS = ThreadpoolController()


@dataclass(frozen=True)
class PolicyFile:
    """The content of a policy file: header and numbers."""

    header: Header
    """Description of the policy and its origin."""
    mean: dict[str, np.ndarray]
    """Means by observation key, of its shape; empty without normalisation."""
    variance: dict[str, np.ndarray]
    """Variances by observation key, likewise."""
    layers: list[tuple[np.ndarray, np.ndarray]]
    """Weights (outputs, inputs) and biases (outputs,), float32, of each layer in order."""
    filters: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    """Likewise (outputs, inputs, k, k) and (outputs,) of the convolutions that find keypoints."""

    def act(self, observation: dict[str, np.ndarray]) -> np.ndarray:
        """The mean action, equal to Stable-Baselines3's `predict(deterministic=True)`.

        Sums are in float64, so that a world's action hardly depends on the number of worlds. They
        run on one thread: the threads of BLAS would spin on the cores that the worlds need.

        Args:
            observation: `{key: (n, ...)}`, with at least the keys of the header.

        Returns:
            (n, action_dim) float32 within the bounds of the action.

        Raises:
            UsageError: A key is missing, or a shape differs from that of training.
        """
        header = self.header
        read = {
            key: np.asarray(observation[key]) for key in header.observation if key in observation
        }
        given = {key: value.shape[1:] for key, value in read.items()}
        unbatched = {key: value.shape for key, value in read.items()}
        if unbatched == header.observation:
            raise UsageError(
                "the observation has no batch axis; add one: "
                "{key: value[None] for key, value in observation.items()}"
            )
        check_shapes(header.observation, given)
        points, parts = header.network.keypoints, []
        between = self._between()
        with _BLAS.limit(limits=1, user_api="blas"):
            for key in header.observation:  # in the order of the network's inputs
                value = read[key]
                if header.normalization is not None and key in self.mean:
                    scale = np.sqrt(self.variance[key] + header.normalization.epsilon)
                    clip = header.normalization.clip
                    value = np.clip((value - self.mean[key]) / scale, -clip, clip)
                if points is not None and key == points.key:
                    value = keypoints(value, self.filters, [one[-1] for one in points.filters])
                parts.append(value.astype(np.float32).reshape(len(value), -1))
            x = np.concatenate(parts, axis=1).astype(np.float64)
            for number, (weights, biases) in enumerate(self.layers):
                if number:
                    x = between[number - 1](x)
                x = x @ weights.T.astype(np.float64) + biases
        low, high = np.array(header.network.low), np.array(header.network.high)
        if header.network.squashing in SQUASHING_FUNCTIONS:
            x = low + 0.5 * (SQUASHING_FUNCTIONS[header.network.squashing](x) + 1.0) * (high - low)
        return np.clip(x, low, high).astype(np.float32)

    def _between(self) -> list[Callable[[np.ndarray], np.ndarray]]:
        """What follows each layer but the last."""
        network = self.header.network
        between = [ACTIVATIONS[network.activation]] * (len(self.layers) - 1)
        if network.features != "linear":
            first = [ACTIVATIONS[network.features]]
            if network.next_object is not None:
                first.insert(0, partial(pass_next, objects=network.next_object))
            between[: len(first)] = first
        return between

    def to_bytes(self) -> bytes:
        """The bytes of the file.

        Raises:
            UsageError: Shapes contradict the header, a number is not finite, or JSON cannot
                represent an argument of the environment.
        """
        tensors = self._tensors()
        expected = _tensors_of(self.header)
        shapes = {name: tensor.shape for name, tensor in tensors.items()}
        required = {name: shape for name, (shape, _) in expected.items()}
        if shapes != required:
            raise UsageError(f"arrays have the shapes {shapes}, but the header requires {required}")
        if not all(np.isfinite(tensor).all() for tensor in tensors.values()):
            raise UsageError("weights or statistics are not finite: training has diverged")
        typed = {name: tensors[name].astype(dtype) for name, (_, dtype) in expected.items()}
        header = asdict(self.header)
        try:
            entry = {"format": FORMAT, "header": header, "sha256": checksum(header, typed)}
            text = json.dumps(entry, indent=1, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise UsageError(f"JSON cannot represent env_kwargs: {error}") from None
        return save(typed, {ENTRY: text})

    def _tensors(self) -> dict[str, np.ndarray]:
        named = {f"mean.{key}": array for key, array in self.mean.items()}
        named |= {f"variance.{key}": array for key, array in self.variance.items()}
        for kind, parameters in (("layer", self.layers), ("filter", self.filters)):
            for n, (weight, bias) in enumerate(parameters):
                named |= {f"{kind}.{n}.weight": weight, f"{kind}.{n}.bias": bias}
        return named


def checksum(header: Any, tensors: dict[str, np.ndarray]) -> str:
    """SHA-256 of a header, as JSON can represent it, and of tensors."""
    digest = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in sorted(tensors):
        digest.update(f"{name} {tensors[name].dtype} {tensors[name].shape}".encode())
        digest.update(np.ascontiguousarray(tensors[name]).tobytes())
    return digest.hexdigest()


def load_policy_file(path: Path) -> PolicyFile:
    """Reads a policy file, without executing anything in it.

    Raises:
        UsageError: The file does not exist, is not a policy file, has another version of the
            format, or is damaged; or its header is invalid.
    """
    check_exists(path, f"a {SUFFIX} file")
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}") from None
    not_a_policy = f"{path} is not a policy file; to write one: rigid-envs export RUN"
    if len(data) > MAX_BYTES:
        raise UsageError(not_a_policy)
    try:
        tensors = load(data)
        metadata = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])["__metadata__"]
        entry = json.loads(metadata[ENTRY], parse_constant=reject_constant)
        version, header, digest = entry["format"], entry["header"], entry["sha256"]
    except (SafetensorError, ValueError, KeyError, TypeError, RecursionError):
        raise UsageError(not_a_policy) from None
    if version != FORMAT:
        raise UsageError(
            f"{path} has format version {version!r}, should be {FORMAT}; "
            "it is damaged, or from a newer rigid-envs"
        )
    # what is between the parts of the file, such as blanks, has no checksum
    if digest != checksum(header, tensors) or save(tensors, metadata) != data:
        raise UsageError(f"{path} is damaged: its checksum is wrong; copy or export it again")
    try:
        checked = read_header(header)
        arrays = _arrays(checked, tensors)
    except InvalidHeader as error:
        raise UsageError(f"{path}: {error}") from None
    return PolicyFile(checked, *arrays)


def read_policy(path: Path | str, *, algo: str | None = None, env_id: str | None = None) -> Policy:
    """The policy of a file; its actions are the mean.

    Args:
        path: A policy file.
        algo: Expected algorithm; by default any.
        env_id: Environment to act on, in place of the one of training. Arguments that this id sets
            itself, as the reward_type of a dense id, replace those of training.

    Raises:
        UsageError: As for `load_policy_file`; the algorithm differs, or the environment of training
            is not installed.
    """
    path = Path(path)
    content = load_policy_file(path)
    environment = content.header.environment
    env_kwargs = environment.kwargs
    if algo not in (None, content.header.algorithm):
        raise UsageError(f"{path} was trained with {content.header.algorithm}, not with {algo!r}")
    if env_id is None:
        _check_installed(path, environment.id)
    elif env_id != environment.id:
        check_same_task(environment.id, env_id, str(path))
        env_kwargs = {**env_kwargs, **registered_arguments(env_id)}
    name = f"{content.header.algorithm} ({path})"
    from_pixels = content.header.network.keypoints is not None
    own = from_pixels or "state" in content.header.observation
    act: Any = content.act
    shapes = content.header.observation
    if not own:  # where there are pixels, too, the state has another name
        act = of_state(act)
    return Policy(act, env_id or environment.id, name, env_kwargs, path.parent, shapes)


def _check_installed(path: Path, env_id: str) -> None:
    """Raises UsageError for an id that is not registered.

    `gym.make` would import a module that the id names, so an id from a file must not reach it.
    """
    if env_id in gym.registry:
        return
    base = re.sub(r"-v\d+$", "", env_id)
    others = [name for name in gym.registry if re.sub(r"-v\d+$", "", name) == base]
    if others:
        raise UsageError(
            f"{path} was trained on {env_id}, but {others[-1]} is installed, whose behaviour "
            f"differs; to use the policy there anyway: --env {others[-1]}"
        )
    known = [name for name in gym.registry if name.startswith("RigidEnvs/")]
    raise UsageError(
        f"{path} was trained on {env_id!r}, which is not registered; for a task of your own call "
        "training.commands.cli.main([...]) with the words of the command in the script that "
        f"registers it; or did you mean --env {nearest(env_id, known)}?"
    )


def _tensors_of(header: Header) -> dict[str, tuple[tuple[int, ...], str]]:
    """Shape and dtype of each tensor of a file, by name."""
    keys = header.normalization.keys if header.normalization is not None else []
    tensors: dict[str, tuple[tuple[int, ...], str]] = {}
    for key in keys:
        for name in ("mean", "variance"):
            tensors[f"{name}.{key}"] = header.observation[key], "float64"
    for n, (inputs, outputs) in enumerate(pairwise(header.network.widths)):
        tensors[f"layer.{n}.weight"] = (outputs, inputs), "float32"
        tensors[f"layer.{n}.bias"] = (outputs,), "float32"
    points = header.network.keypoints
    if points is not None:
        inputs = header.observation[points.key][-1]
        for n, (outputs, width, _) in enumerate(points.filters):
            tensors[f"filter.{n}.weight"] = (outputs, inputs, width, width), "float32"
            tensors[f"filter.{n}.bias"] = (outputs,), "float32"
            inputs = outputs
    return tensors


def _arrays(header: Header, tensors: dict[str, np.ndarray]) -> tuple[Any, Any, Any, Any]:
    """Mean, variance, layers and filters, as in PolicyFile.

    Raises:
        InvalidHeader: The tensors contradict the header, or a number is not finite.
    """
    expected = _tensors_of(header)
    found = {name: (tensor.shape, str(tensor.dtype)) for name, tensor in tensors.items()}
    for name in sorted({*expected, *found}):
        if expected.get(name) != found.get(name):
            raise InvalidHeader(
                f"the header requires {_words(expected.get(name))} for {name}, but the file has "
                f"{_words(found.get(name))}"
            )
    for name, tensor in tensors.items():
        if not np.isfinite(tensor).all():
            raise InvalidHeader(f"{name}: a weight or statistic is not finite")
    keys = header.normalization.keys if header.normalization is not None else []
    mean = {key: tensors[f"mean.{key}"] for key in keys}
    variance = {key: tensors[f"variance.{key}"] for key in keys}
    if any((array < 0).any() for array in variance.values()):
        raise InvalidHeader("a variance is negative")
    points = header.network.keypoints
    count = {
        "layer": len(header.network.widths) - 1,
        "filter": 0 if points is None else len(points.filters),
    }
    layers, filters = (
        [(tensors[f"{kind}.{n}.weight"], tensors[f"{kind}.{n}.bias"]) for n in range(count[kind])]
        for kind in ("layer", "filter")
    )
    return mean, variance, layers, filters


def _words(tensor: tuple[tuple[int, ...], str] | None) -> str:
    return "no tensor" if tensor is None else f"{tensor[1]} of shape {tensor[0]}"

"""Policy files: a trained policy as text and numbers; reading one executes no code from it.

    rigid-envs policy 1      kind of file, and version of the format
    <SHA-256>                checksum of everything below, in hexadecimal
    {...}                    the header, JSON in UTF-8, ended by a zero byte
    numbers                  little endian: mean and variance (float64) of each normalised
                             observation key; weights (outputs, inputs) and biases (float32) of
                             each layer

`head -c 2000 FILE` shows the header. It determines how many numbers follow. A file with any changed
byte is rejected. Stable-Baselines3's own files are pickles, which can run any code when loaded.
"""

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from threadpoolctl import ThreadpoolController

import rigid_envs  # noqa: F401  (registers the ids)
from training.policies.policy import Policy
from training.policies.policy_header import Header, InvalidHeader, read_header
from training.settings.environments import registered_arguments
from training.settings.errors import UsageError, check_exists, nearest

SUFFIX = ".policy"
FORMAT = 1
MAGIC = b"rigid-envs policy "
MAX_BYTES = 2**28
"""Largest file that is read: far more than any policy needs, and less than the memory."""
ACTIVATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
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

    def act(self, observation: dict[str, np.ndarray]) -> np.ndarray:
        """The mean action, equal to Stable-Baselines3's `predict(deterministic=True)`.

        Sums are in float64, so that a world's action hardly depends on the number of worlds. They
        run on one thread: the threads of BLAS would spin on the cores that the worlds need.

        Args:
            observation: `{key: (n, ...)}`, with the keys of the header.

        Returns:
            (n, action_dim) float32 within the bounds of the action.

        Raises:
            UsageError: The keys or shapes differ from those that the policy was trained on.
        """
        header = self.header
        given = {key: np.asarray(value).shape[1:] for key, value in observation.items()}
        unbatched = {key: np.asarray(value).shape for key, value in observation.items()}
        if unbatched == header.observation:
            raise UsageError(
                "the observation has no batch axis; add one: "
                "{key: value[None] for key, value in observation.items()}"
            )
        if given != header.observation:
            raise UsageError(
                f"the policy requires observations of shapes {header.observation}, but the "
                f"environment has {given}; does it have the same arguments as in training?"
            )
        parts = []
        for key in header.observation:  # in the order of the network's inputs
            value = np.asarray(observation[key])
            if header.normalization is not None and key in self.mean:
                scale = np.sqrt(self.variance[key] + header.normalization.epsilon)
                clip = header.normalization.clip
                value = np.clip((value - self.mean[key]) / scale, -clip, clip)
            parts.append(value.astype(np.float32).reshape(len(value), -1))
        x = np.concatenate(parts, axis=1).astype(np.float64)
        activation = ACTIVATIONS[header.network.activation]
        with _BLAS.limit(limits=1, user_api="blas"):
            for number, (weights, biases) in enumerate(self.layers):
                x = (activation(x) if number else x) @ weights.T.astype(np.float64) + biases
        low, high = np.array(header.network.low), np.array(header.network.high)
        if header.network.squashing in SQUASHING_FUNCTIONS:
            x = low + 0.5 * (SQUASHING_FUNCTIONS[header.network.squashing](x) + 1.0) * (high - low)
        return np.clip(x, low, high).astype(np.float32)

    def to_bytes(self) -> bytes:
        """The bytes of the file.

        Raises:
            UsageError: Shapes contradict the header, a number is not finite, or JSON cannot
                represent an argument of the environment.
        """
        arrays = [part for key in self.mean for part in (self.mean[key], self.variance[key])]
        arrays += [part for layer in self.layers for part in layer]
        expected = _shapes(self.header)
        if [array.shape for array in arrays] != [shape for shape, _ in expected]:
            raise UsageError(
                f"arrays have the shapes {[array.shape for array in arrays]}, but the header "
                f"requires {[shape for shape, _ in expected]}"
            )
        if not all(np.isfinite(array).all() for array in arrays):
            raise UsageError("weights or statistics are not finite: training has diverged")
        try:
            text = json.dumps(asdict(self.header), indent=1, allow_nan=False, ensure_ascii=False)
        except (TypeError, ValueError) as error:
            raise UsageError(f"JSON cannot represent env_kwargs: {error}") from None
        numbers = b"".join(
            array.astype(dtype).tobytes()
            for array, (_, dtype) in zip(arrays, expected, strict=True)
        )
        body = text.encode("utf-8") + b"\0" + numbers
        digest = hashlib.sha256(body).hexdigest().encode("ascii")
        return MAGIC + str(FORMAT).encode("ascii") + b"\n" + digest + b"\n" + body


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
    if not data.startswith(MAGIC) or len(data) > MAX_BYTES:
        raise UsageError(f"{path} is not a policy file; to write one: rigid-envs export RUN")
    version, _, rest = data.removeprefix(MAGIC).partition(b"\n")
    if version != str(FORMAT).encode("ascii"):
        shown = version[:20].decode("ascii", "replace")
        raise UsageError(
            f"{path} has format version {shown!r}, should be {FORMAT}; "
            "it is damaged, or from a newer rigid-envs"
        )
    digest, _, body = rest.partition(b"\n")
    if hashlib.sha256(body).hexdigest().encode("ascii") != digest:
        raise UsageError(f"{path} is damaged: its checksum is wrong; copy or export it again")
    text, _, numbers = body.partition(b"\0")
    try:
        header = read_header(text)
        mean, variance, layers = _arrays(header, numbers)
    except InvalidHeader as error:
        raise UsageError(f"{path}: {error}") from None
    return PolicyFile(header, mean, variance, layers)


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
        env_kwargs = {**env_kwargs, **registered_arguments(env_id)}
    name = f"{content.header.algorithm} ({path})"
    return Policy(content.act, env_id or environment.id, name, env_kwargs, path.parent)


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
        f"{path} was trained on {env_id!r}, which is not installed; "
        f"did you mean --env {nearest(env_id, known)}?"
    )


def _shapes(header: Header) -> list[tuple[tuple[int, ...], str]]:
    """Shape and dtype of each array of a file, in order."""
    keys = header.normalization.keys if header.normalization is not None else []
    shapes: list[tuple[tuple[int, ...], str]] = []
    for key in keys:
        shapes += [(header.observation[key], "<f8")] * 2
    for inputs, outputs in pairwise(header.network.widths):
        shapes += [((outputs, inputs), "<f4"), ((outputs,), "<f4")]
    return shapes


def _arrays(header: Header, numbers: bytes) -> tuple[Any, Any, Any]:
    """Mean, variance and layers, as in PolicyFile.

    Raises:
        InvalidHeader: The number of bytes contradicts the header, or a number is not finite.
    """
    shapes = _shapes(header)
    # Python integers: very large widths must not overflow into a size that fits
    sizes = [int(dtype[-1]) for _, dtype in shapes]
    for index, (shape, _) in enumerate(shapes):
        for side in shape:
            sizes[index] *= side
    if sum(sizes) != len(numbers):
        raise InvalidHeader(
            f"the header requires {sum(sizes)} bytes of numbers, but {len(numbers)} follow"
        )
    arrays, start = [], 0
    for (shape, dtype), size in zip(shapes, sizes, strict=True):
        array = np.frombuffer(numbers[start : start + size], dtype).reshape(shape)
        if not np.isfinite(array).all():
            raise InvalidHeader("a weight or statistic is not finite")
        arrays.append(array)
        start += size
    keys = header.normalization.keys if header.normalization is not None else []
    mean = {key: arrays[2 * number] for number, key in enumerate(keys)}
    variance = {key: arrays[2 * number + 1] for number, key in enumerate(keys)}
    if any((array < 0).any() for array in variance.values()):
        raise InvalidHeader("a variance is negative")
    layers = arrays[2 * len(keys) :]
    return mean, variance, list(zip(layers[::2], layers[1::2], strict=True))

"""Policy files: what a trained policy does, as text and numbers that nothing executes.

    rigid-envs policy 1      what it is, and the version of this format
    <SHA-256>                of all that follows, in hexadecimal
    {...}                    the header, as JSON in UTF-8; a byte of zero ends it
    numbers                  little endian: for each observation key, where observations are
                             normalised, mean and variance (float64); for each layer its weights
                             (outputs, inputs) and biases (float32)

`head -c 2000 FILE` shows the header. It determines how many numbers follow, and any other byte
than those that were written is refused, so a damaged file is never mistaken for a policy.
Stable-Baselines3's own files are pickles, which can run any code when loaded.
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

import rigid_envs  # noqa: F401  (registers the ids)
from training.policies.policy import Policy
from training.policies.policy_header import Header, Misfit, read_header
from training.settings.errors import UsageError, nearest

SUFFIX = ".policy"
FORMAT = 1
MAGIC = b"rigid-envs policy "
LARGEST = 2**28
"""Bytes: far more than any policy takes, and no more than a machine has."""
ACTIVATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
}
SQUASHED: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "softsign": lambda x: x / (1.0 + np.abs(x)),
}


@dataclass(frozen=True)
class PolicyFile:
    """The content of a policy file: header and numbers."""

    header: Header
    """What the policy is and where it comes from."""
    mean: dict[str, np.ndarray]
    """By observation key, of the same shape: subtracted; empty if nothing is normalised."""
    variance: dict[str, np.ndarray]
    """Likewise: differences are divided by its root."""
    layers: list[tuple[np.ndarray, np.ndarray]]
    """Weights (outputs, inputs) and biases (outputs,) float32 from the first layer to the last."""

    def act(self, observation: dict[str, np.ndarray]) -> np.ndarray:
        """The mean action, as Stable-Baselines3's `predict(deterministic=True)` has it.

        Sums are made in float64: a world's action hardly depends on how many there are.

        Args:
            observation: `{key: (n, ...)}`, as the header names them.

        Returns:
            (n, action_dim) float32 within the bounds of the action.

        Raises:
            UsageError: The observation has other keys or shapes than the policy was trained on.
        """
        header = self.header
        given = {key: np.asarray(value).shape[1:] for key, value in observation.items()}
        alone = {key: np.asarray(value).shape for key, value in observation.items()}
        if alone == header.observation:
            raise UsageError(
                "the policy takes observations of many worlds, this is of one: give each an axis "
                "in front, as in {key: value[None] for key, value in observation.items()}"
            )
        if given != header.observation:
            raise UsageError(
                f"the policy takes observations {header.observation}, "
                f"the environment's are {given}; were its arguments others?"
            )
        parts = []
        for key in header.observation:  # in the order in which the network takes them
            value = np.asarray(observation[key])
            if header.normalization is not None and key in self.mean:
                scale = np.sqrt(self.variance[key] + header.normalization.epsilon)
                clip = header.normalization.clip
                value = np.clip((value - self.mean[key]) / scale, -clip, clip)
            parts.append(value.astype(np.float32).reshape(len(value), -1))
        x = np.concatenate(parts, axis=1).astype(np.float64)
        activation = ACTIVATIONS[header.network.activation]
        for number, (weights, biases) in enumerate(self.layers):
            x = (activation(x) if number else x) @ weights.T.astype(np.float64) + biases
        low, high = np.array(header.network.low), np.array(header.network.high)
        if header.network.squashing in SQUASHED:
            x = low + 0.5 * (SQUASHED[header.network.squashing](x) + 1.0) * (high - low)
        return np.clip(x, low, high).astype(np.float32)

    def to_bytes(self) -> bytes:
        """The file.

        Raises:
            UsageError: Shapes don't fit the header, a number is not finite, or the environment has
                arguments that JSON can't hold.
        """
        arrays = [part for key in self.mean for part in (self.mean[key], self.variance[key])]
        arrays += [part for layer in self.layers for part in layer]
        expected = _shapes(self.header)
        if [array.shape for array in arrays] != [shape for shape, _ in expected]:
            raise UsageError(
                f"arrays have the shapes {[array.shape for array in arrays]}, "
                f"the header asks for {[shape for shape, _ in expected]}"
            )
        if not all(np.isfinite(array).all() for array in arrays):
            raise UsageError("weights or statistics are not finite: training has diverged")
        try:
            text = json.dumps(asdict(self.header), indent=1, allow_nan=False, ensure_ascii=False)
        except (TypeError, ValueError) as error:
            raise UsageError(f"arguments of the environment don't go into JSON: {error}") from None
        numbers = b"".join(
            array.astype(dtype).tobytes()
            for array, (_, dtype) in zip(arrays, expected, strict=True)
        )
        body = text.encode("utf-8") + b"\0" + numbers
        digest = hashlib.sha256(body).hexdigest().encode("ascii")
        return MAGIC + str(FORMAT).encode("ascii") + b"\n" + digest + b"\n" + body


def load_policy_file(path: Path) -> PolicyFile:
    """Reads a policy file, and nothing in it is run.

    Raises:
        UsageError: There is no such file, it is none of this kind or of another version of the
            format, it is damaged, or its header says what this version does not know.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}") from None
    if not data.startswith(MAGIC) or len(data) > LARGEST:
        raise UsageError(f"{path} is no policy file; `rigid-envs export RUN` writes one")
    version, _, rest = data.removeprefix(MAGIC).partition(b"\n")
    if version != str(FORMAT).encode("ascii"):
        shown = version[:20].decode("ascii", "replace")
        raise UsageError(
            f"{path} has version {shown!r} of the format, should be {FORMAT}; "
            "is it damaged, or of a newer rigid-envs?"
        )
    digest, _, body = rest.partition(b"\n")
    if hashlib.sha256(body).hexdigest().encode("ascii") != digest:
        raise UsageError(f"{path} is damaged: its checksum is another; copy or export it anew")
    text, _, numbers = body.partition(b"\0")
    try:
        header = read_header(text)
        mean, variance, layers = _arrays(header, numbers)
    except Misfit as error:
        raise UsageError(f"{path}: {error}") from None
    return PolicyFile(header, mean, variance, layers)


def read_policy(path: Path | str, *, algo: str | None = None, env_id: str | None = None) -> Policy:
    """The policy of a file, acting by its mean.

    Args:
        path: A policy file.
        algo: Algorithm that it should be of; any if not given.
        env_id: Environment to act on; that of training if not given.

    Raises:
        UsageError: As `load_policy_file`, it is of another algorithm, or its environment is
            not the one that is installed.
    """
    path = Path(path)
    content = load_policy_file(path)
    environment = content.header.environment
    if algo not in (None, content.header.algorithm):
        raise UsageError(f"{path} is a policy of {content.header.algorithm}, not of {algo!r}")
    if env_id is None:
        _check_installed(path, environment.id)
    name = f"{content.header.algorithm} ({path})"
    return Policy(content.act, env_id or environment.id, name, environment.kwargs, path.parent)


def _check_installed(path: Path, env_id: str) -> None:
    """Refuses ids that are not registered: `gym.make` would import what a file names."""
    if env_id in gym.registry:
        return
    base = re.sub(r"-v\d+$", "", env_id)
    others = [name for name in gym.registry if re.sub(r"-v\d+$", "", name) == base]
    if others:
        raise UsageError(
            f"{path} was trained on {env_id}, installed is {others[-1]}, "
            f"which behaves otherwise; to try it there all the same: --env {others[-1]}"
        )
    known = [name for name in gym.registry if name.startswith("RigidEnvs/")]
    raise UsageError(
        f"{path} was trained on {env_id!r}, an environment that is not installed; "
        f"did you mean --env {nearest(env_id, known)}?"
    )


def _shapes(header: Header) -> list[tuple[tuple[int, ...], str]]:
    """Shape and type of each array of a file, in their order."""
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
        Misfit: There are more or fewer numbers than the header says, or one is not finite.
    """
    shapes = _shapes(header)
    # Python's integers: a header of absurd widths must not overflow into a size that fits
    sizes = [int(dtype[-1]) for _, dtype in shapes]
    for index, (shape, _) in enumerate(shapes):
        for side in shape:
            sizes[index] *= side
    if sum(sizes) != len(numbers):
        raise Misfit(f"the header asks for {sum(sizes)} bytes of numbers, {len(numbers)} follow")
    arrays, start = [], 0
    for (shape, dtype), size in zip(shapes, sizes, strict=True):
        array = np.frombuffer(numbers[start : start + size], dtype).reshape(shape)
        if not np.isfinite(array).all():
            raise Misfit("a weight or statistic is not finite")
        arrays.append(array)
        start += size
    keys = header.normalization.keys if header.normalization is not None else []
    mean = {key: arrays[2 * number] for number, key in enumerate(keys)}
    variance = {key: arrays[2 * number + 1] for number, key in enumerate(keys)}
    if any((array < 0).any() for array in variance.values()):
        raise Misfit("a variance is negative")
    layers = arrays[2 * len(keys) :]
    return mean, variance, list(zip(layers[::2], layers[1::2], strict=True))

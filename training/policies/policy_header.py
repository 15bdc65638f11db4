"""The header of a policy file: its fields, and a reader that validates every value."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from training.policies.features.keypoints import map_size
from training.policies.features.next_object import NextObject

SQUASHING = {"ppo": ("clip", "softsign"), "sac": ("tanh",)}
"""How the network's output becomes an action, by algorithm: clipped to the bounds, or squashed."""
ACTIVATION_NAMES = ("tanh", "relu", "elu")
FEATURES = ("linear", "symlog")
"""What follows the first layer: "linear" means `activation`, as after the others."""


class InvalidHeader(ValueError):
    """The header is invalid; the message names the field and valid values."""


@dataclass(frozen=True)
class Environment:
    """The environment of training."""

    id: str
    """Environment id, as in RigidEnvs/Push-v0."""
    version: int
    """The number after "-v"; another version behaves differently."""
    kwargs: dict[str, Any]
    """Its arguments."""


@dataclass(frozen=True)
class Keypoints:
    """The part of a network that finds keypoints in a picture."""

    key: str
    """Key of the picture in observations."""
    filters: list[list[int]]
    """Outputs, kernel width and stride of each convolution; the last makes the maps."""


@dataclass(frozen=True)
class Network:
    """The network from observations to actions."""

    widths: list[int]
    """Width of each layer, from the size of all observations to the size of the action. A picture
    counts with two for each of its keypoints."""
    activation: str
    """Activation between layers: tanh, relu or elu."""
    squashing: str
    """From output to action: "clip" to the bounds; "tanh" or "softsign", scaled to the bounds."""
    low: list[float]
    """Lower bounds of the action."""
    high: list[float]
    """Upper bounds of the action."""
    features: str = "linear"
    """"symlog": the first layer gives features, and sign(x) ln(1 + |x|) follows it in place of the
    activation. Files without this entry have "linear"."""
    keypoints: Keypoints | None = None
    """How the picture is observed; None, as in files without this entry, if there is none."""
    next_object: NextObject | None = None
    """Blocks of the first layer's outputs of which one passes, see `pass_next`; a layer between
    them and symlog makes features. None, as in files without this entry, if there are none."""


@dataclass(frozen=True)
class Normalization:
    """Scaling of observations: (x - mean) / √(variance + epsilon), clipped to ±clip."""

    keys: list[str]
    """Scaled observation keys, in the order of their statistics in the file."""
    epsilon: float
    """Added to the variance to avoid division by zero."""
    clip: float
    """Largest absolute value after scaling."""


@dataclass(frozen=True)
class Success:
    """Measured success of the policy."""

    episodes: int
    """Number of episodes."""
    rate: float
    """Fraction of the episodes that ended in success."""
    fidelity: str | None
    """Fidelity preset of the episodes; None for the default of the environment."""
    seed: int
    """Seed of the first episode."""


@dataclass(frozen=True)
class Header:
    """Description of a policy."""

    algorithm: str
    """ppo or sac."""
    environment: Environment
    """The environment of training."""
    observation: dict[str, tuple[int, ...]]
    """Shape of the part of one world's observation that the policy reads, by key, in the order of
    the network's inputs."""
    network: Network
    """The network from observations to actions."""
    normalization: Normalization | None
    """Scaling of observations; None without normalisation."""
    success: Success | None
    """Measured success; None if not measured."""
    seed: int | None
    """Seed of training."""
    steps: int
    """Environment steps of training, summed over worlds."""
    commit: str | None
    """Git commit of the training code, if known."""
    versions: dict[str, Any]
    """Versions of Python, platform and packages in training."""


def read_header(values: Any) -> Header:
    """Validates a header.

    Args:
        values: Parsed JSON.

    Raises:
        InvalidHeader: A field is missing, unknown, of a wrong type or in contradiction to another
            one.
    """
    fields = _fields(values, "the header", Header)
    algorithm = _one_of(fields["algorithm"], "algorithm", tuple(SQUASHING))
    observation = {
        key: tuple(_integers(shape, f"observation {key!r}"))
        for key, shape in _mapping(fields["observation"], "observation").items()
    }
    header = Header(
        algorithm=algorithm,
        environment=_environment(fields["environment"]),
        observation=observation,
        network=_network(fields["network"], algorithm),
        normalization=_optional(fields["normalization"], _normalization),
        success=_optional(fields["success"], _success),
        seed=_optional(fields["seed"], lambda value: _integer(value, "seed")),
        steps=_integer(fields["steps"], "steps"),
        commit=_optional(fields["commit"], lambda value: _text(value, "commit")),
        versions=_mapping(fields["versions"], "versions"),
    )
    points = header.network.keypoints
    if points is not None:
        _one_of(points.key, "network.keypoints.key", tuple(observation))
        shape = observation[points.key]
        if len(shape) != 3 or min(map_size(side, points.filters) for side in shape[:2]) < 1:
            raise InvalidHeader(
                f"observation {points.key!r} has the shape {shape}, should be (height, width, "
                "channels) of a picture that is wide enough for network.keypoints.filters"
            )
    inputs = sum(inputs_of(header, key) for key in observation)
    if header.network.widths[0] != inputs:
        raise InvalidHeader(
            f"network.widths starts with {header.network.widths[0]}, should be {inputs}"
        )
    if header.normalization is not None:
        for key in header.normalization.keys:
            scaled = [one for one in observation if points is None or one != points.key]
            _one_of(key, "normalization.keys", tuple(scaled))
    return header


def inputs_of(header: Header, key: str) -> int:
    """Number of the network's inputs from one key of the observation."""
    keypoints = header.network.keypoints
    if keypoints is not None and key == keypoints.key:
        return 2 * keypoints.filters[-1][0]
    return math.prod(header.observation[key])


def _environment(value: Any) -> Environment:
    fields = _fields(value, "environment", Environment)
    found = Environment(
        _text(fields["id"], "environment.id"),
        _integer(fields["version"], "environment.version"),
        _mapping(fields["kwargs"], "environment.kwargs"),
    )
    if not found.id.endswith(f"-v{found.version}"):
        raise InvalidHeader(
            f"environment.version is {found.version}, but environment.id is {found.id!r}"
        )
    return found


def _network(value: Any, algorithm: str) -> Network:
    fields = _fields(value, "network", Network)
    network = Network(
        _integers(fields["widths"], "network.widths"),
        _one_of(fields["activation"], "network.activation", ACTIVATION_NAMES),
        _one_of(fields["squashing"], "network.squashing", SQUASHING[algorithm]),
        [_number(x, "network.low") for x in _list(fields["low"], "network.low")],
        [_number(x, "network.high") for x in _list(fields["high"], "network.high")],
        _one_of(fields["features"], "network.features", FEATURES),
        _optional(fields["keypoints"], _keypoints),
        _optional(fields["next_object"], _next_object),
    )
    if len(network.widths) < 2 or min(network.widths) < 1:
        raise InvalidHeader(
            f"network.widths is {network.widths}, should be two or more integers of at least 1"
        )
    objects = network.next_object
    if network.features == "symlog" and len(network.widths) < (3 if objects is None else 4):
        raise InvalidHeader(
            "network.features is 'symlog', should be 'linear': symlog follows the first of at "
            "least two layers, or the second of at least three with network.next_object"
        )
    if objects is not None and (
        network.features != "symlog"
        or objects.count < 2
        or not 1 <= objects.goal <= objects.size
        or objects.count * objects.size > network.widths[1]
        or objects.within <= 0
    ):
        raise InvalidHeader(
            f"network.next_object is {objects}, should be two or more blocks of the first layer's "
            f"{network.widths[1]} outputs, whose size is at least goal, which is at least 1, with "
            "within above 0; and network.features should be 'symlog'"
        )
    for name, bounds in (("low", network.low), ("high", network.high)):
        if len(bounds) != network.widths[-1]:
            raise InvalidHeader(
                f"network.{name} has {len(bounds)} entries, should have {network.widths[-1]}"
            )
    if any(low > high for low, high in zip(network.low, network.high, strict=True)):
        raise InvalidHeader(f"network.low is {network.low}, should be at most high, {network.high}")
    return network


def _keypoints(value: Any) -> Keypoints:
    fields = _fields(value, "network.keypoints", Keypoints)
    name = "network.keypoints.filters"
    filters = [_integers(one, name) for one in _list(fields["filters"], name)]
    if not filters or any(len(one) != 3 or min(one) < 1 for one in filters):
        raise InvalidHeader(
            f"{name} is {filters}, should be a list of [outputs, kernel width, stride]"
        )
    return Keypoints(_text(fields["key"], "network.keypoints.key"), filters)


def _next_object(value: Any) -> NextObject:
    fields = _fields(value, "network.next_object", NextObject)
    count, size, goal = (
        _integer(fields[name], f"network.next_object.{name}") for name in ("count", "size", "goal")
    )
    return NextObject(count, size, goal, _number(fields["within"], "network.next_object.within"))


def _normalization(value: Any) -> Normalization:
    fields = _fields(value, "normalization", Normalization)
    keys = [_text(x, "normalization.keys") for x in _list(fields["keys"], "normalization.keys")]
    if len(set(keys)) != len(keys):
        raise InvalidHeader(f"normalization.keys is {keys}, should not repeat a key")
    epsilon, clip = (_number(fields[x], f"normalization.{x}") for x in ("epsilon", "clip"))
    if epsilon <= 0 or clip <= 0:
        raise InvalidHeader(
            f"normalization has epsilon {epsilon} and clip {clip}, should be above 0"
        )
    return Normalization(keys, epsilon, clip)


def _success(value: Any) -> Success:
    fields = _fields(value, "success", Success)
    rate = _number(fields["rate"], "success.rate")
    if not 0 <= rate <= 1:
        raise InvalidHeader(f"success.rate is {rate}, should be from 0 to 1")
    return Success(
        _integer(fields["episodes"], "success.episodes"),
        rate,
        _optional(fields["fidelity"], lambda text: _text(text, "success.fidelity")),
        _integer(fields["seed"], "success.seed"),
    )


def _fields(value: Any, name: str, kind: Any) -> dict[str, Any]:
    """A mapping with exactly the fields of a dataclass; those with a default may be missing."""
    expected = list(kind.__dataclass_fields__)
    defaults = {
        field.name: field.default
        for field in dataclasses.fields(kind)
        if field.default is not dataclasses.MISSING
    }
    mapping = defaults | _mapping(value, name)
    if set(mapping) != set(expected):
        differing = ", ".join(sorted(set(mapping) ^ set(expected)))
        raise InvalidHeader(
            f"{name} should have the fields {', '.join(expected)}; missing or unknown: {differing}"
        )
    return mapping


def _mapping(value: Any, name: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InvalidHeader(f"{name} is {value!r:.80}, should be a mapping")
    return value


def _list(value: Any, name: str) -> list[Any]:
    if not isinstance(value, list):
        raise InvalidHeader(f"{name} is {value!r:.80}, should be a list")
    return value


def _integers(value: Any, name: str) -> list[int]:
    return [_integer(number, name) for number in _list(value, name)]


def _integer(value: Any, name: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**63:
        raise InvalidHeader(f"{name} is {value!r:.80}, should be an integer of at least 0")
    return value


def _number(value: Any, name: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or abs(value) > 1e300:
        raise InvalidHeader(f"{name} is {value!r:.80}, should be a finite number")
    return float(value)


def _text(value: Any, name: str) -> str:
    if not isinstance(value, str):
        raise InvalidHeader(f"{name} is {value!r:.80}, should be text")
    return value


def _one_of(value: Any, name: str, known: tuple[str, ...]) -> str:
    if value not in known:
        raise InvalidHeader(f"{name} is {value!r:.80}, should be {' or '.join(known)}")
    return str(value)


def _optional(value: Any, read: Callable[[Any], Any]) -> Any:
    return None if value is None else read(value)


def reject_constant(name: str) -> None:
    """For JSON's reader, which would accept NaN and infinity."""
    raise InvalidHeader(f"the header has the number {name}, should have finite numbers")

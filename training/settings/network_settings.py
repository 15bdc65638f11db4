"""Rules for the settings of networks, `policy_kwargs` of a settings file."""

from contextlib import suppress
from typing import Any

from training.settings.components import SLICE
from training.settings.settings import (
    InvalidValue,
    boolean,
    choice,
    integer,
    list_of,
    mapping,
    number,
)

MOST_FILTERS = 1024
"""Largest number of maps, width and stride of a convolution: more than two cores can train."""


def layer_widths(value: Any) -> list[int]:
    """Widths of the hidden layers, as in [64, 64]."""
    try:
        return list(list_of(integer(1))(value))
    except InvalidValue:
        raise InvalidValue("a list of layer widths, as in [64, 64]") from None


def number_or_numbers(value: Any) -> float | list[float]:
    """A finite number, or a list of them, as in [-1.9, -1.0]."""
    try:
        if isinstance(value, list) and value:
            return [number()(entry) for entry in value]
        return float(number()(value))
    except InvalidValue as error:
        raise InvalidValue(f"{error}, or a list of numbers, as in [-1.9, -1.0]") from None


def positive_numbers(value: Any) -> list[float]:
    """One or more numbers above 0, as in [0.1, 0.01]."""
    try:
        numbers = list(list_of(number(above=0))(value))
    except InvalidValue:
        numbers = []
    if not numbers:
        raise InvalidValue("a list of one or more numbers above 0, as in [0.1, 0.01]")
    return numbers


def indices(value: Any) -> list[int | str]:
    """Indices or slices, as in [0, 1, -1, "3:9:2"]; numbers below 0 count from the end."""
    if not isinstance(value, list) or not all(
        type(entry) is int or (isinstance(entry, str) and SLICE.fullmatch(entry)) for entry in value
    ):
        raise InvalidValue('a list of indices, as in [0, 1, -1], or slices, as in ["3:9:2"]')
    return value


def index_pairs(value: Any) -> list[list[int]]:
    """Pairs of indices, as in [[8, 0], [9, 1]]."""
    pairs = value if isinstance(value, list) else [[]]
    if not all(
        isinstance(pair, list) and len(pair) == 2 and all(type(one) is int for one in pair)
        for pair in pairs
    ):
        raise InvalidValue("a list of pairs of indices, as in [[8, 0], [9, 1]]")
    return pairs


def next_object(value: Any) -> dict[str, Any]:
    """What is observed of each of two or more objects, and how far from its goal each may be."""
    each = mapping({"components": indices, "differences": index_pairs})
    found: dict[str, Any] = {}
    with suppress(InvalidValue):
        found = mapping({"within": number(above=0), "objects": list_of(each)})(value)
    if len(found.get("objects", ())) < 2 or "within" not in found:
        raise InvalidValue(
            "what is observed of each of two or more objects in order, and within what distance "
            "from its goal one is at it, as in {within: 0.04, objects: [{components: [13]}, "
            "{components: [25], differences: []}]}"
        )
    return found


def mirror_list(value: Any) -> list[dict[str, list[Any]]]:
    """What changes in mirrors: components that change sign, and pairs that change places."""

    def entries(one: Any) -> list[Any]:
        listed = list(list_of(lambda entry: entry)(one))
        index_pairs([entry for entry in listed if isinstance(entry, list)])
        indices([entry for entry in listed if not isinstance(entry, list)])
        return listed

    keys = mapping(dict.fromkeys(("observation", "goal", "actions"), entries))
    try:
        return list(list_of(keys)(value))
    except InvalidValue as error:
        raise InvalidValue(
            "a list of what changes in each mirror, components that change sign and pairs that "
            f"change places, as in [{{observation: [0, [3, 4]], actions: [0]}}]: {error}"
        ) from None


def filter_list(value: Any) -> list[list[int]]:
    """Outputs, kernel width and stride of convolutions, as in [[16, 5, 3], [16, 3, 1]]."""
    try:
        filters = list(list_of(list_of(integer(1)))(value))
    except InvalidValue:
        filters = [[]]
    if any(len(one) != 3 or max(one) > MOST_FILTERS for one in filters):
        raise InvalidValue(
            "a list of [outputs, kernel width, stride] of convolutions, as in [[16, 5, 3]], up to "
            f"{MOST_FILTERS} each"
        )
    return filters


NETWORK_RULES = {
    "net_arch": layer_widths,
    "activation": choice("tanh", "relu", "elu"),
    "log_std_init": number_or_numbers,
}
BOUNDED_RULES = {"min_std": number(at_least=0), "state_dependent_std": boolean}
"""Further ones, of policies with a bounded mean."""
SYMLOG_RULES = {
    "differences": index_pairs,
    "components": indices,
    "units": positive_numbers,
    "next_object": next_object,
}
"""Further ones, of policies with features on a logarithmic scale, in actor or critic."""
MIRROR_RULES = {"mirrors": mirror_list}
"""Further ones, of policies that are equivariant under reflections."""
PIXEL_RULES = {"filters": filter_list, "keypoints": integer(1, MOST_FILTERS)}
"""Further ones, of policies that act from pixels."""
POLICY_RULES = NETWORK_RULES | BOUNDED_RULES | SYMLOG_RULES | MIRROR_RULES | PIXEL_RULES

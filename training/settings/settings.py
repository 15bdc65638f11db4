"""Rules for single values of a settings file: each returns the checked value or raises an error."""

import dataclasses
import math
import sys
from collections.abc import Callable, Mapping
from typing import Any

from training.settings.errors import nearest

Rule = Callable[[Any], Any]
"""Takes a value as YAML parsed it and returns the setting, or raises `InvalidValue`."""


class InvalidValue(ValueError):
    """A rule rejects a value; the message describes valid values and completes "should be"."""


def setting(rule: Rule, default: Any = dataclasses.MISSING) -> Any:
    """A dataclass field whose value must satisfy `rule`; mutable defaults are copied."""
    if isinstance(default, dict):
        return dataclasses.field(default_factory=default.copy, metadata={"rule": rule})
    return dataclasses.field(default=default, metadata={"rule": rule})


def integer(at_least: int, at_most: float = math.inf) -> Rule:
    """An integer within bounds; 1e6, which YAML parses as a float, is accepted."""
    limit = "" if at_most == math.inf else f" and at most {at_most}"

    def check(value: Any) -> int:
        whole = _is_number(value) and float(value).is_integer()
        if not whole or not at_least <= value <= at_most:
            raise InvalidValue(f"an integer of at least {at_least}{limit}")
        return int(value)

    return check


def count_or_all(value: Any) -> int:
    """An integer of at least 1, or -1 for as many as there are."""
    if value == -1:
        return -1
    try:
        return int(integer(1)(value))
    except InvalidValue as error:
        raise InvalidValue(f"{error}, or -1") from None


def number(
    above: float = -math.inf, at_least: float = -math.inf, at_most: float = math.inf
) -> Rule:
    """A finite number within the bounds."""
    bounds = [
        f"{word} {bound:g}"
        for word, bound in (("above", above), ("of at least", at_least), ("at most", at_most))
        if math.isfinite(bound)
    ]

    def check(value: Any) -> float:
        valid = _is_number(value) and above < value and at_least <= value <= at_most
        if not valid:
            hint = " (YAML parses 3e-4 as text: write 3.0e-4)" if _looks_like_number(value) else ""
            raise InvalidValue(" ".join(["a number", " and ".join(bounds)]).strip() + hint)
        return float(value)

    return check


def schedule(at_least: float = 0.0) -> Rule:
    """A positive number, or "lin_3e-4": a value that falls linearly from 3e-4 to zero."""
    positive = number(above=at_least)

    def check(value: Any) -> float | str:
        if isinstance(value, str) and value.startswith("lin_"):
            try:
                positive(float(value.removeprefix("lin_")))
            except ValueError:
                raise InvalidValue('"lin_" and a number above 0, as in "lin_3e-4"') from None
            return value
        try:
            return float(positive(value))
        except InvalidValue as error:
            raise InvalidValue(f'{error}, or as in "lin_3e-4"') from None

    return check


def entropy_coefficient(value: Any) -> float | str:
    """A number of at least 0; or "auto" or "auto_0.1" to learn it, the latter starting at 0.1."""
    if value == "auto":
        return "auto"
    start = value[5:] if isinstance(value, str) and value.startswith("auto_") else ""
    if _looks_like_number(start) and float(start) > 0.0:
        return str(value)
    try:
        return float(number(at_least=0.0)(value))
    except InvalidValue as error:
        raise InvalidValue(f'{error}, "auto", or as in "auto_0.1"') from None


def boolean(value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise InvalidValue("true or false")
    return value


def text(value: Any) -> str:
    """Text that is not empty."""
    if not isinstance(value, str) or not value:
        raise InvalidValue("text")
    return value


def choice(*options: str) -> Rule:
    """One of the options."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in options:
            hint = f"; did you mean {nearest(value, options)!r}?" if isinstance(value, str) else ""
            raise InvalidValue(f"one of {', '.join(options)}{hint}")
        return value

    return check


def optional(rule: Rule) -> Rule:
    """A value that `rule` accepts, or null."""

    def check(value: Any) -> Any:
        if value is None:
            return None
        try:
            return rule(value)
        except InvalidValue as error:
            raise InvalidValue(f"{error}, or null") from None

    return check


def true_false_or(keys: Mapping[str, Rule]) -> Rule:
    """true, false, or a mapping with these keys."""

    def check(value: Any) -> Any:
        if isinstance(value, bool):
            return value
        if isinstance(value, dict):
            return mapping(keys)(value)
        raise InvalidValue(f"true, false, or a mapping of {', '.join(keys)}")

    return check


def list_of(rule: Rule) -> Rule:
    """A list, each entry under the rule."""

    def check(value: Any) -> list[Any]:
        if not isinstance(value, list):
            raise InvalidValue("a list")
        return [rule(entry) for entry in value]

    return check


def mapping(keys: Mapping[str, Rule] | None = None) -> Rule:
    """A mapping with text keys; with `keys`, only those are valid, each value under its rule."""

    def check(value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise InvalidValue("a mapping, as in {key: value}")
        for key in value:
            if not isinstance(key, str):
                raise InvalidValue(f"a mapping whose keys are text, not {key!r}")
            if keys is not None and key not in keys:
                raise InvalidValue(
                    f"a mapping of {', '.join(keys)}; "
                    f"did you mean {nearest(key, keys)!r} instead of {key!r}?"
                )
        if keys is None:
            return dict(value)
        return {key: _check_entry(key, keys[key], entry) for key, entry in value.items()}

    return check


def wrapper_list(*names: str) -> Rule:
    """NAME, {NAME: {argument: value}} or a list of either: rl-baselines3-zoo's wrapper syntax."""

    def check(value: Any) -> Any:
        for entry in value if isinstance(value, list) else [value]:
            one = {entry: {}} if isinstance(entry, str) else entry
            if not isinstance(one, dict) or len(one) != 1:
                raise InvalidValue("NAME, {NAME: {argument: value}} or a list of either")
            for name, arguments in one.items():
                choice(*names)(name)
                _check_entry(name, mapping(), arguments)
        return value

    return check


def parse_wrappers(value: Any) -> list[tuple[str, dict[str, Any]]]:
    """Names and arguments from a value that `wrapper_list` accepts, in order; [] for None."""
    if value is None:
        return []
    entries = value if isinstance(value, list) else [value]
    return [(one, {}) if isinstance(one, str) else next(iter(one.items())) for one in entries]


def _check_entry(key: str, rule: Rule, value: Any) -> Any:
    try:
        return rule(value)
    except InvalidValue as error:
        raise InvalidValue(f"a mapping in which {key} is {error}") from None


def _is_number(value: Any) -> bool:
    """True for a finite int or float; False for a bool and for integers too large for a float."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) <= sys.float_info.max


def _looks_like_number(value: Any) -> bool:
    if not isinstance(value, str):
        return False
    try:
        return math.isfinite(float(value))
    except ValueError:
        return False

"""What a value in a configuration file may be: rules that read it or say what would be right."""

import dataclasses
import math
import sys
from collections.abc import Callable, Mapping
from typing import Any

from training.settings.errors import nearest

Rule = Callable[[Any], Any]
"""Takes the value as YAML gave it, returns it as the setting, or raises `Unfit`."""


class Unfit(ValueError):
    """A value that a rule does not accept; the message says what would be right."""


def setting(rule: Rule, default: Any = dataclasses.MISSING) -> Any:
    """A dataclass field whose value must satisfy `rule`; mutable defaults are copied."""
    if isinstance(default, dict):
        return dataclasses.field(default_factory=default.copy, metadata={"rule": rule})
    return dataclasses.field(default=default, metadata={"rule": rule})


def integer(at_least: int) -> Rule:
    """An integer of at least `at_least`; 1e6, which YAML reads as a float, counts as one."""

    def read(value: Any) -> int:
        whole = _is_number(value) and float(value).is_integer()
        if not whole or value < at_least:
            raise Unfit(f"an integer of at least {at_least}")
        return int(value)

    return read


def number(
    above: float = -math.inf, at_least: float = -math.inf, at_most: float = math.inf
) -> Rule:
    """A finite number within the bounds."""
    bounds = [
        f"{word} {bound:g}"
        for word, bound in (("above", above), ("at least", at_least), ("at most", at_most))
        if math.isfinite(bound)
    ]

    def read(value: Any) -> float:
        fits = _is_number(value) and above < value and at_least <= value <= at_most
        if not fits:
            hint = " (YAML reads 3e-4 as text: write 3.0e-4)" if _looks_like_number(value) else ""
            raise Unfit(" ".join(["a number", " and ".join(bounds)]).strip() + hint)
        return float(value)

    return read


def schedule(at_least: float = 0.0) -> Rule:
    """A positive number, or "lin_3e-4": the same number falling linearly to zero."""
    positive = number(above=at_least)

    def read(value: Any) -> float | str:
        if isinstance(value, str) and value.startswith("lin_"):
            try:
                positive(float(value.removeprefix("lin_")))
            except ValueError:
                raise Unfit('"lin_" and a number above 0, as in "lin_3e-4"') from None
            return value
        try:
            return float(positive(value))
        except Unfit as error:
            raise Unfit(f'{error}, or as in "lin_3e-4"') from None

    return read


def entropy_coefficient(value: Any) -> float | str:
    """A number of at least 0, or "auto" or "auto_0.1" (learned, from that start)."""
    if value == "auto":
        return "auto"
    if isinstance(value, str) and value.startswith("auto_") and _looks_like_number(value[5:]):
        return value
    try:
        return float(number(at_least=0.0)(value))
    except Unfit as error:
        raise Unfit(f'{error}, "auto", or as in "auto_0.1"') from None


def flag(value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise Unfit("true or false")
    return value


def choice(*options: str) -> Rule:
    """One of the options."""

    def read(value: Any) -> str:
        if not isinstance(value, str) or value not in options:
            hint = f"; did you mean {nearest(value, options)!r}?" if isinstance(value, str) else ""
            raise Unfit(f"one of {', '.join(options)}{hint}")
        return value

    return read


def optional(rule: Rule) -> Rule:
    """What `rule` accepts, or null."""

    def read(value: Any) -> Any:
        if value is None:
            return None
        try:
            return rule(value)
        except Unfit as error:
            raise Unfit(f"{error}, or null") from None

    return read


def widths(value: Any) -> list[int]:
    """Sizes of hidden layers, as in [64, 64]."""
    try:
        return [integer(1)(width) for width in _expect(list, value)]
    except Unfit:
        raise Unfit("a list of layer widths, as in [64, 64]") from None


def mapping(keys: Mapping[str, Rule] | None = None) -> Rule:
    """A mapping with text keys; given `keys`, only those, each under its own rule."""

    def read(value: Any) -> dict[str, Any]:
        entries = _expect(dict, value)
        for key in entries:
            if not isinstance(key, str):
                raise Unfit(f"a mapping whose keys are text, not {key!r}")
            if keys is not None and key not in keys:
                raise Unfit(
                    f"a mapping of {', '.join(keys)}; "
                    f"did you mean {nearest(key, keys)!r} for {key!r}?"
                )
        if keys is None:
            return dict(entries)
        return {key: _nested(key, keys[key], entry) for key, entry in entries.items()}

    return read


def named_calls(*names: str) -> Rule:
    """A name, {name: {argument: value}} or a list of either, as the zoo writes wrappers."""

    def read(value: Any) -> Any:
        for entry in value if isinstance(value, list) else [value]:
            one = {entry: {}} if isinstance(entry, str) else entry
            if not isinstance(one, dict) or len(one) != 1:
                raise Unfit("NAME, {NAME: {argument: value}} or a list of either")
            for name, arguments in one.items():
                choice(*names)(name)
                _nested(name, mapping(), arguments)
        return value

    return read


def calls_of(value: Any) -> list[tuple[str, dict[str, Any]]]:
    """Names and arguments of what `named_calls` accepts, in order; none of None."""
    if value is None:
        return []
    entries = value if isinstance(value, list) else [value]
    return [(one, {}) if isinstance(one, str) else next(iter(one.items())) for one in entries]


def _nested(key: str, rule: Rule, value: Any) -> Any:
    try:
        return rule(value)
    except Unfit as error:
        raise Unfit(f"{key} to be {error}") from None


def _expect(kind: type, value: Any) -> Any:
    if not isinstance(value, kind):
        raise Unfit("a mapping, as in {key: value}" if kind is dict else "a list")
    return value


def _is_number(value: Any) -> bool:
    """True for a finite int or float; a bool is no number, nor is what no float can hold."""
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

"""Scenes and fidelities as JSON text: to attach to an issue, and to replay.

    {"format": "rigid-envs scene", "version": 1, "value": {"type": "Scene", "bodies": [...], ...}}

Every object is written with the name of its class and its fields; numbers keep all their bits. What
is read is checked as if it were built by hand. A field that is missing has its default, so a text
stays valid when a class gets new fields; an unknown one is an error. Nothing in a text is executed.
"""

import json
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any

VERSION = 1


def write(value: Any, what: str) -> str:
    """JSON text of a dataclass; `what` is "scene" or "fidelity"."""
    document = {"format": f"rigid-envs {what}", "version": VERSION, "value": _plain(value)}
    return json.dumps(document, indent=1, allow_nan=False)


def _plain(value: Any) -> Any:
    """A value as dicts, lists, numbers and texts."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if not is_dataclass(value):
        return value
    written = {f.name: getattr(value, f.name) for f in fields(value)}
    if written.get("density") is not None:  # a Body takes its mass or its density
        written.pop("mass", None)
    return {"type": type(value).__name__, **{k: _plain(v) for k, v in written.items()}}


def read(text: str, what: str, classes: Sequence[type]) -> Any:
    """The value of a text that `write` wrote.

    Args:
        text: JSON.
        what: "scene" or "fidelity".
        classes: of the objects that it may contain; the first is that of the value.

    Raises:
        TypeError: not a text.
        ValueError: no JSON, not this format, a newer version, or a bad value; the message names the
            place, such as scene.bodies[0].mass.
    """
    if not isinstance(text, str):
        raise TypeError(f"{what} must be JSON text, got {text!r} ({type(text).__name__})")
    try:
        document = json.loads(text, parse_constant=_refuse)
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{what} must be JSON text: {error}") from None
    expected = f"rigid-envs {what}"
    found = document.get("format") if isinstance(document, dict) else None
    if found != expected:
        raise ValueError(f"{what} must have the format {expected!r}, got {found!r}")
    version = document.get("version")
    if version != VERSION:
        raise ValueError(
            f"{what} must have version {VERSION}, which this code reads, got {version!r}"
        )
    value = _built(document.get("value"), what, {c.__name__: c for c in classes})
    if type(value) is not classes[0]:
        raise ValueError(f"{what} must hold a {classes[0].__name__}, got {type(value).__name__}")
    return value


def _refuse(name: str) -> float:
    raise ValueError(f"numbers must be finite, got {name}")


def _built(value: Any, place: str, classes: dict[str, type]) -> Any:
    """The object that a plain value describes; `place` names it in messages."""
    if isinstance(value, list):
        return tuple(_built(item, f"{place}[{i}]", classes) for i, item in enumerate(value))
    if not isinstance(value, dict):
        return value
    kind = value.get("type")
    if not isinstance(kind, str) or kind not in classes:
        raise ValueError(f"{place}.type must be one of {sorted(classes)}, got {kind!r}")
    known = [f.name for f in fields(classes[kind])]
    arguments = {}
    for name, item in value.items():
        if name == "type":
            continue
        if name not in known:
            raise ValueError(f"{place}: {kind} has no field {name!r}; it has: {', '.join(known)}")
        arguments[name] = _built(item, f"{place}.{name}", classes)
    try:
        return classes[kind](**arguments)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{place}: {error}") from None

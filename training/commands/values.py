"""Values of command-line flags: each function parses a text or raises an error for argparse."""

import argparse
from contextlib import suppress


def count(text: str) -> int:
    """Parses an integer of at least 1; 1e6 and 1_000_000 are valid."""
    return _integer(text, 1)


def whole(text: str) -> int:
    """Parses an integer of at least 0."""
    return _integer(text, 0)


def port(text: str) -> int:
    """Parses a port: an integer from 0, for a free one, to 65535."""
    value = _integer(text, 0)
    if value > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} should be a port, at most 65535")
    return value


def positive(text: str) -> float:
    """Parses a finite number above 0."""
    with suppress(ValueError):
        value = float(text)
        if 0.0 < value < float("inf"):
            return value
    raise argparse.ArgumentTypeError(f"{text!r} should be a finite number above 0")


def _integer(text: str, least: int) -> int:
    with suppress(ValueError):
        value = float(text)
        if value >= least and value.is_integer():
            return int(value)
    raise argparse.ArgumentTypeError(f"{text!r} should be an integer of at least {least}")

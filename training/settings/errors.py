"""Mistakes of the user, reported in one line."""

import difflib
from collections.abc import Iterable
from pathlib import Path


class UsageError(ValueError):
    """The request cannot be carried out; the message says how to correct it.

    The command line prints the message without a traceback. Any other exception is a bug of this
    project.
    """


def nearest(name: str, valid: Iterable[str]) -> str:
    """The valid name most similar to `name`, ignoring case, for "did you mean"."""
    names = list(valid)
    lower = [valid_name.lower() for valid_name in names]
    return names[lower.index(difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.0)[0])]


def one_of(name: str, valid: Iterable[str]) -> str:
    """What to say of a name that is none of a few valid ones: one that it may be a slip of, or all.

    An algorithm that isn't there is no slip of another one.
    """
    names = list(valid)
    if difflib.get_close_matches(name.lower(), names, n=1):
        return f"did you mean {nearest(name, names)!r}?"
    return f"there are {' and '.join(names)}"


def check_exists(path: Path, expected: str) -> None:
    """Raises UsageError if there is nothing at `path`; all commands use this wording.

    Args:
        path: A file or folder that the user named.
        expected: What should be there, as in "a run folder".
    """
    if not path.exists():
        raise UsageError(f"{path} does not exist; it should be {expected}")

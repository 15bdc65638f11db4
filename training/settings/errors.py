"""Mistakes of the user, told in one line."""

import difflib
from collections.abc import Iterable


class UsageError(ValueError):
    """What the user asked for cannot be done; the message says what would be right.

    The command line prints it without a traceback. Any other exception is a defect of ours.
    """


def nearest(word: str, valid: Iterable[str]) -> str:
    """The valid name most like `word`, in whatever case, for "did you mean"."""
    names = list(valid)
    lower = [name.lower() for name in names]
    return names[lower.index(difflib.get_close_matches(word.lower(), lower, n=1, cutoff=0.0)[0])]

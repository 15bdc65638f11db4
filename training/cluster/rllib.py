"""What RLlib, Ray's library of learning algorithms, needs of other packages."""

import re
from importlib import metadata

from training.settings.errors import UsageError

INSTALL = 'pip install -c constraints-ray.txt -e ".[ray]"'


def check_gymnasium() -> None:
    """Raises UsageError if RLlib is missing, or needs another version of Gymnasium.

    RLlib pins one version, and fails with others in the middle of a run.
    """
    try:
        ray = metadata.version("ray")
    except metadata.PackageNotFoundError:
        raise UsageError(f"RLlib requires ray; to install: {INSTALL}") from None
    installed = metadata.version("gymnasium")
    for requirement in metadata.requires("ray") or ():
        pinned = re.match(r'gymnasium *==([\w.]+) *;.*extra == "rllib"', requirement)
        if pinned and pinned[1] != installed:
            raise UsageError(
                f"gymnasium is {installed}, but RLlib of ray {ray} needs {pinned[1]}; "
                f"to install: {INSTALL}"
            )

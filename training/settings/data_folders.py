"""Where data files stand: in the package if it is installed, else in the source tree."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def data_folder(installed: str, source: str) -> Path:
    """A folder of the installed package `training`, or of the source tree.

    importlib.resources cannot read a folder without code from an editable install.

    Args:
        installed: name of the folder in the package.
        source: name of the folder at the top of the source tree.
    """
    own = _PACKAGE / installed
    return own if own.is_dir() else _PACKAGE.parent / source

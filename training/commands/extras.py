"""The packages of each optional extra, and an error that names the extra to install."""

import importlib.util
from collections.abc import Sequence

from training.settings.errors import UsageError

TRAIN_EXTRA = (
    "stable_baselines3",
    "torch",
    "yaml",
    "rich",
    "tensorboard",
    "matplotlib",
    "imageio",
    "imageio_ffmpeg",
    "PIL",
)
RENDER_EXTRA = ("pygame",)
VIEW_EXTRA = ("viser",)
TUNE_EXTRA = (*TRAIN_EXTRA, "optuna")
RAY_EXTRA = (*TRAIN_EXTRA, "ray")
DATA_EXTRA = (*TRAIN_EXTRA, "minari", "h5py")


def require(extra: str, modules: Sequence[str]) -> None:
    """Raises UsageError if a module is not installed.

    Args:
        extra: The extra of the project that installs the modules.
        modules: Names of the modules that the command imports.
    """
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        how = f'pip install -c constraints.txt -e ".[{extra}]"'
        if extra == "ray":  # its Gymnasium is another one
            how = 'pip install -c constraints-ray.txt -e ".[ray,tune]"'
            how += ", into a virtual environment of its own"
        raise UsageError(
            f"this command requires {', '.join(missing)}; to install, in a clone: {how}"
        )

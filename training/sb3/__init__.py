"""Training with Stable-Baselines3: adapter, callbacks, checkpoints."""

from importlib.util import find_spec

if find_spec("stable_baselines3") is None:
    raise ModuleNotFoundError(
        "training.sb3 requires stable-baselines3; to install, in a clone: "
        'pip install -c constraints.txt -e ".[train]"',
        name="stable_baselines3",
    )

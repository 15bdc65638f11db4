"""Controllers that solve a task by reading only the observation: proof that physics allows it.

Each decides from the present alone, so that it goes on from any state.
"""

from collections.abc import Callable

import numpy as np

from training.scripted.push import push
from training.scripted.stack import stack
from training.scripted.throw import throw

Array = np.ndarray

Controller = Callable[[dict[str, Array]], Array]
"""Takes observations `{key: (n, k)}` and returns actions `(n, action_dim)` within ±1."""

CONTROLLERS: dict[str, Controller] = {
    "RigidEnvs/Push-v0": push,
    "RigidEnvs/Stack-v0": stack,
    "RigidEnvs/Throw-v0": throw,
}
"""Controller of each environment id."""

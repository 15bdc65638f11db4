"""Scripted controllers: they solve a task from the observation alone.

They show that a task is solvable. Each step depends on the current observation only, so a
controller can take over in any state.
"""

from collections.abc import Callable

import numpy as np

from training.scripted.pick_and_place import pick_and_place
from training.scripted.push import push
from training.scripted.push_t import push_t
from training.scripted.reach import reach
from training.scripted.slide import slide
from training.scripted.stack import stack
from training.scripted.throw import throw
from training.settings.environments import task_of
from training.settings.errors import UsageError

Array = np.ndarray

Controller = Callable[[dict[str, Array]], Array]
"""Takes observations `{key: [n, k]}` and returns actions [n, action_dim] within ±1."""

CONTROLLERS: dict[str, Controller] = {
    "pick_and_place": pick_and_place,
    "push": push,
    "push_t": push_t,
    "reach": reach,
    "slide": slide,
    "stack": stack,
    "throw": throw,
}
"""Controllers by task: all environment ids of a task have the same one."""


def controller_for(env_id: str) -> Controller:
    """The controller of an environment's task.

    Raises:
        UsageError: The id is unknown, or its task has no controller.
    """
    task = task_of(env_id)
    if task not in CONTROLLERS:
        raise UsageError(
            f"no scripted controller for environment {env_id!r}; "
            f"there are controllers for the tasks {', '.join(CONTROLLERS)}"
        )
    return CONTROLLERS[task]

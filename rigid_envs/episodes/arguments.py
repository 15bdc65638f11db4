"""What gym.make and gym.make_vec hand on: a task with its arguments, and where a word belongs."""

import inspect
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

from physics.scene.validation import choice
from rigid_envs.tasks import TASKS, Task

# words of one kind of environment, or of what makes it, that the other doesn't have
OF_VECTORS = (
    "num_envs",
    "render_worlds",
    "autoreset_mode",
    "threads",
    "vectorization_mode",
    "vector_kwargs",
    "wrappers",
)
OF_SINGLES = ("disable_env_checker",)
_BELONGS = {
    **dict.fromkeys(
        OF_VECTORS,
        "belongs to native vector environments: give it to gym.make_vec, and to no single one",
    ),
    **dict.fromkeys(OF_SINGLES, "belongs to single environments: give it to gym.make alone"),
}


def make_task(task: Any, arguments: dict[str, Any], others: Iterable[str]) -> Task:
    """A task from its name or class, and arguments; or the task itself.

    Args:
        task: a task's name or class, or a task.
        arguments: of its constructor; none for a task that is made already.
        others: what whoever calls takes beside them.

    Raises:
        TypeError: an argument that the task hasn't; the message says whose it is, or what is near.
        ValueError: no such task, or whatever its constructor refuses.
    """
    known: list[str] = []
    if not isinstance(task, Task):
        if not (isinstance(task, type) and issubclass(task, Task)):
            task = TASKS[choice("task", task, TASKS)]
        known = list(inspect.signature(task).parameters)
    name = (task if isinstance(task, type) else type(task)).__name__
    for argument in arguments:
        if argument in known:
            continue
        if argument in _BELONGS:
            raise TypeError(f"argument {argument!r} {_BELONGS[argument]}")
        near = get_close_matches(argument, [*known, *others], 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise TypeError(
            f"unknown argument {argument!r}: of its own, {name} has {known or 'none'}{hint}"
        )
    return task if isinstance(task, Task) else task(**arguments)


def words(kind: type) -> list[str]:
    """Names of the arguments that a class's constructor spells out."""
    spread = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return [n for n, p in inspect.signature(kind).parameters.items() if p.kind not in spread]

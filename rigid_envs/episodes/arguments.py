"""Builds a task from the arguments of `gym.make` or `gym.make_vec`, and explains unknown ones."""

import inspect
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

from physics.scene.validation import choice
from rigid_envs.catalog import NAMED_TASKS
from rigid_envs.tasks import Task

# arguments of one kind of environment, or of the Gymnasium function that makes it, that the other
# kind does not have
VECTOR_ARGUMENTS = (
    "num_envs",
    "render_worlds",
    "autoreset_mode",
    "threads",
    "vectorization_mode",
    "vector_kwargs",
    "wrappers",
)
SINGLE_ARGUMENTS = ("disable_env_checker",)
_WHERE = {
    **dict.fromkeys(
        VECTOR_ARGUMENTS,
        "belongs to native vector environments: pass it to gym.make_vec, not to gym.make",
    ),
    **dict.fromkeys(
        SINGLE_ARGUMENTS,
        "belongs to single environments: pass it to gym.make, not to gym.make_vec",
    ),
}


def make_task(task: Any, arguments: dict[str, Any], others: Iterable[str]) -> Task:
    """A task from its name or class and its arguments; a Task object is returned as it is.

    Args:
        task: name, class or object of a task.
        arguments: arguments of the task's constructor; must be empty for a Task object.
        others: names of the arguments that the caller has besides those of the task.

    Raises:
        TypeError: the task does not have one of the arguments. The message says where the argument
            belongs, or which known argument is spelled like it.
        ValueError: there is no such task, or its constructor raised this error.
    """
    known: list[str] = []
    others = list(others)
    if not isinstance(task, Task):
        if not (isinstance(task, type) and issubclass(task, Task)):
            task = NAMED_TASKS[choice("task", task, NAMED_TASKS)]
        known = list(inspect.signature(task).parameters)
    name = (task if isinstance(task, type) else type(task)).__name__
    for argument in arguments:
        if argument in known:
            continue
        if argument in _WHERE:
            raise TypeError(f"argument {argument!r} {_WHERE[argument]}")
        near = get_close_matches(argument, [*known, *others], 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        owners = [one.__name__ for one in NAMED_TASKS.values() if argument in argument_names(one)]
        if owners and name not in owners:
            hint = f"it belongs to {' and '.join(owners)}; "
        accepted = f"{name} accepts {known or 'no arguments of its own'}"
        if others:
            accepted += f", every task accepts {sorted(others)}"
        if isinstance(task, Task):
            accepted = f"task is a {name} object, which accepts no further arguments"
        raise TypeError(f"unknown argument {argument!r}: {hint}{accepted}")
    return task if isinstance(task, Task) else task(**arguments)


def argument_names(kind: type) -> list[str]:
    """Names of the arguments in the signature of a class's constructor, without *args, **kwargs."""
    variable = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return [n for n, p in inspect.signature(kind).parameters.items() if p.kind not in variable]

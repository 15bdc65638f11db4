"""What a task of one's own gives is looked at, so that mistakes are told where they are.

The shape of its goals always, which costs little; the rest at the first observation. Values of
goals and terms are taken as they are.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rigid_envs.tasks import Task
from rigid_envs.tasks.rewards import GOALS_OF_TERMS, OF_GOALS

Array = np.ndarray

TAKEN = (*OF_GOALS, GOALS_OF_TERMS, "is_success", "out_of_bounds")


def check_goals(task: Task, what: str, goals: Any, count: int) -> Array:
    """Goals [count, goal] as one of a task's methods returns them.

    Raises:
        ValueError: another shape.
    """
    shape = (count, len(task.goal_bounds))
    if np.shape(goals) != shape:
        raise ValueError(
            f"{_method(task, what)} must return goals of shape {shape}, one row a world and one "
            f"column for each of goal_bounds, got {_seen(goals)}"
        )
    return np.asarray(goals)


def check_written(task: Task, what: str, bounds: Sequence[Any], values: Array) -> None:
    """Raises ValueError where a task has left anything of an array [count, n] unwritten."""
    names = [bound[0] for bound in bounds]
    left = [name for name, gap in zip(names, np.isnan(values).any(axis=0), strict=True) if gap]
    if left:
        raise ValueError(f"{_method(task, what)} must write all of out, it has left {left}")


def check_terms(task: Task, terms: Any, count: int) -> None:
    """Raises ValueError for terms that aren't arrays [count] by name, or other than they should be.

    They have every term that the reward weighs, whatever the reward's type, and none of a name that
    the info or the reward has already.
    """
    where = _method(task, "terms")
    if not isinstance(terms, Mapping):
        raise ValueError(f"{where} must return a dict of arrays [{count}], got {_seen(terms)}")
    for name, term in terms.items():
        if np.shape(term) != (count,):
            raise ValueError(
                f"{where} must return arrays of shape ({count},), one value a world, got "
                f"{_seen(term)} for {name!r}"
            )
    taken = [name for name in terms if name in TAKEN]
    if taken:
        raise ValueError(f"{where} must not return {taken}: the runner tells these itself")
    missing = [name for name in task.reward.of_task if name not in terms]
    if missing:
        raise ValueError(
            f"{where} must return every term that reward weighs, {missing} is missing from "
            f"{list(terms)}"
        )


def _method(task: Task, name: str) -> str:
    return f"{type(task).__name__}.{name}"


def _seen(value: Any) -> str:
    return f"shape {value.shape}" if isinstance(value, np.ndarray) else f"{value!r:.80}"

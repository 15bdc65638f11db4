"""Checks of what a custom task returns, so that errors name the method that caused them.

The shape of goals is checked in each step, which costs little. All other checks run once, at the
first observation. Values of goals and terms are not checked.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rigid_envs.tasks import Task
from rigid_envs.tasks.rewards import GOAL_TERMS, STEP_GOALS

Array = np.ndarray

RESERVED_TERMS = (*GOAL_TERMS, STEP_GOALS, "is_success", "out_of_bounds")


def check_goals(task: Task, method: str, goals: Any, count: int) -> Array:
    """Goals [count, goal] as returned by a method of a task.

    Raises:
        ValueError: they have another shape.
    """
    shape = (count, len(task.goal_bounds))
    if np.shape(goals) != shape:
        raise ValueError(
            f"{_name(task, method)} must return goals of shape {shape}, with one row per world and "
            f"one column per entry of goal_bounds, got {_describe(goals)}"
        )
    return np.asarray(goals)


def check_written(task: Task, method: str, bounds: Sequence[Any], values: Array) -> None:
    """Checks that a method of a task wrote all of an array [count, n] that was filled with NaN.

    Raises:
        ValueError: components are still NaN; the message names them.
    """
    names = [bound[0] for bound in bounds]
    missing = [name for name, gap in zip(names, np.isnan(values).any(axis=0), strict=True) if gap]
    if missing:
        raise ValueError(
            f"{_name(task, method)} must write all components of out; NaN is left in {missing}"
        )


def check_terms(task: Task, terms: Any, count: int) -> None:
    """Checks the reward terms of a task: a dict of arrays [count].

    The dict must contain each term that the reward weighs, whatever the reward type, and no name
    that the runner uses itself.

    Raises:
        ValueError: the terms are not as described.
    """
    where = _name(task, "terms")
    if not isinstance(terms, Mapping):
        raise ValueError(f"{where} must return a dict of arrays [{count}], got {_describe(terms)}")
    for name, term in terms.items():
        if np.shape(term) != (count,):
            raise ValueError(
                f"{where} must return arrays of shape ({count},), one value per world, got "
                f"{_describe(term)} for {name!r}"
            )
    reserved = [name for name in terms if name in RESERVED_TERMS]
    if reserved:
        raise ValueError(f"{where} must not return {reserved}: the runner adds these terms")
    missing = [name for name in task.reward.task_terms if name not in terms]
    if missing:
        raise ValueError(
            f"{where} must return all terms in reward.weights: {missing} is missing from "
            f"{list(terms)}"
        )


def _name(task: Task, method: str) -> str:
    return f"{type(task).__name__}.{method}"


def _describe(value: Any) -> str:
    return f"shape {value.shape}" if isinstance(value, np.ndarray) else f"{value!r:.80}"

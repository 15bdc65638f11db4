"""From the users' rows, one per world, to the columns of tasks and back, in one pass each.

Tasks compute with columns, where NumPy's loops run over the worlds; users expect rows. What the
runner does with every step, it does on the way: clipping, and the distance of goals.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.compiler.jit import entry
from rigid_envs.tasks.goals import Measure

Array = np.ndarray

_BLOCK = 64  # worlds; about 10 KB of rows


class Observed(NamedTuple):
    """What users and the runner take from a table of observations.

    Attributes:
        observation: [count, n], of the table's type, as all goals.
        achieved: [count, goal].
        desired: [count, goal].
        outside: [count] bool, whether any component of a world was clipped.
        goals: [count, 2 goal], achieved and desired side by side, as `rewards.join_goals`
            gives them; [0, 2 goal] if nobody asks.
        goal_distance: [count], as `goals.distance` gives it, in every bit.
    """

    observation: Array
    achieved: Array
    desired: Array
    outside: Array
    goals: Array
    goal_distance: Array


@cache
def _make_split(measure: Measure, dtype: np.dtype[Any]) -> Any:
    """Entry of `split` for tables of a type: an entry takes arguments of one layout."""

    @entry
    def split(table, low, high, goals, rows):
        count, n = rows.observation.shape
        for i in range(count):
            rows.outside[i] = False
        # a block's rows stay in the cache until its last column is written
        for start in range(0, count, _BLOCK):
            end = min(start + _BLOCK, count)
            outside = rows.outside[start:end]
            for c in range(table.shape[0]):
                column, least, most = table[c, start:end], low[c], high[c]
                beyond = 0
                for i in range(len(column)):  # without a branch; most columns need only this loop
                    beyond += (column[i] < least) | (column[i] > most)
                if beyond > 0:
                    for i in range(len(column)):
                        if column[i] < least:
                            column[i], outside[i] = least, True
                        elif column[i] > most:
                            column[i], outside[i] = most, True
                if c < n:
                    to = rows.observation[start:end, c]
                    for i in range(len(column)):
                        to[i] = column[i]
                else:
                    to, to_desired = rows.achieved[start:end, c - n], rows.desired[start:end, c - n]
                    goal = goals[c - n, start:end]
                    for i in range(len(column)):
                        to[i] = column[i]
                        to_desired[i] = goal[i]
            achieved, desired = table[n:, start:end], goals[:, start:end]
            for i in range(end - start):
                rows.goal_distance[start + i] = measure(achieved, desired, i)
            if rows.goals.shape[0] > 0:
                size = goals.shape[0]
                for i in range(end - start):
                    for c in range(size):
                        rows.goals[start + i, c] = achieved[c, i]
                        rows.goals[start + i, size + c] = desired[c, i]

    return split


def split(
    table: Array, low: Array, high: Array, goals: Array, joins: bool, measure: Measure
) -> Observed:
    """Clips a table of observations to their bounds, in place, and copies it into rows.

    NaN stays NaN.

    Args:
        table: [n + goal, count or more], C-contiguous; the achieved goals are last. It and what
            follows is float32 or float64.
        low: [n + goal].
        high: [n + goal].
        goals: [count, goal], Fortran-contiguous: the desired ones.
        joins: whether to write `Observed.goals`.
        measure: of the goal distance.
    """
    count, goal = goals.shape
    rows = Observed(
        np.empty((count, len(low) - goal), dtype=table.dtype),
        np.empty((count, goal), dtype=table.dtype),
        np.empty((count, goal), dtype=table.dtype),
        np.empty(count, dtype=bool),
        np.empty((count if joins else 0, 2 * goal), dtype=table.dtype),
        np.empty(count),
    )
    _make_split(measure, table.dtype)(table, low, high, goals.T, rows)
    return rows


@cache
def _make_clip_actions() -> Any:

    @entry
    def clip_actions(rows, clipped):
        count, n = rows.shape
        for i in range(count):
            for c in range(n):
                value = rows[i, c]
                if value != value:
                    return i * n + c
                clipped[c, i] = min(max(value, -1.0), 1.0)
        return -1

    return clip_actions


def clip_actions(actions: Array) -> tuple[Array, int]:
    """Actions [count, n], C-contiguous, clipped to [-1, 1], Fortran-contiguous.

    Also the index of the first NaN in the flattened array, or -1 if there is none; with NaN, not
    all actions are clipped.
    """
    columns = np.empty(actions.shape[::-1])
    missing = int(_make_clip_actions()(actions, columns))
    return columns.T, missing

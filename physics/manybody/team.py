"""Threads that work on one world together: how they share work, and wait for each other.

What they add up across threads are counts, or values that stand in a fixed order, so results don't
depend on their number.
"""

from typing import NamedTuple

import numpy as np

from physics.compiler.atomics import wait_for_all
from physics.compiler.jit import stage

Array = np.ndarray

# numbers that each thread writes for the others
SHARED = 16
# what they are: speed of the fastest approach in m/s, largest restitution, pairs that collide,
# pairs that a sweep has changed, work in J, bodies that are about to leave their margin, s until
# solids can touch, pairs that may touch in this substep or do so now
FASTEST, RESTITUTION, COLLIDING, CHANGED, WORK, FAR, SAFE, MEETING = range(8)
# consecutive batches that one thread takes
BATCHES = 4


class Team(NamedTuple):
    """One thread of those that work together.

    Attributes:
        barrier: [SHARED] counts arrivals.
        shared: [threads, SHARED] of all threads.
        thread: its number.
        threads: how many there are.
    """

    barrier: Array
    shared: Array
    thread: int
    threads: int


@stage
def wait(team):
    """Waits until all threads have come here."""
    wait_for_all(team.barrier, 0, team.threads)


@stage
def share(first, last, team):
    """Where this thread's part of a range begins and ends."""
    count = last - first
    return (
        first + count * team.thread // team.threads,
        first + count * (team.thread + 1) // team.threads,
    )


@stage
def takes_batch(n, team):
    """Whether the n-th batch is this thread's."""
    return n // BATCHES % team.threads == team.thread


@stage
def total(team, column):
    """Sum of what the threads have counted; all wait before and after."""
    wait(team)
    found = 0.0
    for t in range(team.threads):
        found += team.shared[t, column]
    wait(team)
    return found


@stage
def smallest(team, column):
    """The smallest of what the threads have found; all wait before and after."""
    wait(team)
    found = team.shared[0, column]
    for t in range(1, team.threads):
        found = min(found, team.shared[t, column])
    wait(team)
    return found


@stage
def largest(team, column):
    """The largest of what the threads have found; all wait before and after."""
    wait(team)
    found = 0.0
    for t in range(team.threads):
        found = max(found, team.shared[t, column])
    wait(team)
    return found

"""Trials of a search as Ray tasks. The search itself stays with the driver."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import ray
from ray.exceptions import RayError, RayTaskError

from training.cluster.connection import Demand
from training.cluster.mailbox import Caller, Switchboard
from training.results.trial import Stopped, success_of
from training.settings.config import TrainConfig
from training.settings.environments import environment_threads
from training.settings.errors import UsageError

LOSSES = 3
"""Number of trials in a row whose workers may be lost before the search ends."""
SECONDS_BETWEEN_LOOKS = 10.0
"""Time after which nodes that have joined get trials, in seconds."""


@dataclass(frozen=True)
class TrialOrder:
    """A trial to run."""

    number: int
    """Its number in the search."""
    config: TrainConfig
    """Its settings."""
    episodes: int
    """Number of episodes of the evaluation."""
    device: str
    """Torch device of the networks."""
    num_threads: int
    """Threads of torch, and of the environments."""


class Lost(Exception):
    """The worker of a trial was lost: the trial is to be repeated."""


def run_trial(order: TrialOrder, driver: Caller) -> float:
    """The success rate of a trial, see `success_of`; a Ray task."""
    with environment_threads(order.num_threads):
        return success_of(
            order.config,
            order.episodes,
            order.device,
            order.num_threads,
            lambda value, interval: bool(driver((value, interval))),
        )


def run_trials(
    ask: Callable[[], TrialOrder | None],
    report: Callable[[int, float, int], bool],
    tell: Callable[[int, float | Exception], None],
    demand: Demand,
) -> bool:
    """Runs trials on the cluster that this process is connected to, as many as its nodes can hold.

    Args:
        ask: Returns the next trial; None if no more is needed at the moment.
        report: Called with number, success rate and interval of a trial; whether to stop it.
        tell: Called with the number and the success rate of each trial that has ended, or with
            Stopped, Lost, or the error that it raised.
        demand: What a trial needs of a node.

    Returns:
        Whether Ctrl-C ended the search; trials without an outcome are then cancelled.

    Raises:
        UsageError: No node is large enough, or the workers of several trials in a row were lost.
    """
    demand.check()
    task = ray.remote(**demand.options())(run_trial)
    switchboard = Switchboard()
    running: dict[Any, int] = {}
    losses = 0
    try:
        while True:
            slots = demand.slots()
            while len(running) < slots and (order := ask()) is not None:
                running[task.remote(order, switchboard.caller(order.number))] = order.number
            if not running:
                return False
            ended = switchboard.wait(
                running, lambda number, content: report(number, *content), SECONDS_BETWEEN_LOOKS
            )
            for reference in ended:
                outcome = _outcome(reference)
                tell(running.pop(reference), outcome)
                losses = losses + 1 if isinstance(outcome, Lost) else 0
                if losses > LOSSES:
                    raise UsageError(f"{losses} trials in a row lost their workers ({outcome})")
    except KeyboardInterrupt:
        for reference in running:
            with contextlib.suppress(RayError):
                ray.cancel(reference)
        return True


def _outcome(reference: Any) -> float | Exception:
    """The success rate of a trial that has ended, or its error."""
    try:
        return float(ray.get(reference))
    except RayTaskError as error:
        if isinstance(error.cause, Stopped | ValueError):
            return error.cause
        raise
    except RayError as error:
        return Lost(type(error).__name__)

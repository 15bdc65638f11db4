"""Calls from tasks to the driver, the process that started them.

A task calls `call(content)` and waits for the driver's answer. So a checkpoint is on the driver's
disk before its task continues, without a file system that nodes share. The calls pass through an
actor on the driver's node, because Ray's tasks can't address the driver itself.
"""

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import ray
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

CALLS = 1000
"""Number of tasks whose calls may wait for an answer at a time."""


@dataclass(frozen=True)
class Call:
    """A call of a task that waits for an answer."""

    number: int
    """Counts up."""
    sender: Any
    """What the driver named the task."""
    content: Any
    """What the task sent."""


class Mailbox:
    """The actor that holds calls until the driver has answered them."""

    def __init__(self) -> None:
        self.calls: asyncio.Queue[Call] = asyncio.Queue()
        self.answers: dict[int, asyncio.Future[Any]] = {}
        self.count = 0

    async def call(self, sender: Any, content: Any) -> Any:
        """Passes a call to the driver, and returns its answer."""
        self.count += 1
        number = self.count
        self.answers[number] = asyncio.get_running_loop().create_future()
        await self.calls.put(Call(number, sender, content))
        try:
            return await self.answers[number]
        finally:
            del self.answers[number]

    async def receive(self) -> Call:
        """Waits for the next call."""
        return await self.calls.get()

    async def answer(self, number: int, answer: Any) -> None:
        """Answers a call."""
        if number in self.answers and not self.answers[number].done():
            self.answers[number].set_result(answer)


class Caller:
    """What a task is passed in order to call the driver.

    Args:
        mailbox: The actor.
        sender: Names the task; part of each call.
    """

    def __init__(self, mailbox: Any, sender: Any):
        self.mailbox, self.sender = mailbox, sender

    def __call__(self, content: Any) -> Any:
        """Sends content that can be pickled to the driver, and returns its answer."""
        return ray.get(self.mailbox.call.remote(self.sender, content))


class Switchboard:
    """The driver's side of the calls."""

    def __init__(self) -> None:
        here = NodeAffinitySchedulingStrategy(ray.get_runtime_context().get_node_id(), soft=False)
        options = {"num_cpus": 0, "max_concurrency": CALLS, "scheduling_strategy": here}
        self.mailbox = ray.remote(**options)(Mailbox).remote()
        self._next: Any = None

    def caller(self, sender: Any) -> Caller:
        """What to pass to a task."""
        return Caller(self.mailbox, sender)

    def wait(
        self, tasks: Iterable[Any], answer: Callable[[Any, Any], Any], timeout: float | None
    ) -> list[Any]:
        """Waits until a task has ended or has called, and answers the call.

        Args:
            tasks: References of the tasks that run or wait for a node.
            answer: Called with the sender and the content of a call; returns the answer.
            timeout: Longest time to wait, in seconds; None for no limit.

        Returns:
            The references of tasks that have ended; empty if there was a call instead.
        """
        if self._next is None:
            self._next = self.mailbox.receive.remote()
        pending = [self._next, *tasks]
        ready, _ = ray.wait(pending, num_returns=1, timeout=timeout, fetch_local=False)
        if self._next not in ready:
            return list(ready)
        call = ray.get(self._next)
        self._next = None
        self.mailbox.answer.remote(call.number, answer(call.sender, call.content))
        return []

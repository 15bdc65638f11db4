"""Connects to a Ray cluster, and asks it for its nodes."""

import contextlib
import logging
import os
import re
import socket
from collections.abc import Iterator
from dataclasses import dataclass

import ray

from training.settings.errors import UsageError

SECONDS = 5.0
"""Time within which the head of a cluster must accept a connection, in seconds."""
EXPECTED = (
    'should be HOST:PORT of a head that "ray start --head --port PORT" has started, "auto" for the '
    "cluster of this machine, or nothing for that or a new one"
)

ACCESS = (
    "a cluster with token authentication also needs RAY_AUTH_MODE=token and its ~/.ray/auth_token"
)


@dataclass(frozen=True)
class Demand:
    """What a task needs of a node."""

    threads: int
    """CPUs: as many as the threads that it uses."""
    gpus: int = 0
    """GPUs."""

    @classmethod
    def of(cls, num_threads: int, device: str) -> "Demand":
        """The demand of training with this number of threads and on this torch device.

        "auto" demands no GPU: a task then sees none, and trains on the CPU.
        """
        return cls(num_threads, 1 if device.startswith("cuda") else 0)

    def options(self) -> dict[str, object]:
        """Options of a Ray task; the tasks are spread over the nodes, and Ray repeats none."""
        return {
            "num_cpus": self.threads,
            "num_gpus": self.gpus,
            "max_retries": 0,
            "scheduling_strategy": "SPREAD",
        }

    def check(self) -> None:
        """Raises UsageError if no node of the cluster is large enough: a task would wait forever.

        A cluster whose nodes have all gone is not an error: its tasks wait for a node.
        """
        nodes = [node["Resources"] for node in ray.nodes() if node["Alive"]]
        cpus = max((int(node.get("CPU", 0)) for node in nodes), default=0)
        gpus = max((int(node.get("GPU", 0)) for node in nodes), default=0)
        if 0 < cpus < self.threads:
            raise UsageError(
                f"--num-threads is {self.threads}, but the largest node of the Ray cluster has "
                f"{cpus} CPUs: should be at most {cpus}"
            )
        if gpus < self.gpus:
            raise UsageError(
                "--device needs a GPU, but no node of the Ray cluster has one: should be cpu"
            )

    def slots(self) -> int:
        """Number of such tasks that the nodes of the cluster can run at a time, at least one."""
        slots = 0
        for node in ray.nodes():
            if node["Alive"]:
                total = node["Resources"]
                fit = int(total.get("CPU", 0)) // self.threads
                slots += min(fit, int(total.get("GPU", 0)) // self.gpus) if self.gpus else fit
        return max(slots, 1)


@contextlib.contextmanager
def connected(address: str) -> Iterator[None]:
    """Connects to a Ray cluster; afterwards disconnects, which ends all tasks that still run.

    Args:
        address: HOST:PORT of the head, "auto" for the cluster of this machine, or "" for that or,
            if there is none, for a new one which ends with this process.

    Raises:
        UsageError: There is no such cluster, or it has another version of Ray or Python.
    """
    _check_address(address)
    try:
        ray.init(
            address or None, log_to_driver=False, logging_level=logging.ERROR,
            **({} if address or "RAY_ADDRESS" in os.environ else {"include_dashboard": False}),
        )  # fmt: skip
    except Exception as error:  # Ray has no common type of these errors
        reason = " ".join(str(error).split())
        raise UsageError(f"--ray is {address!r}: {reason:.300}; it {EXPECTED}; {ACCESS}") from None
    try:
        yield
    finally:
        ray.shutdown()


def _check_address(address: str) -> None:
    """Raises UsageError at once for an address at which nothing answers; Ray waits for minutes."""
    if address in ("", "auto"):
        return
    parts = re.fullmatch(r"(?:ray://)?([^:/\s]+|\[[^\]\s]+\]):(\d{1,5})", address)
    if parts is None:
        raise UsageError(f"--ray is {address!r}, {EXPECTED}")
    host, port = parts[1].strip("[]"), int(parts[2])
    try:
        socket.create_connection((host, port), SECONDS).close()
    except (OSError, OverflowError) as error:
        raise UsageError(
            f"--ray is {address!r}: nothing answers there ({error}); it {EXPECTED}"
        ) from None

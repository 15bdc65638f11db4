"""Whether arrays fit into free memory, asked before they are made.

Systems that promise more memory than they have end a process that uses it, without a word.
"""

import math
from pathlib import Path


def check_memory(needed: float, what: str) -> None:
    """Raises an error if `needed` bytes aren't free.

    Args:
        needed: bytes.
        what: what needs them, the beginning of the message.

    Raises:
        MemoryError: names the bytes that are needed and those that are free.
    """
    free = free_bytes()
    if needed > free:
        raise MemoryError(
            f"{what} need {needed / 1e9:.3g} GB, and {free / 1e9:.3g} GB of memory are free: take "
            "fewer bodies or worlds"
        )


def free_bytes() -> float:
    """Bytes of memory that are free; infinity where the system doesn't say."""
    try:
        available = [
            line for line in Path("/proc/meminfo").read_text().splitlines()
            if line.startswith("MemAvailable:")
        ]  # fmt: skip
        return 1024.0 * float(available[0].split()[1])
    except (OSError, IndexError, ValueError):
        return math.inf

"""What drives are told: written into the state of all worlds, for the steps that follow."""

from functools import cache
from typing import Any

import numpy as np

from physics.jit import SOURCES, entry

Array = np.ndarray


def by_worlds(values: Array) -> Array:
    """Values [count, tools, 3] as an array [tools, 3, count]: a copy unless they lie so already."""
    return np.ascontiguousarray(values.transpose(1, 2, 0))


@cache
def make_command() -> Any:
    """Entry point that lets every tool's reference move from where the tool is, at a velocity."""
    sources = SOURCES

    @entry
    def command(mover, bodies, velocity):
        _ = sources
        for w in range(velocity.shape[2]):
            for d in range(velocity.shape[0]):
                tool = mover[w, bodies + d]
                for c in range(3):
                    tool.reference[c] = tool.position[c]
                    tool.reference_velocity[c] = velocity[d, c, w]

    return command


@cache
def make_lead() -> Any:
    """Entry point that lets every tool's reference move from where it is, to a target in `time`."""
    sources = SOURCES

    @entry
    def lead(mover, bodies, target, time):
        _ = sources
        for w in range(target.shape[2]):
            for d in range(target.shape[0]):
                tool = mover[w, bodies + d]
                for c in range(3):
                    way = target[d, c, w] - tool.reference[c]
                    tool.reference_velocity[c] = way / time

    return lead

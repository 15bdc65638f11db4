"""How a robot's arm answers an action, learned from recorded motions.

A free hand's displacement in a step, and its velocity at the end, follow from where the hand is,
how fast it moves and which displacement is asked for: an arm that is stretched moves less far, and
motors have limits. `python -m benchmarks.twins identify --arms` trains a small network for each
robot.
"""

from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from physics.compiler.jit import entry, stage

Array = np.ndarray

MOVED = 0.02  # m, scale of the network's outputs


class Arm:
    """An arm.

    Args:
        file: weights [inputs, outputs] and biases [outputs] of the network's three layers.
        centre: m, of the region in which the network was trained.
        extent: m, half the width of that region.
        stride: m, displacement along each axis that an action asks for.
    """

    def __init__(
        self, file: Path, centre: tuple[float, float, float], extent: float, stride: float
    ):
        self.file, self.centre, self.extent, self.stride = file, np.array(centre), extent, stride

    @cached_property
    def network(self) -> tuple[Array, ...]:
        """Weights and biases of the layers in turn."""
        with np.load(self.file) as file:
            return tuple(file[f"{kind}{i}"].astype(np.float32) for i in range(3) for kind in "wb")

    def inputs(self, position: Array, velocity: Array, asked: Array) -> Array:
        """Inputs [n, 9] of the network, from what `answer` takes."""
        parts = (position - self.centre) / self.extent, asked / self.stride, velocity
        return np.ascontiguousarray(np.concatenate(parts, axis=1), dtype=np.float32)

    def answer(
        self, position: Array, velocity: Array, asked: Array, frame: float
    ) -> tuple[Array, Array]:
        """Displacement [n, 3] m of a free hand in a step, and its velocity [n, 3] m/s at the end.

        Args:
            position: [n, 3] m.
            velocity: [n, 3] m/s.
            asked: [n, 3] m, displacement that is asked for.
            frame: s, duration of a step.
        """
        x = self.inputs(position, velocity, asked)
        moved = np.empty((len(x), 6), dtype=np.float32)
        hidden = np.empty_like(self.network[1]), np.empty_like(self.network[3])
        _make_evaluate()(x, *self.network, *hidden, moved)
        answer = MOVED * moved.astype(float)
        return answer[:, :3], answer[:, 3:] / frame


@cache
def _make_evaluate() -> Any:
    """Entry that evaluates the network row by row: a row's bits don't depend on the others."""

    @entry
    def evaluate(x, w0, b0, w1, b1, w2, b2, first, second, out):
        for n in range(x.shape[0]):
            _layer(x[n], w0, b0, first)
            _bend(first)
            _layer(first, w1, b1, second)
            _bend(second)
            _layer(second, w2, b2, out[n])

    return evaluate


@stage
def _layer(x, weights, biases, out):
    """Out = x weights + biases."""
    for k in range(len(out)):
        out[k] = biases[k]
    for i in range(len(x)):
        for k in range(len(out)):
            out[k] += x[i] * weights[i, k]


@stage
def _bend(x):
    """Softsign, in place."""
    for k in range(len(x)):
        x[k] = x[k] / (np.float32(1.0) + abs(x[k]))

"""How the Panda arm answers an action, learned from recorded motions.

In the originals inverse kinematics turns a displacement of the end effector into joint angles, and
motors of limited torque drive the joints there: along y the hand moves 4 cm in a step, forward
2 cm, less where the arm is stretched, and it sinks meanwhile. A small network gives the
displacement in a step and the velocity at its end. `python -m benchmarks.twins identify --arm`
trains it.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from physics.compiler.jit import entry, stage

Array = np.ndarray

FILE = Path(__file__).with_name("arm.npz")
STRIDE = 0.05  # m, displacement along each axis that an action asks for
# scales of the network's inputs and outputs
CENTRE, LENGTH = np.array([0.0, 0.0, 0.15]), 0.15  # m
MOVED = 0.02  # m


@cache
def _network() -> tuple[Array, ...]:
    """Weights [inputs, outputs] and biases [outputs] of the three layers, in turn."""
    with np.load(FILE) as file:
        return tuple(file[f"{kind}{i}"].astype(float) for i in range(3) for kind in "wb")


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
        x[k] = x[k] / (1.0 + abs(x[k]))


def asked_displacement(position: Array, actions: Array) -> Array:
    """Displacement [n, 3] m that actions [n, 3 or 4] ask of hands at [n, 3] m.

    The originals move the target up to the table's top if it is below.
    """
    asked = STRIDE * actions[:, :3]
    asked[:, 2] = np.maximum(asked[:, 2], -position[:, 2])
    return asked


def inputs(position: Array, velocity: Array, asked: Array) -> Array:
    """Inputs [n, 9] of the network, from what `answer` takes."""
    parts = (position - CENTRE) / LENGTH, asked / STRIDE, velocity
    return np.ascontiguousarray(np.concatenate(parts, axis=1), dtype=float)


def answer(position: Array, velocity: Array, asked: Array, frame: float) -> tuple[Array, Array]:
    """Displacement [n, 3] m of a free hand in a step, and its velocity [n, 3] m/s at the end.

    Args:
        position: [n, 3] m.
        velocity: [n, 3] m/s.
        asked: [n, 3] m, see `asked_displacement`.
        frame: s, duration of a step.
    """
    x = inputs(position, velocity, asked)
    network, moved = _network(), np.empty((len(x), 6))
    hidden = np.empty_like(network[1]), np.empty_like(network[3])
    _make_evaluate()(x, *network, *hidden, moved)
    moved *= MOVED
    return moved[:, :3], moved[:, 3:] / frame

"""Commands to drives: how the set points of their servos move in the steps that follow."""

import math
from functools import cache
from typing import Any

import numpy as np

from physics.compiler.jit import entry

Array = np.ndarray


def worlds_last(values: Array) -> Array:
    """Values [count, drives, 3] as an array [drives, 3, count]; copied only if needed.

    Always one that may be written: numba compiles a kernel of its own for those that may not, such
    as a value that was broadcast.
    """
    turned = np.ascontiguousarray(values.transpose(1, 2, 0))
    return turned if turned.flags.writeable else turned.copy()


@cache
def make_velocity_command() -> Any:
    """Entry point: every set point starts at its drive's position and moves at a velocity."""
    for_ever = math.inf

    @entry
    def command(dynamic, bodies, velocity):
        for w in range(velocity.shape[2]):
            for d in range(velocity.shape[0]):
                drive = dynamic[w, bodies + d]
                drive.reference_time = for_ever
                for c in range(3):
                    drive.reference[c] = drive.position[c]
                    drive.reference_velocity[c] = velocity[d, c, w]

    return command


@cache
def make_move_command() -> Any:
    """Entry point: every set point moves to a target in `time` s and stops; at once if 0."""

    @entry
    def move(dynamic, bodies, target, time):
        for w in range(target.shape[2]):
            for d in range(target.shape[0]):
                drive = dynamic[w, bodies + d]
                drive.reference_time = time
                for c in range(3):
                    if time > 0.0:
                        distance = target[d, c, w] - drive.reference[c]
                        drive.reference_velocity[c] = distance / time
                    else:
                        drive.reference[c] = target[d, c, w]
                        drive.reference_velocity[c] = 0.0

    return move

"""A barrier for the threads of one kernel call: none continues before all have arrived.

Threads run the same kernel at the same time, each on its own part of the bodies and pairs. They
wait for each other several times per substep, so a barrier must cost less than a microsecond. It
spins, and gives its core away while others need it: a thread that waits must not slow down the one
it waits for.
"""

import os
from typing import Any

import numpy as np
from numba.core import cgutils, types
from numba.core.typing import signature
from numba.extending import intrinsic

from physics.compiler.jit import stage

Array = np.ndarray

# tries before a waiting thread gives its core away
_SPINS = 2000
# int64 entries per counter: two cache lines, so that threads don't share one
_APART = 16

_give_core_away = types.ExternalFunction(
    "sched_yield" if os.name == "posix" else "SwitchToThread", signature(types.int32)
)


def _add_at(typingctx, array, index, value):
    """Atomically adds to array[index] and returns what was there."""

    def codegen(context, builder, signature, arguments):
        kind = signature.args[0]
        view = context.make_array(kind)(context, builder, arguments[0])
        pointer = cgutils.get_item_pointer(
            context, builder, kind, view, [arguments[1]], wraparound=False
        )
        return builder.atomic_rmw("add", pointer, arguments[2], "seq_cst")

    return types.int64(array, types.int64, types.int64), codegen


_add: Any = intrinsic(_add_at)


def new_barrier() -> Array:
    """The counters of a barrier: arrivals, and how often it has opened."""
    return np.zeros(2 * _APART, dtype=np.int64)


@stage
def wait(barrier, threads):
    """Waits until `threads` threads have arrived at a barrier."""
    if threads > 1:
        opened = _add(barrier, _APART, 0)
        if _add(barrier, 0, 1) == threads - 1:
            _add(barrier, 0, -threads)
            _add(barrier, _APART, 1)
        else:
            spins = 0
            while _add(barrier, _APART, 0) == opened:
                spins += 1
                if spins > _SPINS:
                    _give_core_away()

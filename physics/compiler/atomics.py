"""Atomic operations of kernels that several threads run together, and the barrier made of them.

Numba has atomics for GPUs only, so these emit LLVM's. A counter is an element of an int64 array;
give each its own cache line.
"""

import os
from typing import Any

from numba.core import cgutils, types
from numba.extending import intrinsic

from physics.compiler.jit import stage

# how often a waiting thread looks at a barrier before it offers its core to others: about 30 us
_PATIENCE = 1000
# and how often it offers it before it sleeps. A thread that waits without sleeping keeps its core:
# if one that it waits for shares the other core with another program, every barrier takes as long
# as that program's time slice, milliseconds. A sleep takes about 100 us, so short waits do without
_OFFERS = 250

_posix = os.name == "posix"
_offer_core: Any = types.ExternalFunction(
    "sched_yield" if _posix else "SwitchToThread", types.int32()
)
# Windows sleeps in milliseconds; 1 may take 15
_sleep: Any = types.ExternalFunction("usleep" if _posix else "Sleep", types.int32(types.uint32))
_NAP = 20 if _posix else 1


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Address of the element that the first two arguments, an array and an index, name."""
    kind = signature.args[0]
    array = context.make_array(kind)(context, builder, arguments[0])
    return cgutils.get_item_pointer(context, builder, kind, array, [arguments[1]])


def _fetch_add(typingctx: Any, counters: Any, index: Any, amount: Any) -> Any:
    """Adds to an element of an int64 array at once for all threads; returns what it was before."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = _pointer(context, builder, signature, arguments)
        return builder.atomic_rmw("add", pointer, arguments[2], "seq_cst")

    return types.int64(counters, types.intp, types.int64), generate


def _load_now(typingctx: Any, counters: Any, index: Any) -> Any:
    """Reads an element of an int64 array as other threads have left it."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = _pointer(context, builder, signature, arguments)
        return builder.load_atomic(pointer, "seq_cst", 8)

    return types.int64(counters, types.intp), generate


fetch_add: Any = intrinsic(_fetch_add)
load_now: Any = intrinsic(_load_now)


@stage
def wait_for_all(counters, index, threads):
    """Returns when `threads` threads have called it as often as the caller has.

    All that they wrote before is then visible. The counter starts at zero. With one thread it
    costs nothing.
    """
    if threads == 1:
        return
    arrived = fetch_add(counters, index, 1) + 1
    target = ((arrived + threads - 1) // threads) * threads
    looks = 0
    while load_now(counters, index) < target:
        looks += 1
        if looks > _PATIENCE + _OFFERS:
            _sleep(_NAP)
        elif looks > _PATIENCE:
            _offer_core()

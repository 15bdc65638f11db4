"""The time that a machine needs at least for the contacts of a heap of particles.

A step has to move the heap's arrays through memory once, and to compute its contacts. The first is
their bytes over the rate at which the machine copies; the second is the time of the same arithmetic
on contacts that stand ready in the first-level cache, as often as there are contacts.
"""

from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.report.tables import Table
from physics.compiler.jit import entry
from physics.granular.pair_forces import BLOCK, filter_touching, make_compute, make_pack
from physics.granular.simulation import GranularSimulation
from physics.granular.tables import INVERSE_MASS, MOTION, PARITY, SLABS, WEIGHT

COPIED, TRIES, REPEATS = 2**27, 7, 4000  # bytes, runs, blocks


def make_compute_alone(features: Any) -> Any:
    """Entry point: packs one block of a slab's contacts and computes it again and again."""
    pack, compute = make_pack(features), make_compute(features)

    @entry
    def compute_alone(heap, constants, scratch, slab, h, repeats):  # type: ignore[no-untyped-def]
        """Contacts in the slab and in the block."""
        current = heap.counts[PARITY] % heap.pair.shape[0]
        room, n = heap.pair.shape[2], heap.particle.shape[0]
        pair, particle = heap.pair[current, slab].reshape(2 * room), heap.particle.reshape(4 * n)
        motion = heap.motion.reshape(MOTION * heap.motion.shape[0])
        block, touching = scratch.block[0], scratch.touching[0]
        sample = heap.particle[0, 3], heap.motion[0, INVERSE_MASS], heap.motion[0, WEIGHT]
        count = filter_touching(particle, pair, heap.pair_count[current, slab], touching)
        here = min(BLOCK, count)
        pack(particle, motion, heap.body_of, constants, block, touching, pair, particle, 0, here, 0)
        for _ in range(repeats):
            compute(constants, sample, block, here, h)
        return count, here

    return compute_alone


def limit(simulation: GranularSimulation, h: float, seconds: float, title: str) -> Table:
    """Bounds of a step of a viscous heap and how near to them it is.

    Args:
        simulation: with one thread and no contact history.
        h: s, the step.
        seconds: that a step takes.
        title: of the heap.
    """
    heap, alone = simulation.heaps[0], make_compute_alone(simulation.heap_features)
    arguments = heap, simulation._constants, simulation._scratch
    contacts = sum(alone(*arguments, slab, h, 0)[0] for slab in range(SLABS))
    best = np.inf
    for _ in range(TRIES):
        start = perf_counter()
        here = alone(*arguments, SLABS // 2, h, REPEATS)[1]
        best = min(best, (perf_counter() - start) / (REPEATS * here))
    # each array is read, and what changes is written, once
    pairs = int(heap.pair_count[heap.counts[PARITY] % len(heap.pair)].sum())
    read = 8 * pairs + heap.particle.nbytes + heap.motion.nbytes + heap.body.nbytes
    written = heap.particle.nbytes + heap.motion.nbytes + heap.body.nbytes
    forces = 2 * 64 * int((heap.force_range[:, 1] - heap.force_range[:, 0]).sum())
    moved = read + written + forces
    source = np.ones(COPIED // 8)
    target, rate = source.copy(), 0.0
    for _ in range(TRIES):
        start = perf_counter()
        np.copyto(target, source)
        rate = max(rate, 2 * COPIED / (perf_counter() - start))
    bytes_time, operations_time = moved / rate, contacts * best
    bound = max(bytes_time, operations_time)
    return Table(
        "granular_limit",
        f"What a step needs at least, {title}, one thread",
        ["contacts", "bytes a contact", "GB/s copied", "µs for the bytes",
         "ns a contact, arithmetic alone", "µs for the arithmetic", "µs a step", "step over bound"],
        [[f"{contacts:,}", moved / contacts, 1e-9 * rate, 1e6 * bytes_time, 1e9 * best,
          1e6 * operations_time, 1e6 * seconds, seconds / bound]],
    )  # fmt: skip

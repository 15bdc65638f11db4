"""Counter-based random numbers: each depends only on seed, episode, stream and index.

So the episodes of a world do not depend on the other worlds, and thousands of starts are drawn at
once. The generator is splitmix64 (Steele, Lea and Flood 2014), used as a hash of the counters.
"""

from functools import cache
from typing import Any

import numpy as np

from physics.compiler.jit import entry, stage

Array = np.ndarray

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
# multiplier of the streams other than 0: any odd number other than _GOLDEN
_STREAM = np.uint64(0xD1B54A32D192ED03)


# numba turns uint64 beside int64 into float64
_ONE, _11, _27, _30, _31 = (np.uint64(n) for n in (1, 11, 27, 30, 31))
_FACTOR_1, _FACTOR_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


@stage
def _mix(x):
    """Finaliser of splitmix64: each bit of the input changes half of the output bits on average."""
    x = (x ^ (x >> _30)) * _FACTOR_1
    x = (x ^ (x >> _27)) * _FACTOR_2
    return x ^ (x >> _31)


@cache
def _make_draw() -> Any:

    @entry
    def draw(seeds, episodes, streams, out):
        for i in range(out.shape[0]):
            key = _mix(seeds[i] + _GOLDEN)
            key = _mix(key + (episodes[i] + _ONE) * _GOLDEN)
            if streams[i] != 0:
                key = _mix(key + streams[i] * _STREAM)
            step = key
            for k in range(out.shape[1]):
                step += _GOLDEN
                out[i, k] = np.float64(_mix(step) >> _11) * 2.0**-53

    return draw


def uniform(seeds: Array, episodes: Array, count: int, stream: int | Array = 0) -> Array:
    """Uniform random numbers in [0, 1).

    Args:
        seeds: [n] non-negative integers.
        episodes: [n] non-negative integers.
        count: how many numbers to draw for each seed and episode.
        stream: number of an independent sequence, or [n] of them.

    Returns:
        [n, count]
    """
    out, streams = np.empty((len(seeds), count)), np.empty(len(seeds), dtype=np.uint64)
    streams[:] = stream
    _make_draw()(seeds.astype(np.uint64), episodes.astype(np.uint64), streams, out)
    return out


def normal(seeds: Array, episodes: Array, count: int, stream: int | Array = 0) -> Array:
    """Gaussian random numbers [n, count] with mean 0 and standard deviation 1 (Box-Muller).

    Args:
        seeds: [n] non-negative integers.
        episodes: [n] non-negative integers.
        count: how many numbers to draw for each seed and episode.
        stream: see `uniform`.
    """
    draws = uniform(seeds, episodes, 2 * count, stream)
    radius = np.sqrt(-2.0 * np.log1p(-draws[:, :count]))
    return np.asarray(radius * np.cos(2.0 * np.pi * draws[:, count:]))

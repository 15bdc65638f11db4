"""Counter-based random numbers: each depends only on seed, episode, stream and index.

So the episodes of a world do not depend on the other worlds, and thousands of starts are drawn at
once. The generator is splitmix64 (Steele, Lea and Flood 2014), used as a hash of the counters.
"""

import numpy as np

Array = np.ndarray

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
# multiplier of the streams other than 0: any odd number other than _GOLDEN
_STREAM = np.uint64(0xD1B54A32D192ED03)


def _mix(x: Array) -> Array:
    """Finaliser of splitmix64: each bit of the input changes half of the output bits on average."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


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
    key = _mix(seeds.astype(np.uint64) + _GOLDEN)
    key = _mix(key + (episodes.astype(np.uint64) + np.uint64(1)) * _GOLDEN)
    if np.any(stream):
        streams = np.asarray(stream).astype(np.uint64)
        key = np.where(streams == 0, key, _mix(key + streams * _STREAM))
    steps = (np.arange(count, dtype=np.uint64) + np.uint64(1)) * _GOLDEN
    bits = _mix(key[:, None] + steps)
    return (bits >> np.uint64(11)) * 2.0**-53


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

"""Draws are uniform, and depend on seed, episode and index alone."""

import numpy as np
import pytest

from rigid_envs.episodes.draws import uniform

N = 20_000
SEEDS = np.arange(N)
ZERO = np.zeros(N, dtype=np.int64)


def by_definition(seed: int, episode: int, count: int) -> list[float]:
    """The same numbers from the definition of splitmix64, in Python integers."""
    golden, full = 0x9E3779B97F4A7C15, 2**64 - 1

    def mix(x):
        x = ((x ^ x >> 30) * 0xBF58476D1CE4E5B9) & full
        x = ((x ^ x >> 27) * 0x94D049BB133111EB) & full
        return x ^ x >> 31

    key = mix((seed + golden) & full)
    key = mix((key + (episode + 1) * golden) & full)
    return [(mix((key + (k + 1) * golden) & full) >> 11) * 2.0**-53 for k in range(count)]


@pytest.mark.parametrize(
    ("seed", "episode", "golden"),
    [
        (0, 0, [0.13870941014555427, 0.9711020828012883, 0.2778328726049074]),
        (1, 0, [0.6935121390102292, 0.9717668398552313, 0.4265688115847973]),
        (0, 1, [0.18383979100743952, 0.6250937004946515, 0.45541761247435375]),
        (2**31 - 1, 123, [0.6471315915051123, 0.24931825620194636, 0.1438531776469809]),
    ],
)
def test_draws_never_change_between_releases(seed, episode, golden):
    drawn = uniform(np.array([seed]), np.array([episode]), 3)
    np.testing.assert_array_equal(drawn, [golden])
    np.testing.assert_array_equal(drawn, [by_definition(seed, episode, 3)])


def test_a_row_does_not_depend_on_its_batch():
    order = np.random.default_rng(0).permutation(N)
    episodes = SEEDS % 7
    together = uniform(SEEDS, episodes, 15)
    np.testing.assert_array_equal(uniform(SEEDS[order], episodes[order], 15), together[order])
    np.testing.assert_array_equal(uniform(SEEDS[5:6], episodes[5:6], 15), together[5:6])


def test_drawing_more_numbers_does_not_change_the_first_ones():
    np.testing.assert_array_equal(uniform(SEEDS, ZERO, 3), uniform(SEEDS, ZERO, 15)[:, :3])


def test_draws_fill_the_unit_interval_evenly():
    drawn = uniform(SEEDS, ZERO, 15)
    assert drawn.dtype == np.float64
    assert drawn.min() >= 0.0
    assert drawn.max() < 1.0
    for column in drawn.T:
        counts = np.histogram(column, bins=50, range=(0.0, 1.0))[0]
        chi_squared = ((counts - N / 50) ** 2 / (N / 50)).sum()
        assert chi_squared < 49 + 5 * np.sqrt(2 * 49)
    assert abs(drawn.mean() - 0.5) < 5 * np.sqrt(1 / 12 / drawn.size)
    assert abs(drawn.var() - 1 / 12) < 5 * np.sqrt(1 / 180 / drawn.size)


@pytest.mark.parametrize("lag", [1, 2, 64, 4096])
def test_neighbours_are_uncorrelated(lag):
    drawn = uniform(SEEDS, ZERO, 15)
    pairs = {
        "seed": (drawn[:, 0], uniform(SEEDS + lag, ZERO, 1)[:, 0]),
        "episode": (drawn[:, 0], uniform(SEEDS, ZERO + lag, 1)[:, 0]),
        "seed against episode": (
            uniform(SEEDS, ZERO + lag, 1)[:, 0],
            uniform(SEEDS + lag, ZERO, 1)[:, 0],
        ),
        "index": (drawn[:, 0], drawn[:, lag % 15 or 1]),
    }
    for name, (a, b) in pairs.items():
        assert abs(np.corrcoef(a, b)[0, 1]) < 5 / np.sqrt(N), name


def test_no_two_episodes_are_the_same():
    seeds, episodes = (x.ravel() for x in np.meshgrid(np.arange(1000), np.arange(100)))
    assert len(np.unique(uniform(seeds, episodes, 1))) == len(seeds)

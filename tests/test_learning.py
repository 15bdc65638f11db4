"""The profile of training: times of nested functions, and that its parts exist."""

import pytest

from benchmarks import learning
from benchmarks.learning import IDS, PARTS, Clock, measure


def test_the_time_of_a_function_is_without_that_of_the_timed_functions_that_it_calls(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(learning, "perf_counter", lambda: now[0])

    def work(seconds):
        now[0] += seconds

    clock = Clock()
    inner = clock.timed(lambda: work(2.0), ("inner", "us"))

    def called():
        work(1.0)
        inner()
        inner()
        work(0.5)

    outer = clock.timed(called, ("outer", "us"))
    outer()
    inner()
    assert clock.seconds == {("inner", "us"): 6.0, ("outer", "us"): 1.5}


def test_a_part_of_training_takes_a_part_of_its_time():
    table = measure("push", 20_000)
    *rows, whole = table.rows
    assert {row[0] for row in rows} >= {part for *_, part in PARTS} - {
        "evaluation of the mean action"
    }
    assert sum(row[3] for row in rows) == pytest.approx(1.0)
    assert sum(row[2] for row in rows) == pytest.approx(whole[2])
    assert all(row[3] > 0.0 for row in rows)
    assert set(IDS) == {"push", "throw", "stack"}

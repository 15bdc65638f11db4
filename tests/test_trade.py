"""The measured trade: its page, plots and tables are those of the data, and its parts are right."""

import csv
import math

import pytest
from PIL import Image

from benchmarks.draw.trade import DIGEST
from benchmarks.pages import trade_text
from benchmarks.plots import TRADE
from benchmarks.report.results_file import load as saved_tables
from benchmarks.trade import fronts, page, store
from benchmarks.trade.settings import OURS, PEER, options_text, ours
from benchmarks.trade.trial import judge
from benchmarks.trade.trials import TRIALS
from physics import PRESETS, World

ROWS = store.load()


def row(engine, error, rate, trial="slide"):
    return store.Row(trial, engine, "c", "1 ms", "", "stable", error, 0.0, 0.0, rate, rate)


def test_the_page_shows_the_data():
    assert page.PATH.read_text(encoding="utf-8") == trade_text(saved_tables())
    assert page.PATH.stat().st_size < 5_000_000


@pytest.mark.parametrize("path", TRADE, ids=lambda path: path.name)
def test_a_plot_shows_the_data(path):
    with Image.open(path) as picture:
        assert picture.info[DIGEST] == store.digest(ROWS)
    assert path.stat().st_size <= 300_000


@pytest.mark.parametrize("worlds", fronts.WORLDS)
def test_the_saved_ratios_are_those_of_the_data(worlds):
    assert saved_tables().tables[f"trade {worlds}"] == fronts.ratios(ROWS, worlds)


def test_every_preset_is_measured_in_every_scene():
    measured = {(r.trial, r.label) for r in ROWS if r.curve == "presets"}
    trials = {r.trial for r in ROWS}
    assert trials <= TRIALS.keys()
    assert measured == {(trial, preset) for trial in trials for preset in PRESETS}
    assert {r.engine for r in ROWS} == {OURS, PEER}


def test_a_front_has_no_setting_that_another_one_beats():
    rows = [row(OURS, 1e-2, 10.0), row(OURS, 1e-1, 5.0), row(OURS, 1e-3, 1.0), row(PEER, 0.0, 99.0)]
    assert [r.error for r in fronts.front(rows, OURS, "many")] == [1e-2, 1e-3]


def test_ratios_compare_the_fastest_settings_at_an_error():
    rows = [
        row(OURS, 1e-2, 40.0),
        row(OURS, 1e-3, 8.0),
        row(PEER, 5e-2, 20.0),
        row(PEER, 9e-3, 2.0),
    ]
    table = fronts.ratios(rows, "one")
    assert table.rows == [["slide", 2.0, 20.0, "ours only", 1e-3, 9e-3]]


def test_rows_survive_the_file(tmp_path):
    rows = [row(OURS, 1e-2, 10.0), row(PEER, math.nan, math.nan)._replace(note='a "b", c')]
    store.append(rows[:1], tmp_path / "t.csv")
    store.append(rows[1:], tmp_path / "t.csv")
    found = store.load(tmp_path / "t.csv")
    assert found[0] == rows[0]
    assert found[1].note == rows[1].note
    assert math.isnan(found[1].error)
    (tmp_path / "u.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="must begin with"):
        store.load(tmp_path / "u.csv")


def test_a_setting_can_be_pasted():
    from physics import Fidelity

    for setting in ours(TRIALS["slide"]):
        text = options_text(setting.options)
        assert eval(text, {"Fidelity": Fidelity}) == setting.options


def test_a_trial_judges_an_engine():
    outcome = judge(TRIALS["slide"], lambda scene, count: World(scene, "balanced", count))
    assert outcome.status == "stable"
    assert outcome.error == pytest.approx(1.3e-4, rel=0.5)
    refused = judge(TRIALS["slide"], lambda scene, count: World(scene, "none", count))
    assert refused.status == "refused"
    assert "fidelity" in refused.note


def test_the_data_are_in_order():
    with store.PATH.open() as file:
        assert len(list(csv.reader(file))) == len(ROWS) + 1
    assert len({r[:4] for r in ROWS}) == len(ROWS)


def test_the_page_works_in_a_browser(browser_page):
    browser_page.goto(page.PATH.as_uri())
    points = browser_page.locator("svg .point")
    count = points.count()
    assert count > 50
    browser_page.select_option("#trial", "tower of 5")
    assert "5 cubes" in browser_page.inner_text("#title")
    assert points.count() != count
    browser_page.click("#worlds button[data-v=one]")
    assert "one world" in browser_page.text_content("#plot")
    before = points.count()
    browser_page.locator("#legend input").first.uncheck()
    assert points.count() < before
    points.last.click()
    assert "(" in browser_page.inner_text("#copied")
    points.last.hover()
    assert "error" in browser_page.inner_text("#tip")
    assert "×" in browser_page.inner_text("#table")
    assert all(url.startswith("file:") for url in browser_page.requests)


def timed_row(label, error, one=math.nan, many=math.nan):
    return store.Row(
        "slide", OURS, "springs", label, "Fidelity()", "stable", error, 0.0, 0.0, one, many
    )


def test_a_trial_that_was_interrupted_keeps_what_was_measured(tmp_path):
    path = tmp_path / "trade.csv"
    first = store.Partial(path, "slide")
    first.add(timed_row("2 ms", 0.01))
    first.add(timed_row("1 ms", 0.001))
    first.add(timed_row("2 ms", 0.01, 100.0, 1e4))
    again = store.Partial(path, "slide")
    assert [again.rows[k].label for k in again.rows] == ["2 ms", "1 ms"]
    assert again.rows[timed_row("2 ms", 0.0).key] == timed_row("2 ms", 0.01, 100.0, 1e4)
    assert math.isnan(again.rows[timed_row("1 ms", 0.0).key].one)
    assert [again.rounds[key] for key in again.rows] == [1, 0]
    again.remove()
    assert not store.Partial(path, "slide").rows


def test_settings_that_could_be_the_fastest_are_timed_again():
    rows = [
        timed_row("a", 0.1, 100, 1000),
        timed_row("b", 0.2, 40, 900),  # close with many worlds
        timed_row("c", 0.2, 40, 400),  # beaten in both
        timed_row("d", 0.01, 10, 100),  # the most accurate
        timed_row("e", 0.3),  # not timed
    ]
    timed = {r.label for r in rows if r.key in fronts.close(rows[:4], 2.0)}
    assert timed == {"a", "b", "d"}

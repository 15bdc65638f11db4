"""The figures and plots in the pages are those that were measured and saved."""

import numpy as np
import pytest
from PIL import Image

from benchmarks.draw.figure import DIGEST, digest
from benchmarks.draw.tasks import STRIPS
from benchmarks.measure.commits import difference
from benchmarks.pages import PAGES, page_text
from benchmarks.plots import FILM, PLOTS, SCENES
from benchmarks.report.results_file import load, save
from benchmarks.report.tables import Table
from benchmarks.stability.__main__ import load as cells
from benchmarks.stability.summary import ranges


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_tables_of_a_page_are_the_saved_ones(page):
    text = page.read_text(encoding="utf-8")
    assert "<!-- figures:" in text
    assert page_text(text, load()) == text


@pytest.mark.parametrize("name", PLOTS)
def test_a_plot_shows_the_saved_table(name):
    plot = PLOTS[name]
    with Image.open(plot.path) as picture:
        assert picture.info[DIGEST] == digest(load().tables[plot.table])


def test_pictures_are_small():
    strips = [FILM.parent / f"{name}.png" for name in STRIPS]
    for path in (SCENES, *strips, *(plot.path for plot in PLOTS.values())):
        assert path.stat().st_size <= 300_000, path
    assert FILM.stat().st_size <= 1_500_000


def test_the_readme_is_short():
    assert len(PAGES[0].read_text(encoding="utf-8").splitlines()) <= 120


def test_saving_some_tables_keeps_the_others_and_their_provenance(tmp_path):
    file, first, second = tmp_path / "results.json", {"date": "1st"}, {"date": "2nd"}
    old, other = Table("a", "", ["x"], [["1"]]), Table("b", "", ["x"], [["2"]])
    save([old, other], first, file)
    new = old._replace(rows=[["3"]])
    save([new], second, file, keep=True)
    saved = load(file)
    assert saved.tables == {"a": new, "b": other}
    assert saved.runs == {"a": second, "b": first}
    save([old], first, file)
    assert load(file).tables == {"a": old}


def test_a_difference_names_the_first_step_and_the_largest_number():
    own = {"x": np.zeros((3, 2), np.float32), "end": np.zeros((3, 2), bool)}
    assert difference(own, {name: values.copy() for name, values in own.items()}) == (0.0, None)
    other = {"x": own["x"] + np.float32([[0], [1e-3], [2.0]]), "end": own["end"]}
    assert difference(own, other) == (2.0, 1)
    assert difference(own, {**own, "end": ~own["end"]}) == (1.0, 0)
    assert difference(own, {**own, "x": -own["x"]}) == (0.0, 0)  # the sign of zero is a bit too
    assert difference(own, {**own, "x": own["x"][:2]}) == (np.inf, 0)


def test_the_table_of_stability_is_that_of_the_map():
    table = load().tables["stability"]
    assert table == ranges(cells())

"""Figures in the documents are those that were measured."""

from benchmarks.tables import README, readme


def test_the_figures_of_the_readme_are_the_saved_ones():
    text = README.read_text()
    assert readme(text) == text

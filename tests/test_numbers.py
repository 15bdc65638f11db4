"""Every numeric literal of the engine is accounted for, and docs/physics.md has the tuned ones."""

import pytest

from benchmarks import numbers, sweep


def test_every_literal_of_the_engine_has_an_entry():
    """A new one belongs into numbers.toml: as `other` with a reason, or as `tuned` with the command
    of its sweep or a derivation."""
    assert numbers.differences() == []


def test_there_are_at_most_thirty_tuned_numbers():
    assert len(numbers.listed()["tuned"]) <= 30


def test_every_entry_has_a_reason():
    entries = numbers.listed()
    assert all(entry["reason"] and entry["meaning"] for entry in entries["tuned"])
    kinds = ("round-off", "stands for infinity", "derived", "structural", "setting")
    assert all(entry["why"].startswith(kinds) for entry in entries["other"])


def test_the_page_has_the_table():
    text = numbers.PAGE.read_text()
    assert "<!-- tuned numbers -->" in text
    assert numbers.page_text(text) == text


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("A = 1.0", [("A", 1.0)]),
        ("A = -2", [("A", 2)]),
        ("class B:\n    c: float = 0.5", [("B.c", 0.5)]),
        ("def f(x):\n    y = 1.0\n    return 0.5 * x + y", []),
        ("def f(x):\n    return 0.7 * x[5]", [("f", 0.7)]),
        ("class B:\n    def f(self):\n        return 5", [("B.f", 5)]),
        ("shape = (3, 4)\nfor i in range(7): pass", []),
        ("flag = True", []),
    ],
)
def test_what_is_a_literal_that_needs_an_entry(source, found):
    assert numbers.literals(source) == found


@pytest.mark.parametrize("name", ["REST_DAMPING", "SHEAR_RATIO", "MAX_SWEEPS"])
def test_a_sweep_edits_a_copy(name, tmp_path):
    tree = sweep.edited(name, "1/3", tmp_path)
    edited = [
        path for path in (tree / "physics").rglob("*.py")
        if path.read_text() != (numbers.ROOT / path.relative_to(tree)).read_text()
    ]  # fmt: skip
    assert len(edited) == 1
    assert f"\n{name} = 1/3\n" in edited[0].read_text()


def test_a_sweep_names_what_can_be_swept(tmp_path):
    with pytest.raises(SystemExit, match=r"GRAVITY is not .* these can: .*REST_DAMPING"):
        sweep.edited("GRAVITY", "1", tmp_path)
    with pytest.raises(SystemExit, match="'many' is not a number"):
        sweep.edited("REST_DAMPING", "many", tmp_path)

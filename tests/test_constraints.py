"""Constraints pin what users install; tools of developers have a file of their own."""

import re
import tomllib
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
USERS = ("train", "tune", "data", "render", "view", "mesh")
DEVELOPERS = ("dev", "docs", "bench")


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def pinned(file):
    lines = (ROOT / file).read_text().splitlines()
    return {plain(line.partition("==")[0]) for line in lines if not line.startswith("#")}


def needed(extras):
    """Names of all that these extras of the project need, as far as it is installed."""
    todo, found = [("rigid-envs", tuple(extras))], set()
    while todo:
        name, wanted = todo.pop()
        if (plain(name), wanted) in found:
            continue
        found.add((plain(name), wanted))
        try:
            requirements = metadata.distribution(name).requires or []
        except metadata.PackageNotFoundError:
            continue
        for requirement in map(Requirement, requirements):
            marker = requirement.marker
            if marker is None or any(marker.evaluate({"extra": one}) for one in (*wanted, "")):
                todo.append((requirement.name, tuple(sorted(requirement.extras))))
    return {name for name, _ in found} - {"rigid-envs"}


def elsewhere(name):
    """Whether a package is needed on other machines alone: those with a GPU, or Windows."""
    return name in ("triton", "colorama") or name.startswith(("nvidia-", "cuda-"))


def test_users_are_given_pins_of_what_they_install_and_of_nothing_else():
    missing = {name for name in needed(USERS) - pinned("constraints.txt") if not elsewhere(name)}
    assert not missing
    assert not pinned("constraints.txt") - needed(USERS)


def test_developers_are_given_pins_of_the_rest():
    assert not pinned("constraints.txt") & pinned("constraints-dev.txt")
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for extra in (*USERS, *DEVELOPERS):
        names = {plain(Requirement(one).name) for one in extras["optional-dependencies"][extra]}
        assert names <= {"rigid-envs"} | pinned("constraints.txt") | pinned("constraints-dev.txt")

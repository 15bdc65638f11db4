import os

import hypothesis
import pytest

from tests.browser import browser, browser_page  # noqa: F401  (fixtures of all tests)

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("RIGID_ENVS_KERNEL", "general")  # shared by most tests; the same bits
os.environ.setdefault("RIGID_ENVS_COMPILERS", "1")  # two workers share two cores
os.environ.setdefault("OMP_NUM_THREADS", "1")  # likewise

# An outcome must depend neither on the speed of the machine nor on chance; stress looks further.
hypothesis.settings.register_profile("default", deadline=None, derandomize=True, max_examples=50)
hypothesis.settings.register_profile("stress", deadline=None, max_examples=2000)
hypothesis.settings.load_profile("default")


def pytest_addoption(parser):
    parser.addoption("--part", help="run one of several parts, as in 2/8; files stay whole")


def pytest_collection_modifyitems(config, items):
    part = config.getoption("--part")
    if part is None:
        return
    number, _, parts = part.partition("/")
    if not (number.isdecimal() and parts.isdecimal() and 1 <= int(number) <= int(parts)):
        raise pytest.UsageError(f"--part must be as in 2/8, got {part!r}")
    files = sorted({item.path for item in items})
    mine = set(files[int(number) - 1 :: int(parts)])
    config.hook.pytest_deselected(items=[item for item in items if item.path not in mine])
    items[:] = [item for item in items if item.path in mine]


@pytest.fixture
def stress():
    """Whether `make stress` runs."""
    return hypothesis.settings.default.max_examples > 100

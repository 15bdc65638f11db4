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


@pytest.fixture
def stress():
    """Whether `make stress` runs."""
    return hypothesis.settings.default.max_examples > 100

"""A page in a headless browser, for tests of what is shown in one.

Needs Debian's chromium (or another one that is called so) and playwright. Without them a test is
skipped with the reason; if the environment variable REQUIRE_BROWSER is 1, as in CI, it fails.
"""

import importlib.util
import os
import shutil
from contextlib import contextmanager

import pytest

REQUIRE = "REQUIRE_BROWSER"
NAMES = ("chromium", "chromium-browser", "google-chrome")
# a sandbox needs rights that containers lack; WebGL is drawn by the processor
ARGUMENTS = (
    "--no-sandbox",
    "--headless",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
SIZE = {"width": 1000, "height": 700}


def _missing() -> str:
    """What is missing for a browser; empty if nothing is."""
    if not any(shutil.which(name) for name in NAMES):
        return "no chromium: install it with `apt-get install chromium`"
    if importlib.util.find_spec("playwright") is None:
        return 'no playwright: install it with `pip install -e ".[dev]"`'
    return ""


@contextmanager
def new_page(browser):
    """An empty page; its list `requests` gets the address of all that it asks for."""
    page = browser.new_page(viewport=SIZE)
    page.requests = []
    page.on("request", lambda request: page.requests.append(request.url))
    page.on("websocket", lambda socket: page.requests.append(socket.url))
    yield page
    page.close()


@pytest.fixture(scope="module")
def browser():
    """A browser for the tests of a module; after it, asyncio is free for others again."""
    missing = _missing()
    if missing and os.environ.get(REQUIRE) == "1":
        pytest.fail(f"{missing} ({REQUIRE}=1)", pytrace=False)
    if missing:
        pytest.skip(missing)
    from playwright.sync_api import sync_playwright

    program = next(filter(None, map(shutil.which, NAMES)))
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        yield started
        started.close()


@pytest.fixture
def browser_page(browser):
    """An empty page of `new_page` for one test."""
    with new_page(browser) as page:
        yield page

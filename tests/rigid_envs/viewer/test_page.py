"""The page in a browser: it shows the worlds, its controls act, and nothing leaves the machine."""

import threading
import time
from io import BytesIO
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from rigid_envs import Runner
from rigid_envs.viewer.session import Session

pytest.importorskip("viser", reason='no viser: install it with `pip install -e ".[view]"`')

from rigid_envs.viewer.server import AddressUnavailable, ViewServer
from tests.browser import new_page

LONG = 30_000  # ms


@pytest.fixture(scope="module")
def shown():
    """A session and its server, which runs in a thread."""
    session = Session(Runner("push", 4, fidelity="fast", reward_type="dense"))
    server = ViewServer(session, port=0, title="Push", seed=3)
    stop = threading.Event()
    thread = threading.Thread(target=server.run, args=(stop,))
    thread.start()
    yield session, server
    stop.set()
    thread.join()
    server.close()


@pytest.fixture(scope="module")
def page(browser, shown):
    """The page with its controls."""
    with new_page(browser) as opened:
        opened.goto(shown[1].url)
        opened.get_by_role("button", name="Pause").wait_for(timeout=LONG)
        yield opened


def wait(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "the page has not done it in time"
        time.sleep(0.05)


def press(page, name):
    page.get_by_role("button", name=name, exact=True).click(timeout=LONG)


def set_number(page, label, value):
    """Types a number into the box at the end of a slider's row."""
    row = page.get_by_text(label, exact=True).locator("xpath=ancestor::*[.//input][1]")
    box = row.locator("input:not([type=hidden])").last
    box.fill(str(value))
    box.press("Enter")


def colours(page):
    """Number of colours that cover a thousandth of the canvas or more."""
    image = page.locator("canvas").first.screenshot(timeout=LONG)
    pixels = np.asarray(Image.open(BytesIO(image)).convert("RGB")) // 8
    _, counts = np.unique(pixels.reshape(-1, 3), axis=0, return_counts=True)
    return int((counts > 1e-3 * counts.sum()).sum())


def test_the_page_shows_the_worlds_and_asks_no_other_machine(shown, page):
    session, _ = shown
    page.locator("canvas").first.wait_for(timeout=LONG)
    wait(lambda: session.steps > 0)
    wait(lambda: colours(page) > 5)
    page.get_by_text("solved now").wait_for(timeout=LONG)
    assert page.locator(".uplot canvas").count() == 1
    hosts = {urlsplit(url.removeprefix("blob:")).hostname for url in page.requests}
    assert hosts == {"127.0.0.1"}
    assert any(url.startswith("ws:") for url in page.requests)


def test_buttons_pause_step_and_reset(shown, page):
    session, _ = shown
    press(page, "Pause")
    wait(lambda: session.paused)
    steps = session.steps
    press(page, "Step")
    wait(lambda: session.steps == steps + 1)
    press(page, "Reset")
    wait(lambda: session.steps == 0)
    fresh = Runner("push", 4, fidelity="fast")
    fresh.reset(np.ones(4, dtype=bool), 3 + np.arange(4))
    np.testing.assert_array_equal(session.runner.world.position, fresh.world.position)
    press(page, "Run")
    wait(lambda: session.steps > 1)


def test_sliders_change_the_simulation_at_once(shown, page):
    session, _ = shown
    set_number(page, "Friction", 0.25)
    wait(lambda: session.friction == 0.25)
    wait(lambda: session.runner.world.parameters.friction[0, 0] == 0.25)
    set_number(page, "Mass (factor)", 2)
    wait(lambda: session.mass == 2.0)
    set_number(page, "Substep (ms)", 1.6)
    wait(lambda: session.fidelity.substep == pytest.approx(1.6e-3))
    page.get_by_text("before").wait_for(timeout=LONG)


def test_a_slider_that_is_dragged_moves_the_setting(shown, page):
    session, _ = shown
    before = session.runner.world.parameters.friction[0, 0]
    row = page.get_by_text("Friction", exact=True).locator("xpath=ancestor::*[.//input][1]")
    row.get_by_role("slider").first.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    wait(lambda: session.runner.world.parameters.friction[0, 0] > before)


def test_an_invalid_setting_shows_the_engine_s_words_and_changes_nothing(shown, page):
    session, _ = shown
    before = session.fidelity
    set_number(page, "Substep (ms)", 20)
    page.get_by_text("the largest safe step is").wait_for(timeout=LONG)
    assert session.fidelity == before
    steps = session.steps
    wait(lambda: session.steps > steps)


def test_without_a_browser_the_simulation_waits(shown, page, capfd):
    session, server = shown
    page.goto("about:blank")
    wait(lambda: "the browser has disconnected" in capfd.readouterr().out)
    time.sleep(0.5)
    steps = session.steps
    time.sleep(0.5)
    assert session.steps == steps
    page.goto(server.url)
    wait(lambda: session.steps > steps)


def test_a_port_in_use_is_named(shown):
    session, server = shown
    port = int(server.url.rsplit(":")[-1])
    with pytest.raises(AddressUnavailable, match=f"port {port} of 127.0.0.1 is in use"):
        ViewServer(session, port=port)


def test_only_this_machine_can_reach_the_page_by_default(shown):
    assert shown[1].url.startswith("http://127.0.0.1:")

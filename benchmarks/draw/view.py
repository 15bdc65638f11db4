"""A picture of the live view in a browser. It needs chromium, and playwright of the extra `dev`."""

import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path

from training.policies.policy import scripted_policy

TASK, WORLDS, BLOCKS = "RigidEnvs/Stack-v0", 6, 3
FIRST, THEN = "fast", "balanced"  # presets whose costs the page compares
STEPS = 200  # of the first preset; then until the last cubes are on their way
LAST = 466
WIDTH, HEIGHT = 1280, 900  # pixels
# without the rights that containers lack; the processor draws
ARGUMENTS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
PATIENCE = 120.0  # s


def draw(path: Path) -> None:
    """Writes a PNG of the page.

    Raises:
        FileNotFoundError: there is no chromium.
        TimeoutError: the page doesn't get there.
    """
    from playwright.sync_api import sync_playwright  # this and the next one are of extras

    from training.commands.view import serve

    if (program := shutil.which("chromium")) is None:
        raise FileNotFoundError("chromium is missing: apt-get install chromium")
    policy = scripted_policy(TASK, blocks=BLOCKS)
    server = serve(
        TASK, policy, num_worlds=WORLDS, seed=0, host="127.0.0.1", port=0,
        blocks=BLOCKS, fidelity=FIRST, reward_type="dense",
    )  # fmt: skip
    stop = threading.Event()
    loop = threading.Thread(target=server.run, args=(stop,))
    loop.start()
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
            page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
            page.goto(server.url)
            _wait(lambda: server.session.steps >= STEPS)
            row = page.get_by_text("Fidelity", exact=True).locator("xpath=ancestor::*[.//input][1]")
            row.locator("input:not([type=hidden])").first.click()
            page.get_by_role("option", name=THEN).click()
            _wait(lambda: server.session.steps >= LAST)
            for notice in page.locator(".mantine-Notification-closeButton").all():
                notice.click()  # that the processor draws
            page.get_by_text("Software WebGL").wait_for(state="hidden")
            path.parent.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=path)
            browser.close()
    finally:
        stop.set()
        loop.join()
        server.close()


def _wait(until: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not until():
        if time.monotonic() > end:
            raise TimeoutError(f"the page has not got there in {PATIENCE:g} s")
        time.sleep(0.05)

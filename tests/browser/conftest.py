"""A real browser for the tests of the page."""

import os
import shutil
import time

import pytest
from playwright.sync_api import sync_playwright

from avalanche_gym.viewer import Catalogue, Viewer

WIDTH, HEIGHT = 640, 480  # [pixels]
PATIENCE = 120.0  # [s] for what takes a moment on a machine with a graphics card
FLAGS = (
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


def chromium():
    """The browser's program; tests fail where it is missing, since a test that was skipped has proved nothing."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        path = os.environ.get("CHROMIUM") or shutil.which(name)
        if path:
            return path
    pytest.fail("These tests need Chromium: apt-get install chromium, or name the program in CHROMIUM.")


def until(condition):
    """Wait until ``condition()`` is true, and return what it gave."""
    end = time.monotonic() + PATIENCE
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < end, "this did not happen in time"
        time.sleep(0.02)


class Tab:
    """One page of the viewer in the browser."""

    def __init__(self, page, viewer):
        self.page, self.viewer = page, viewer
        self.complaints, self.requests = [], []
        page.on("console", lambda message: message.type in ("error", "warning") and self._complain(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.goto(f"{viewer.url}?shadows=off")
        self.until("viewer.ready()")

    def _complain(self, text):
        # What the software renderer says of itself is not the page's fault.
        if "GPU stall due to ReadPixels" not in text and "WebGL" not in text:
            self.complaints.append(text)

    def ask(self, expression):
        return self.page.evaluate(f"() => {expression}")

    def until(self, expression):
        return until(lambda: self.ask(f"({expression})"))

    def counter(self, name):
        text = self.ask(f"document.querySelector('#counters [data-name=\"{name}\"]')?.textContent ?? ''")
        return text.partition(" ")[0]

    def checked(self, name):
        return self.ask(f"document.getElementById('{name}').checked")

    def press(self, key):
        self.page.keyboard.press(key)

    def pause(self):
        if not self.viewer.simulation.paused:
            self.press(" ")
        until(lambda: self.viewer.simulation.paused)
        self.settle()

    def settle(self):
        """Until a frame that was sent from now on has been drawn."""
        received = self.ask("viewer.state.frames")
        self.until(f"viewer.state.frames > {received} + 1")
        drawn = self.ask("viewer.state.drawn")
        self.until(f"viewer.state.drawn > {drawn} + 1")

    def fold(self):
        """Put the panel out of the way of clicks."""
        if not self.ask("document.getElementById('panel').classList.contains('folded')"):
            self.page.click("#fold")
        self.settle()


@pytest.fixture(scope="session")
def browser():
    path = chromium()
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield running
        running.close()


@pytest.fixture
def open_viewer():
    """Makes viewers, and ends them."""
    running = []

    def make(show="showcase", level="", policies=None, port=0):
        viewer = Viewer(Catalogue(policies), show, level, port)
        viewer.start()
        running.append(viewer)
        return viewer

    yield make
    for viewer in running:
        viewer.stop()


@pytest.fixture
def open_tab(browser):
    """Makes pages; at the end of the test none of them may have complained."""
    tabs = []

    def make(viewer):
        tabs.append(Tab(browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}), viewer))
        return tabs[-1]

    yield make
    for tab in tabs:
        tab.page.close()
    assert [tab.complaints for tab in tabs] == [[] for _ in tabs]

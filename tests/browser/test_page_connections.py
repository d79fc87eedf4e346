"""Several pages, pages that hang, pages of strangers, nonsense, and a simulation that goes away."""

import http.server
import threading

import pytest

from avalanche_gym.viewer import Viewer
from tests.browser.conftest import until

pytestmark = pytest.mark.verify


def test_two_pages_see_the_same(open_viewer, open_tab):
    viewer = open_viewer()
    first, second = open_tab(viewer), open_tab(viewer)
    until(lambda: viewer.simulation.frames > 90)
    first.press(" ")
    for tab in (first, second):
        tab.until("viewer.state.status.settings.paused")
    for tab in (first, second):
        tab.settle()
    handles = first.ask("viewer.handles()")
    assert handles == second.ask("viewer.handles()")
    assert first.ask(f"viewer.position({handles[0]})") == second.ask(f"viewer.position({handles[0]})")
    second.page.select_option("#show", "planet")
    first.until("viewer.state.show.name === 'planet'")
    assert first.ask("document.getElementById('show').value") == "planet"
    # What is laid over the picture is each page's own.
    first.press("b")
    assert first.checked("boxes") and not second.checked("boxes")


def test_a_page_that_hangs_slows_nobody(open_viewer, open_tab):
    viewer = open_viewer("carpet")
    busy, other = open_tab(viewer), open_tab(viewer)
    # The page stops reading for some seconds; the call returns at once.
    busy.ask("void setTimeout(() => { const end = performance.now() + 6000; while (performance.now() < end); }, 0)")
    frames, seen = viewer.simulation.frames, other.ask("viewer.state.frames")
    until(lambda: viewer.simulation.frames > frames + 120)
    other.until(f"viewer.state.frames > {seen} + 60")
    # It comes back to the present.
    busy.until("viewer.state.frames > 0")
    busy.settle()


def test_a_page_that_vanishes_is_forgotten(open_viewer, open_tab):
    viewer = open_viewer()
    first, second = open_tab(viewer), open_tab(viewer)
    assert len(viewer.clients) == 2
    second.page.goto("about:blank")
    until(lambda: len(viewer.clients) == 1)
    first.settle()


def test_a_page_of_another_origin_is_refused(open_viewer, open_tab, browser):
    viewer = open_viewer()

    class Stranger(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>stranger</title>")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Stranger)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = browser.new_page()
    refusals = []
    page.on("console", lambda message: refusals.append(message.text))
    page.goto(f"http://127.0.0.1:{server.server_port}/")
    opened = page.evaluate(
        "(url) => new Promise((resolve) => { const s = new WebSocket(url);"
        "s.onopen = () => resolve(true); s.onclose = () => resolve(false); })",
        f"ws://127.0.0.1:{viewer.port}/stream",
    )
    assert not opened and not viewer.clients
    assert any("403" in text for text in refusals)
    page.close()
    server.shutdown()
    # Its own page may.
    open_tab(viewer).settle()


def test_nonsense_is_ignored_counted_and_shown(open_viewer, open_tab):
    viewer = open_viewer()
    tab = open_tab(viewer)
    for nonsense in ("'hello'", '\'{"type": "erase"}\'', "new Uint8Array([1, 2, 3])"):
        tab.ask(f"void viewer.connection.socket.send({nonsense})")
    until(lambda: viewer.malformed == 3)
    until(lambda: tab.counter("ignored messages") == "3")
    tab.settle()
    assert len(viewer.clients) == 1


def test_the_page_comes_back_when_the_simulation_does(open_viewer, open_tab):
    viewer = Viewer(show="showcase")
    viewer.start()
    tab = open_tab(viewer)
    viewer.stop()
    until(lambda: tab.page.is_visible("#lost"))
    open_viewer("terrain", port=viewer.port)
    tab.until("viewer.state.show?.name === 'terrain' && viewer.state.frames > 3")
    assert not tab.page.is_visible("#lost")
    # The browser itself notes every attempt that found nobody.
    tab.complaints = [text for text in tab.complaints if "ERR_CONNECTION_REFUSED" not in text]

"""Every key, box and button does its work, in the page and in the simulation."""

import pytest

from tests.browser.conftest import until

pytestmark = pytest.mark.verify


def landed(viewer):
    """Until bodies lie about, and touch."""
    until(lambda: viewer.simulation.frames > 200 and len(viewer.simulation.show.world.contacts()) > 0)


def test_overlays_by_key_and_by_box(open_viewer, open_tab):
    viewer = open_viewer()
    tab = open_tab(viewer)
    landed(viewer)
    tab.pause()
    for key, name in (("b", "boxes"), ("c", "contacts"), ("h", "cells")):
        assert tab.ask(f"viewer.overlays.counts.{name}") == 0
        tab.press(key)
        assert tab.checked(name)
        tab.until(f"viewer.overlays.counts.{name} > 0")
        tab.page.click(f"label:has(#{name})")
        assert not tab.checked(name)
        tab.until(f"viewer.overlays.counts.{name} === 0")
    world = viewer.simulation.show.world
    tab.press("b")
    tab.until(f"viewer.overlays.counts.boxes === {sum(b.motion == 'dynamic' for b in world.scene.bodies)}")
    tab.press("C")
    tab.until(f"viewer.overlays.counts.contacts === {len(world.contacts())}")
    tab.settle()
    assert not tab.complaints


def test_a_bounding_box_holds_its_body(open_viewer, open_tab):
    viewer = open_viewer()
    tab = open_tab(viewer)
    tab.until("viewer.handles().length > 0")
    tab.pause()
    corners = tab.ask(
        "{ const h = viewer.handles()[0], V = viewer.stage.camera.position.constructor, low = new V(), high = new V();"
        "viewer.bodies.bounds(h, low, high); return [low.toArray(), high.toArray(), viewer.position(h)]; }"
    )
    low, high, place = corners
    radius = viewer.simulation.show.world.scene.bodies[1].shape.bounding_radius
    for axis in range(3):
        assert low[axis] < place[axis] < high[axis]
        assert high[axis] - low[axis] < 2.2 * radius


def test_wireframe_and_resting_bodies(open_viewer, open_tab):
    viewer = open_viewer()
    tab = open_tab(viewer)
    wired = "[...viewer.bodies.batches.values()].every((batch) => batch.object.material.wireframe)"
    for _ in range(2):
        assert not tab.ask(wired)
        tab.press("w")
        assert tab.checked("wireframe") and tab.ask(wired)
        tab.page.click("label:has(#wireframe)")
        assert not tab.checked("wireframe")
    until(lambda: viewer.simulation._resting.any())
    tab.pause()
    seen_through = (
        "[...viewer.bodies.batches.values()].reduce((sum, batch) =>"
        " sum + (batch.object.material.transparent ? batch.object.count : 0), 0)"
    )
    assert tab.ask(seen_through) == 0
    tab.press("r")
    assert tab.checked("resting")
    tab.until(f"{seen_through} === {int(viewer.simulation._resting.sum())}")
    tab.page.click("label:has(#resting)")
    tab.until(f"{seen_through} === 0")


def test_pause_step_reset_and_speed(open_viewer, open_tab):
    viewer = open_viewer()
    tab = open_tab(viewer)
    simulation = viewer.simulation
    until(lambda: simulation.frames > 10)
    tab.press(" ")
    until(lambda: simulation.paused)
    tab.until("document.getElementById('pause').getAttribute('aria-pressed') === 'true'")
    frames, time = simulation.frames, simulation.show.demo.time
    tab.press(".")
    until(lambda: simulation.frames == frames + 1)
    assert simulation.show.demo.time == pytest.approx(time + 1 / 240)
    tab.page.click("#step")
    until(lambda: simulation.frames == frames + 2)
    tab.page.click("#pause")
    until(lambda: not simulation.paused)
    # A button that was pressed with the mouse is not pressed again by the space bar.
    tab.press(" ")
    until(lambda: simulation.paused)
    tab.page.click("#reset")
    until(lambda: simulation.show.demo.time == 0.0)
    tab.press(" ")
    until(lambda: simulation.show.demo.time > 0.2)
    shows = simulation._shows
    tab.press("0")
    until(lambda: simulation._shows == shows + 1)
    tab.page.focus("#speed")
    tab.page.keyboard.press("ArrowLeft")
    tab.page.keyboard.press("ArrowLeft")
    until(lambda: simulation.speed == 0.25)
    assert tab.ask("document.getElementById('speed-value').value") == "1/4×"


def test_the_picture_is_the_canvas(open_viewer, open_tab):
    viewer = open_viewer("terrain")
    tab = open_tab(viewer)
    for take in (lambda: tab.press("p"), lambda: tab.page.click("#screenshot")):
        with tab.page.expect_download() as download:
            take()
        with open(download.value.path(), "rb") as file:
            picture = file.read()
        assert picture.startswith(b"\x89PNG") and len(picture) > 10_000
        assert download.value.suggested_filename.startswith("terrain-")


def test_point_gravity(open_viewer, open_tab):
    viewer = open_viewer("terrain")
    tab = open_tab(viewer)
    simulation = viewer.simulation
    tab.press("g")
    until(lambda: simulation.show.point_gravity)
    until(lambda: tab.checked("gravity"))
    tab.page.click("label:has(#gravity)")
    until(lambda: simulation.show.point_gravity is False)
    # Where gravity cannot be switched, the key does nothing.
    tab.page.select_option("#show", "carpet")
    tab.until("viewer.state.show.name === 'carpet'")
    assert tab.ask("document.getElementById('gravity-row').hidden")
    tab.press("g")
    tab.settle()
    assert not simulation._note


def test_the_panel_folds(open_viewer, open_tab):
    tab = open_tab(open_viewer())
    tab.page.click("#fold")
    assert not tab.page.is_visible("#counters")
    tab.page.click("#fold")
    assert tab.page.is_visible("#counters")

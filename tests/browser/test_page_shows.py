"""Every demo and environment in the browser: selectors, policies, counters; nothing from other servers."""

import pytest

from avalanche_gym.physics.scenes.demos import DEMOS
from avalanche_gym.viewer.environment_show import environment_ids
from tests.browser.conftest import until
from tests.envs.environments import landing_policy, pushing_policy

pytestmark = pytest.mark.verify

POLICIES = {"avalanche/PushTerrain-v0": pushing_policy, "avalanche/PlanetLanding-v0": landing_policy}


class Player:
    """A policy in the form of Stable-Baselines3."""

    def __init__(self, policy):
        self.policy = policy

    def predict(self, observation, deterministic=True):
        return self.policy(observation), None


@pytest.mark.parametrize("name", [*DEMOS, *environment_ids()])
def test_every_show_runs_is_drawn_and_counts(name, open_viewer, open_tab):
    viewer = open_viewer()
    tab = open_tab(viewer)
    tab.page.select_option("#show", name)
    tab.until(f"viewer.state.show.name === '{name}'")
    until(lambda: viewer.simulation.frames > 60)
    until(lambda: int(tab.counter("frames") or 0) > 60)
    assert int(tab.counter("bodies")) >= 1
    assert tab.counter("step time") and tab.counter("solver residual") and tab.counter("energy drift")
    tab.until("viewer.handles().length >= 1")
    # Something else than sky is seen.
    colors = tab.ask(
        "{ const c = document.createElement('canvas'); c.width = c.height = 32; const x = c.getContext('2d');"
        "viewer.stage.render(1); x.drawImage(viewer.stage.canvas, 0, 0, 32, 32);"
        "return new Set(new Uint32Array(x.getImageData(0, 0, 32, 32).data.buffer)).size; }"
    )
    assert colors > 60
    assert {url.partition("?")[0].removeprefix(viewer.url) for url in tab.requests} <= {
        "",
        "page.js",
        "page.css",
        "favicon.svg",
    }


@pytest.mark.parametrize("id", POLICIES)
@pytest.mark.parametrize("level", ["easy", "medium", "hard"])
def test_a_policy_plays_live_at_every_level(id, level, open_viewer, open_tab):
    viewer = open_viewer("showcase", policies={id: Player(POLICIES[id])})
    tab = open_tab(viewer)
    tab.page.select_option("#show", id)
    tab.until(f"viewer.state.show.name === '{id}'")
    if level != "easy":
        tab.page.select_option("#level", level)
    tab.until(f"viewer.state.show.level === '{level}'")
    assert tab.ask("document.getElementById('driver').value") == "policy"
    # Fast motion; the page follows.
    tab.page.evaluate("() => { const s = document.getElementById('speed'); s.value = 2; s.oninput(); }")
    until(lambda: viewer.simulation.speed == 4.0)
    if level == "easy":
        tab.until("document.querySelector('#counters .good')?.textContent === 'success'")
    else:
        until(lambda: int(tab.counter("episode step") or 0) > 20)
    tab.page.select_option("#driver", "zero")
    until(lambda: viewer.simulation.show.driver == "zero")
    tab.page.select_option("#driver", "random")
    until(lambda: viewer.simulation.show.driver == "random")


def test_the_view_follows_until_the_user_turns_it(open_viewer, open_tab):
    viewer = open_viewer("PlanetLanding")
    tab = open_tab(viewer)
    tab.fold()
    assert tab.checked("follow")
    lander = tab.ask("viewer.handles()[0]")
    first = tab.ask("viewer.stage.camera.position.toArray()")
    tab.until(f"viewer.stage.camera.position.distanceTo({{x: {first[0]}, y: {first[1]}, z: {first[2]}}}) > 0.5")
    x, y = tab.ask(f"viewer.screenPosition({lander})")
    assert 0 < x < 640 and 0 < y < 480
    tab.page.mouse.wheel(0, 100)
    until(lambda: not tab.checked("follow"))
    tab.press("f")
    assert tab.checked("follow")
    tab.page.mouse.move(600, 60)
    tab.page.mouse.down()
    tab.page.mouse.move(500, 100, steps=4)
    tab.page.mouse.up()
    until(lambda: not tab.checked("follow"))

"""The pictures of the README and of the documentation, into ``docs/figures``.

    python -m benchmarks.figures

The page of the viewer needs Chromium; without it that one picture stays as it is.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from pathlib import Path

import gymnasium
import imageio.v3 as imageio
import numpy as np
from numpy.typing import NDArray

import avalanche_gym  # noqa: F401  (registers the ids)
from avalanche_gym.envs.base import BatchedTask
from avalanche_gym.physics.scenes.demos import DEMOS, Carpet
from avalanche_gym.rendering import Renderer, WorldView
from avalanche_gym.viewer import Viewer
from avalanche_gym.viewer.demo_show import picture_of

FOLDER = Path("docs/figures")
WIDTH, HEIGHT = 640, 420  # [pixels]
PAGE = (1180, 720)  # [pixels]
# [s] of each demo, when there is enough to see.
MOMENTS = {"showcase": 24.0, "terrain": 5.0, "carpet": 16.0, "planet": 100.0}
# Level, seed and actions of each environment: a moment that shows the task.
EPISODES: dict[str, tuple[str, int, list[list[float]]]] = {
    "PushTerrain": ("hard", 1, [[0.0, 0.0]]),
    "PlanetLanding": ("medium", 4, [[-1.0, 0.0, 0.0, 0.0]] * 4 + [[1.0, 0.0, 0.0, 0.0]]),
}


def demo_frame(name: str) -> NDArray[np.uint8]:
    """A demo after its moment."""
    demo = DEMOS[name]()
    while demo.time < MOMENTS[name]:
        demo.advance(4)
    picture = picture_of(demo)
    view = WorldView(demo.world, picture.colors, picture.geometries)
    if isinstance(demo, Carpet):
        view.set_heights(0, demo.world.heights(0))
    renderer = Renderer(WIDTH, HEIGHT, supersample=3, lighting=picture.lighting)
    return renderer.render(view, picture.camera)


def environment_frame(name: str) -> NDArray[np.uint8]:
    """An environment in the middle of its task."""
    level, seed, actions = EPISODES.get(name, ("easy", 0, []))
    env = gymnasium.make(f"avalanche/{name}-v0", level=level)
    env.reset(seed=seed)
    for action in actions:
        env.step(np.array(action, np.float32))
    task = env.unwrapped.task  # type: ignore[attr-defined]
    assert isinstance(task, BatchedTask)
    picture = task.make_picture()
    picture.renderer = Renderer(WIDTH, HEIGHT, supersample=3)
    return picture.frame(0)


def photograph_page(path: Path) -> None:
    """The page in a browser, with everything that can be laid over the picture."""
    browser_path = shutil.which("chromium")
    if browser_path is None:
        print(f"{path} stays as it is: there is no Chromium here", file=sys.stderr)
        return
    from playwright.sync_api import sync_playwright

    with Viewer(show="showcase") as viewer, sync_playwright() as playwright:
        flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=browser_path, args=flags)
        page = browser.new_page(viewport={"width": PAGE[0], "height": PAGE[1]})
        while viewer.simulation.frames < 60 * MOMENTS["showcase"]:
            time.sleep(0.1)
        page.goto(viewer.url)
        while not page.evaluate("() => viewer.ready()"):
            time.sleep(0.1)
        for key in "bcr ":
            page.keyboard.press(key)
        drawn = page.evaluate("() => viewer.state.drawn")
        while page.evaluate("() => viewer.state.drawn") < drawn + 10:
            time.sleep(0.1)
        page.screenshot(path=path)
        browser.close()


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="which to make; all unless given")
    names = parser.parse_args(arguments).names
    FOLDER.mkdir(parents=True, exist_ok=True)
    environments = [spec.name for spec in gymnasium.registry.values() if spec.namespace == "avalanche"]
    for name in [*environments, *DEMOS]:
        if not names or name in names:
            frame = demo_frame(name) if name in DEMOS else environment_frame(name)
            imageio.imwrite(FOLDER / f"{name}.png", frame, compress_level=9)
    if not names or "viewer" in names:
        photograph_page(FOLDER / "viewer.png")


if __name__ == "__main__":
    main()

"""What it costs the simulation to be watched: processor time of a frame with 100 bodies, with and without pages.

    python -m benchmarks.streaming

The pages are programs of their own that read and throw away. One frame is a step of the simulation's loop as the viewer
runs it, paced at 60 a second, so the time of the server's thread counts too; the world is not stepped, so that nothing
but streaming is measured. The least of the repeats is what a quiet machine gives.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.world import World
from avalanche_gym.rendering import BodyLooks, Camera, Lighting
from avalanche_gym.viewer import Catalogue, Viewer
from avalanche_gym.viewer.show import Show

NUM_BODIES = 100
FRAME_RATE = 60.0  # [1/s]
PAGE = """
import sys
from websockets.sync.client import connect
with connect(f"ws://127.0.0.1:{sys.argv[1]}/stream", max_size=None, compression=None) as page:
    while True:
        page.recv()
"""


class StillShow(Show):
    """Bodies on a grid that do not move."""

    name, title, description = "still", "Still", "Bodies that hang in the air."

    def __init__(self) -> None:
        scene = physics.Scene()
        shapes = [physics.Box((0.3, 0.3, 0.3)), physics.Sphere(0.3), physics.Capsule(0.2, 0.2)]
        for index in range(NUM_BODIES):
            place = (index % 10, index // 10, 1.0)
            scene.add_body(shapes[index % len(shapes)], position=place)
        self._world = World(scene)
        self._world.step()
        self.looks = BodyLooks()

    @property
    def world(self) -> World:
        return self._world

    def advance(self, speed: float) -> float:
        return 1.0 / FRAME_RATE

    def single_step(self) -> None:
        pass

    def reset(self) -> None:
        pass

    def camera(self) -> Camera:
        return Camera.orbit((4.5, 4.5, 0.0), 20.0, -60.0, 30.0)

    def lighting(self) -> Lighting:
        return Lighting()


class StillCatalogue(Catalogue):
    """Shows nothing but the bodies that do not move."""

    def open(self, name: str, level: str = "") -> Show:
        return StillShow()


def frame_time(viewer: Viewer, seconds: float) -> float:
    """[s] of processor time of a frame in this process, all threads."""
    frames, start, wall = viewer.simulation.frames, time.process_time(), time.perf_counter()
    while time.perf_counter() - wall < seconds:
        time.sleep(0.05)
    return (time.process_time() - start) / (viewer.simulation.frames - frames)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=3.0, help="of each repeat (default: 3)")
    parser.add_argument("--repeats", type=int, default=7, help="(default: 7)")
    parser.add_argument("--overlays", action="store_true", help="stream contacts and cells too")
    args = parser.parse_args(arguments)
    with Viewer(StillCatalogue()) as viewer:
        viewer.simulation.contacts_shown = viewer.simulation.cells_shown = args.overlays
        pages: list[subprocess.Popen[bytes]] = []
        try:
            for count in (0, 1, 4):
                while len(pages) < count:
                    pages.append(subprocess.Popen([sys.executable, "-c", PAGE, str(viewer.port)]))
                while len(viewer.clients) < count:
                    time.sleep(0.05)
                times = 1e3 * np.array([frame_time(viewer, args.seconds) for _ in range(args.repeats)])
                print(f"{count} pages: {np.median(times):.2f} ms a frame (least {times.min():.2f})", flush=True)
        finally:
            for page in pages:
                page.terminate()
                page.wait()


if __name__ == "__main__":
    main()

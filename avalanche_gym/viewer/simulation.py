"""The thread that runs a show at the pace it is watched, and hands a packet on after every frame.

Nothing outside this thread touches the world: what pages ask for waits in a queue until the frame is done.
"""

from __future__ import annotations

import json
import queue
import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from .catalogue import Catalogue
from .overlays import RestWatch, occupied_cells
from .show import Show
from .stream import CELL_WIDTH, CONTACT_WIDTH, FrameEncoder, Packet, contact_rows, light_message

STATUS_INTERVAL = 0.2  # [s] between two updates of the counters
IDLE_INTERVAL = 1.0 / 30.0  # [s] between frames while paused
NO_CONTACTS = np.zeros((0, CONTACT_WIDTH), np.float32)
NO_CELLS = np.zeros((0, CELL_WIDTH), np.float32)


class Simulation:
    """Runs one show at a time.

    Args:
        catalogue: of what can be shown.
        publish: called with every Packet, in the thread of the simulation; must return at once.
        name, level: of the first show.
    """

    def __init__(
        self, catalogue: Catalogue, publish: Callable[[Packet], None], name: str = "showcase", level: str = ""
    ) -> None:
        self.catalogue = catalogue
        self.publish = publish
        self.wishes: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self.outside: Callable[[], dict[str, Any]] = dict  # counters of the server
        self.watched: Callable[[], bool] = lambda: True  # whether anybody wants packets
        self.contacts_shown = self.cells_shown = False
        self.paused, self.speed = False, 1.0
        self.frames, self.steps = 0, 0
        self.step_time = 0.0  # [s] that a frame's steps take, smoothed
        self._note = ""
        self._status_at = 0.0
        self._shows = 0
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)
        self._open(name, level)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End, and wait for it."""
        self._stopping.set()
        self.wishes.put({"type": "stop"})
        if self._thread.is_alive():
            self._thread.join()

    # --- The loop -------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        due = time.perf_counter()
        while not self._stopping.is_set():
            self._grant_wishes()
            duration = IDLE_INTERVAL
            if not self.paused:
                duration = self.advance()
            if self.watched():
                self.publish(self.packet(duration))
            # A frame that took too long is not caught up with: the show runs slower instead.
            due = max(due + duration, time.perf_counter())
            self._wait(due)

    def _wait(self, due: float) -> None:
        """Until ``due``; while paused, a wish is granted at once."""
        while not self._stopping.is_set():
            left = due - time.perf_counter()
            if left <= 0.0:
                return
            if not self.paused:
                time.sleep(left)
                return
            try:
                self._grant(self.wishes.get(timeout=left))
            except queue.Empty:
                return

    def advance(self) -> float:
        """Take the show to its next frame; returns how long [s] that frame is to be watched."""
        start = time.thread_time()
        try:
            passed = self.show.advance(self.speed)
        except Exception as error:  # the page must say what happened, and go on living
            traceback.print_exc()
            self._stop_show(f"{type(error).__name__}: {error}")
            return IDLE_INTERVAL
        self.step_time += 0.05 * (time.thread_time() - start - self.step_time)
        self.frames += 1
        self._resting = self._rest.update(self.show.world, passed)
        return passed / self.speed

    def packet(self, duration: float) -> Packet:
        """The state of this moment."""
        world = self.show.world
        contacts = contact_rows(world) if self.contacts_shown else NO_CONTACTS
        cells = occupied_cells(world).astype(np.float32) if self.cells_shown else NO_CELLS
        now = time.perf_counter()
        status = ""
        if now >= self._status_at:
            self._status_at = now + STATUS_INTERVAL
            status = self.status()
        if len(self._resting) != world.num_bodies:
            self._resting = self._rest.update(world, 0.0)
        return self._encoder.encode(self._resting, duration, contacts, cells, status)

    def status(self) -> str:
        """Counters and settings for the page, as JSON."""
        show, world = self.show, self.show.world
        moving = sum(body is not None and body.motion == "dynamic" for body in world.scene.bodies)
        report = world.report()
        counters = {
            "frames": self.frames,
            "bodies": moving,
            "resting": int(self._resting.sum()),
            "contacts": int(report.contacts[0]),
            "energy": float(world.kinetic_energy()[0] + world.potential_energy()[0]),
            "energy change": show.energy_change,
            "residual": float(report.residual[0]),
            "step time": self.step_time,
        }
        settings = {
            "paused": self.paused,
            "speed": self.speed,
            "driver": show.driver,
            "pointGravity": show.point_gravity,
            "contacts": self.contacts_shown,
            "cells": self.cells_shown,
        }
        return _json(
            {
                "type": "status",
                "show": self._shows,
                "counters": counters,
                "more": show.counters(),
                "settings": settings,
                "server": self.outside(),
                "note": self._note,
            }
        )

    # --- Wishes ---------------------------------------------------------------------------------------------------

    def _grant_wishes(self) -> None:
        while True:
            try:
                wish = self.wishes.get_nowait()
            except queue.Empty:
                return
            self._grant(wish)

    def _grant(self, wish: dict[str, Any]) -> None:
        """Do what a checked message asks for; what the show refuses is told, not raised."""
        self._status_at = 0.0
        kind = wish["type"]
        try:
            if kind == "open":
                self._open(wish["show"], wish["level"])
            elif kind == "pause":
                self.paused = wish["on"]
            elif kind == "step":
                self.paused = True
                self.show.single_step()
                self.frames += 1
                self._resting = self._rest.update(self.show.world, 0.0)
            elif kind == "reset":
                self.show.reset()
                self._begin()
            elif kind == "speed":
                self.speed = wish["value"]
            elif kind == "driver":
                self.show.drive_with(wish["name"])
            elif kind == "point_gravity":
                self.show.set_point_gravity(wish["on"])
            elif kind == "kick":
                kick(self.show, wish["body"], wish["point"], wish["velocity"])
            elif kind == "overlays":
                self.contacts_shown, self.cells_shown = wish["contacts"], wish["cells"]
        except (ValueError, IndexError, RuntimeError) as error:
            self._note = str(error)

    def _open(self, name: str, level: str) -> None:
        self.show: Show = self.catalogue.open(name, level)
        self._begin()

    def _begin(self) -> None:
        """After the show began, or began anew."""
        show = self.show
        self._shows += 1
        self.frames, self.step_time, self._note = 0, 0.0, ""
        self._rest = RestWatch()
        self._resting = self._rest.update(show.world, 0.0)
        about = {
            "type": "show",
            "number": self._shows,
            "name": show.name,
            "title": show.title,
            "description": show.description,
            "level": show.level,
            "levels": show.levels,
            "drivers": show.drivers,
            "cameraMoves": show.camera_moves,
            "hasPointGravity": show.point_gravity is not None,
            "light": light_message(show.lighting()),
            "catalogue": self.catalogue.entries(),
        }
        self._encoder = FrameEncoder(show, self._shows, _json(about))

    def _stop_show(self, note: str) -> None:
        self.paused, self._note, self._status_at = True, f"{note} Reset to begin anew.", 0.0


def kick(show: Show, body: int, point: tuple[float, float, float], velocity: tuple[float, float, float]) -> None:
    """Give a body the impulse that its mass times ``velocity`` [m/s] is, at ``point`` (body frame, [m]).

    The point is that of the body, not of the world, since the body has moved on when the click arrives.
    """
    world = show.world
    bodies = world.scene.bodies
    described = bodies[body] if body < len(bodies) else None
    if described is None or described.motion != "dynamic":
        return
    q = world.orientation[0, body]
    w, axis, offset = q[0], q[1:], np.array(point)
    turned = offset + 2.0 * np.cross(axis, np.cross(axis, offset) + w * offset)
    # A point outside the body would turn a small impulse into a wild spin.
    if np.linalg.norm(offset) > 1.5 * described.shape.bounding_radius:
        return
    world.apply_impulse(body, described.mass * np.array(velocity), world.position[0, body] + turned)


def _json(value: Any) -> str:
    """JSON that every browser can read: what is not finite becomes null."""
    return json.dumps(_finite(value), separators=(",", ":"))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value

"""The web server of the viewer: the page, and a WebSocket that carries frames to it and wishes back.

It listens on 127.0.0.1 only. A page of another site may still try to reach it through the user's browser, so a request
must be addressed to this machine (which stops a foreign name that resolves to it), and a WebSocket must come from the
page that this server gave out. Files come from a table made at the start: no path of a request reaches the disk.
"""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib import resources
from typing import Any

from .catalogue import Catalogue
from .messages import MalformedMessage, parse
from .simulation import Simulation
from .stream import Packet

try:
    from websockets.asyncio.server import Server, ServerConnection, broadcast, serve
    from websockets.datastructures import Headers
    from websockets.exceptions import ConnectionClosed
    from websockets.http11 import Request, Response
except ImportError as error:
    raise ImportError('The viewer needs websockets: pip install "avalanche-gym[viewer]".') from error

HOST = "127.0.0.1"
HOST_NAMES = ("127.0.0.1", "localhost")
STREAM_PATH = "/stream"
FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/favicon.svg": ("favicon.svg", "image/svg+xml"),
}
PAGE_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}

MAX_CLIENTS = 16
MAX_MESSAGE = 2048  # [bytes] of a message from a page; a longer one ends the connection
MESSAGES_PER_SECOND = 60.0
MESSAGE_BURST = 120.0
PUNISHMENT = 0.05  # [s] that nothing more is read from a page that sends too much
# [bytes] that may wait for a page; while more does, it gets no frames. About twelve frames of 100 bodies.
MAX_WAITING = 60_000


@dataclass(eq=False)
class Client:
    """One page."""

    connection: ServerConnection
    show: int = 0  # the show it knows
    meshes: dict[int, int] = field(default_factory=dict)  # revision of each mesh it has
    status: str = ""  # the last one it got
    skipped: int = 0  # frames that it was too slow for
    allowance: float = MESSAGE_BURST  # messages it may send at once
    heard_at: float = field(default_factory=time.monotonic)

    def may_speak(self) -> bool:
        """Whether one more message keeps to the limit of the rate."""
        now = time.monotonic()
        self.allowance = min(MESSAGE_BURST, self.allowance + MESSAGES_PER_SECOND * (now - self.heard_at))
        self.heard_at = now
        if self.allowance < 1.0:
            return False
        self.allowance -= 1.0
        return True


class Viewer:
    """The viewer, running in threads of its own between ``start`` and ``stop``.

    Args:
        catalogue: of what can be shown; demos and environments without policies unless given.
        show: what to begin with, see Catalogue.full_name.
        level: of it.
        port: 0 takes any that is free.

    Attributes:
        url: of the page, once started.
        malformed: messages that meant nothing.
        refused: messages beyond the limit of the rate.
    """

    def __init__(
        self, catalogue: Catalogue | None = None, show: str = "showcase", level: str = "", port: int = 0
    ) -> None:
        self.port = port
        self.malformed = self.refused = 0
        self.clients: set[Client] = set()
        self.simulation = Simulation(catalogue or Catalogue(), self._publish, show, level)
        self.simulation.outside = self._counters
        self.simulation.watched = lambda: bool(self.clients)
        folder = resources.files(__package__) / "static"
        self._files = {path: (folder.joinpath(name).read_bytes(), kind) for path, (name, kind) in FILES.items()}
        self._latest: Packet | None = None
        self._status = ""
        self._ready = threading.Event()
        self._failure: OSError | None = None
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="server", daemon=True)

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.port}/"

    def start(self) -> None:
        """Begin.

        Raises:
            OSError: the port is taken.
        """
        self._thread.start()
        self._ready.wait()
        if self._failure is not None:
            raise OSError(f"The viewer cannot listen on {HOST}:{self.port}: {self._failure}. Give another port.")
        self.simulation.start()

    def stop(self) -> None:
        """End, and wait for it."""
        self.simulation.stop()
        self._loop.call_soon_threadsafe(self._stopping.set)
        self._thread.join()

    def wait(self) -> None:
        """Until the server ends; an interrupt gets through."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def __enter__(self) -> Viewer:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _counters(self) -> dict[str, Any]:
        return {"pages": len(self.clients), "malformed": self.malformed, "refused": self.refused}

    # --- From the simulation to the pages -------------------------------------------------------------------------

    def _publish(self, packet: Packet) -> None:
        """Called by the simulation; whatever the pages do, it returns at once."""
        if packet.status:
            self._status = packet.status
        idle = self._latest is None
        self._latest = packet
        # While one waits to be sent, a newer packet takes its place.
        if idle:
            self._loop.call_soon_threadsafe(self._send)

    def _send(self) -> None:
        packet, self._latest = self._latest, None
        if packet is not None:
            for client in self.clients:
                self._send_to(client, packet)

    def _send_to(self, client: Client, packet: Packet) -> None:
        transport = client.connection.transport
        if transport.get_write_buffer_size() > MAX_WAITING:
            client.skipped += 1
            return
        to = {client.connection}
        if client.show != packet.show:
            client.show, client.meshes = packet.show, {}
            broadcast(to, packet.about)
        for mesh in packet.meshes:
            known = client.meshes.get(mesh.number, -1)
            if known < 0:
                broadcast(to, mesh.message)
            if max(known, 0) < mesh.revision:
                broadcast(to, mesh.heights)
            client.meshes[mesh.number] = mesh.revision
        if client.status != self._status:
            client.status = self._status
            broadcast(to, self._status)
        broadcast(to, packet.frame)

    # --- From the pages to the simulation -------------------------------------------------------------------------

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._stopping = asyncio.Event()
        try:
            server: Server = await serve(
                self._talk,
                HOST,
                self.port,
                process_request=self._answer,
                compression=None,
                max_size=MAX_MESSAGE,
                server_header=None,
                close_timeout=1.0,
            )
        except OSError as error:
            self._failure = error
            self._ready.set()
            return
        self.address = next(iter(server.sockets)).getsockname()
        self.port = self.address[1]
        self._ready.set()
        async with server:
            await self._stopping.wait()

    async def _talk(self, connection: ServerConnection) -> None:
        # What the system keeps for a slow page is late too when it comes.
        connection.transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MAX_WAITING)
        client = Client(connection)
        self.clients.add(client)
        try:
            async for message in connection:
                if not client.may_speak():
                    self.refused += 1
                    # Not reading makes the sender wait: a flood costs the sender, not the simulation.
                    await asyncio.sleep(PUNISHMENT)
                    continue
                try:
                    self.simulation.wishes.put(parse(message))
                except MalformedMessage:
                    self.malformed += 1
        except ConnectionClosed:
            pass
        finally:
            self.clients.discard(client)

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """A file or a refusal; None lets the WebSocket open."""
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or hosts[0].partition(":")[0] not in HOST_NAMES:
            return _response(HTTPStatus.FORBIDDEN, b"This viewer answers to 127.0.0.1 and localhost only.\n")
        if request.path == STREAM_PATH:
            # Programs send no Origin; a browser always does, and cannot be made to lie about it.
            origins = request.headers.get_all("Origin")
            if origins and origins != [f"http://{hosts[0]}"]:
                return _response(HTTPStatus.FORBIDDEN, b"Only the viewer's own page may connect.\n")
            if len(self.clients) >= MAX_CLIENTS:
                return _response(HTTPStatus.SERVICE_UNAVAILABLE, b"Too many pages are open.\n")
            return None
        found = self._files.get(request.path.partition("?")[0])
        if found is None:
            return _response(HTTPStatus.NOT_FOUND, b"There is no such file.\n")
        return _response(HTTPStatus.OK, *found)


def _response(status: HTTPStatus, body: bytes, kind: str = "text/plain; charset=utf-8") -> Response:
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(body)), "Connection": "close", **PAGE_HEADERS})
    return Response(status.value, status.phrase, headers, body)

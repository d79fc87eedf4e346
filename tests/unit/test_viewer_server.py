"""The server without a browser: files, Origin and Host, floods, slow pages; and the frames it sends."""

import json
import socket
import struct
import time
import urllib.error
import urllib.request

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from avalanche_gym.viewer import Catalogue, Viewer, server
from avalanche_gym.viewer.stream import CELL_WIDTH, CONTACT_WIDTH, FRAME, HEIGHTS, MESH, PUSHABLE, ROW_WIDTH

PATIENCE = 60.0  # [s] for what takes milliseconds on a machine that is not busy


@pytest.fixture
def viewer():
    with Viewer(show="showcase") as running:
        yield running


def stream(viewer, **options):
    # A page that does not read does not hear the answer to its goodbye.
    options = {"max_size": None, "compression": None, "close_timeout": 0.2, **options}
    return connect(f"ws://127.0.0.1:{viewer.port}/stream", **options)


def until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def next_message(page, wanted):
    """The next message for which ``wanted`` is true."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        message = page.recv(timeout=PATIENCE)
        value = json.loads(message) if isinstance(message, str) else message
        if wanted(value):
            return value
    raise AssertionError("no such message")


def is_kind(kind):
    return lambda message: isinstance(message, bytes) and struct.unpack_from("<I", message)[0] == kind


def status_where(condition):
    return lambda message: isinstance(message, dict) and message["type"] == "status" and condition(message)


def rows_of(frame):
    _, _, _, rows, contacts, cells = struct.unpack_from("<6I", frame)
    floats = np.frombuffer(frame, "<f4", offset=24)
    assert len(floats) == 14 + rows * ROW_WIDTH + contacts * CONTACT_WIDTH + cells * CELL_WIDTH
    return floats[14 : 14 + rows * ROW_WIDTH].reshape(rows, ROW_WIDTH)


def get(viewer, path, host=None):
    request = urllib.request.Request(f"http://127.0.0.1:{viewer.port}{path}")
    if host:
        request.add_header("Host", host)
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return answer.status, answer.headers, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.headers, error.read()


def test_it_gives_out_the_page_and_nothing_else(viewer):
    for path in server.FILES:
        status, headers, body = get(viewer, path)
        assert status == 200 and len(body) > 100
        assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert get(viewer, "/?shadows=off")[0] == 200
    for path in ("/server.py", "/../server.py", "/static/page.js", "/%2e%2e/server.py", "//etc/passwd", "/page.js/"):
        status, _, body = get(viewer, path)
        assert status == 404 and b"import" not in body


def test_it_listens_on_this_machine_only_and_answers_to_its_names(viewer):
    port = viewer.port
    assert viewer.address == ("127.0.0.1", port)
    assert get(viewer, "/", f"localhost:{port}")[0] == 200
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1.evil.example", ""):
        assert get(viewer, "/", host or "x")[0] == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1:{port}", "http://127.0.0.1:1"])
def test_a_foreign_origin_is_refused(viewer, origin):
    with pytest.raises(InvalidStatus) as refusal:
        stream(viewer, origin=origin.format(port=viewer.port))
    assert refusal.value.response.status_code == 403


def test_its_own_page_and_programs_may_connect(viewer):
    for options in ({}, {"origin": f"http://127.0.0.1:{viewer.port}"}):
        with stream(viewer, **options) as page:
            next_message(page, is_kind(FRAME))


def test_a_page_learns_the_show_then_meshes_then_frames(viewer):
    with stream(viewer) as page:
        show = json.loads(page.recv(timeout=PATIENCE))
        assert show["type"] == "show" and show["name"] == "showcase"
        names = [entry["name"] for entry in show["catalogue"]]
        assert {"showcase", "terrain", "carpet", "planet", "avalanche/PushTerrain-v0"} <= set(names)
        assert is_kind(MESH)(page.recv(timeout=PATIENCE))
        frame = next_message(page, is_kind(FRAME))
        rows = rows_of(frame)
        world = viewer.simulation.show.world
        assert rows[0, 0] == 0.0 and rows[0, 4] != PUSHABLE
        np.testing.assert_array_equal(rows[0, 5:8], world.position[0, 0].astype(np.float32))
        status = next_message(page, status_where(lambda status: status["counters"]["bodies"] >= 1))
        expected = ("frames", "bodies", "resting", "contacts", "energy", "energy change", "residual", "step time")
        assert set(status["counters"]) == set(expected)


def test_the_carpet_sends_its_heights():
    with Viewer(show="carpet") as viewer, stream(viewer) as page:
        message = next_message(page, is_kind(HEIGHTS))
        heights = np.frombuffer(message, "<f4", offset=8)
        assert heights.size == 61 * 61 and np.ptp(heights) > 1.0


def test_wishes_are_granted(viewer):
    with stream(viewer) as page:

        def wish(type, **fields):
            page.send(json.dumps({"type": type, **fields}))

        wish("pause", on=True)
        next_message(page, status_where(lambda status: status["settings"]["paused"]))
        frames = viewer.simulation.frames
        wish("step")
        until(lambda: viewer.simulation.frames == frames + 1)
        world = viewer.simulation.show.world
        before = world.linear_velocity[0, 1].copy()
        mass = world.scene.bodies[1].mass
        wish("kick", body=1, point=[0.0, 0.0, 0.0], velocity=[0.0, 3.0, 0.0])
        until(lambda: not np.array_equal(world.linear_velocity[0, 1], before))
        np.testing.assert_allclose(world.linear_velocity[0, 1] - before, (0.0, 3.0, 0.0), atol=1e-12)
        assert mass > 0.0
        wish("speed", value=0.25)
        next_message(page, status_where(lambda status: status["settings"]["speed"] == 0.25))
        wish("overlays", contacts=True, cells=True)
        frame = next_message(page, lambda m: is_kind(FRAME)(m) and struct.unpack_from("<6I", m)[5] > 0)
        assert len(rows_of(frame)) == 2
        wish("open", show="nowhere", level="")
        next_message(page, status_where(lambda status: "nowhere" in status["note"]))
        wish("open", show="avalanche/PlanetLanding-v0", level="medium")
        show = next_message(page, lambda m: isinstance(m, dict) and m["type"] == "show")
        assert show["name"] == "avalanche/PlanetLanding-v0" and show["level"] == "medium"
        wish("driver", name="zero")
        next_message(page, status_where(lambda status: status["settings"]["driver"] == "zero"))
        wish("pause", on=False)
        next_message(page, status_where(lambda status: status["more"]["episode step"] > 3))
        wish("reset")
        next_message(page, lambda m: isinstance(m, dict) and m["type"] == "show")


def test_kicks_at_bodies_that_are_not_there_do_nothing(viewer):
    with stream(viewer) as page:
        for body, point in ((0, [0, 0, 0]), (7000, [0, 0, 0]), (1, [50, 0, 0])):
            page.send(json.dumps({"type": "kick", "body": body, "point": point, "velocity": [1, 0, 0]}))
        frames = viewer.simulation.frames
        until(lambda: viewer.simulation.frames > frames + 5)


def test_malformed_messages_are_ignored_and_counted(viewer):
    with stream(viewer) as page:
        for message in ("nonsense", b"\x00\x01", '{"type": "erase"}', '{"type": "pause", "on": "yes"}'):
            page.send(message)
        next_message(page, status_where(lambda status: status["server"]["malformed"] == 4))
        assert not viewer.simulation.paused


def test_a_message_that_is_too_long_ends_the_connection(viewer):
    with stream(viewer) as page:
        page.send("x" * (server.MAX_MESSAGE + 1))
        with pytest.raises(ConnectionClosed) as closed:
            next_message(page, lambda message: False)
        assert closed.value.rcvd.code == 1009


def test_a_flood_is_refused_and_does_not_stop_the_others(viewer):
    with stream(viewer) as page, stream(viewer) as other:
        for _ in range(round(server.MESSAGE_BURST) + 30):
            page.send('{"type": "speed", "value": 1}')
        until(lambda: viewer.refused > 0)
        other.send(json.dumps({"type": "pause", "on": True}))
        next_message(other, status_where(lambda status: status["settings"]["paused"]))


def test_pages_beyond_the_limit_are_turned_away(viewer, monkeypatch):
    monkeypatch.setattr(server, "MAX_CLIENTS", 1)
    with stream(viewer) as page:
        next_message(page, is_kind(FRAME))
        with pytest.raises(InvalidStatus) as refusal:
            stream(viewer)
        assert refusal.value.response.status_code == 503


def test_a_page_that_stops_reading_misses_frames_and_costs_nothing(viewer):
    with stream(viewer) as reader, socket.create_connection(("127.0.0.1", viewer.port)) as sleeper:
        sleeper.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
        head = f"GET /stream HTTP/1.1\r\nHost: 127.0.0.1:{viewer.port}\r\n"
        sleeper.sendall(f"{head}Upgrade: websocket\r\nConnection: Upgrade\r\n{key}\r\n".encode())
        until(lambda: len(viewer.clients) == 2)
        # Frames of this show are small: a larger one fills the buffers of the system sooner.
        reader.send(json.dumps({"type": "open", "show": "carpet", "level": ""}))
        until(lambda: any(client.skipped > 3 for client in viewer.clients))
        frames = viewer.simulation.frames
        until(lambda: viewer.simulation.frames > frames + 30)
        next_message(reader, is_kind(FRAME))
        waiting = [client.connection.transport.get_write_buffer_size() for client in viewer.clients]
        # One frame with its meshes may go beyond the limit, no more.
        assert max(waiting) < 20 * server.MAX_WAITING


def test_a_show_that_fails_says_so_and_can_be_reset(viewer, monkeypatch):
    show = viewer.simulation.show

    def fail(speed):
        raise RuntimeError("the ground opened")

    with stream(viewer) as page:
        monkeypatch.setattr(show, "advance", fail)
        next_message(page, status_where(lambda status: "the ground opened" in status["note"]))
        monkeypatch.undo()
        page.send('{"type": "reset"}')
        page.send('{"type": "pause", "on": false}')
        next_message(page, status_where(lambda status: not status["note"] and status["counters"]["frames"] > 3))


def test_a_port_that_is_taken_is_named(viewer):
    with pytest.raises(OSError, match=f"{viewer.port}.*another port"):
        Viewer(port=viewer.port).start()


def test_shows_have_short_names_and_unknown_ones_are_refused():
    catalogue = Catalogue()
    for name in ("PushTerrain", "PushTerrain-v0", "avalanche/PushTerrain-v0"):
        assert catalogue.full_name(name) == "avalanche/PushTerrain-v0"
    with pytest.raises(ValueError, match="nowhere.*showcase"):
        catalogue.open("nowhere")
    with pytest.raises(ValueError, match="no levels"):
        catalogue.open("terrain", "hard")
    with pytest.raises(ValueError, match="'impossible'"):
        catalogue.open("PushTerrain", "impossible")
    with pytest.raises(ValueError, match="Nothing-v0"):
        Catalogue({"avalanche/Nothing-v0": None})

"""The search for the instant of an impact: the way it looks along, and how often it asks the narrow phase."""

import ctypes

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.events.approach import gap_there
from avalanche_gym.physics.integrator.way import place_at
from avalanche_gym.physics.model import BETWEEN, BODY, BODY_STATE, CONTACT, DYNAMIC, FIELD, ON_B
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene
from tests.unit.test_answers import states_of_two

BOUND = np.int64(1)


def test_velocity_on_the_way_is_the_derivative_of_the_place():
    """Of a struck step as well, whose final velocity moves the body all the time (it was that of a smooth one)."""
    span = 0.01
    body = np.zeros(1, BODY)[0]
    body["motion"] = DYNAMIC
    ends = np.zeros(2, BODY_STATE)
    ends["orientation"][:, 0] = 1.0
    ends["velocity"][0] = (0.5, 0.0, -1.0)
    ends["velocity"][1] = (0.4, 0.1, 0.0)
    ends["center"][1] = span * ends["velocity"][1]
    out = np.zeros(3, BODY_STATE)
    places = (0.003, 0.0035, 0.004)
    for number, instant in enumerate(places):
        place_at(body, np.zeros(0, FIELD), ends[0], ends[1], BOUND, instant, span, out[number])
    # The way is a parabola: its central difference is exact.
    slope = (out["center"][2] - out["center"][0]) / (places[2] - places[0])
    np.testing.assert_allclose(out["velocity"][1], slope, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("frame", [ON_B, BETWEEN])
def test_gap_of_a_contact_that_is_followed(frame):
    """A ball that falls past the side of a body, and one that passes another ball, with the closed forms of both."""
    here, there = states_of_two(), states_of_two()
    here["center"] = (0.0, 0.0, 0.5), (0.0, 0.0, 0.0)
    there["center"] = (0.2, 0.0, 0.4), (0.0, 0.0, 0.0)
    there["velocity"][0] = (2.0, 0.0, -1.0)
    contact = np.zeros(1, CONTACT)[0]
    contact["frame"] = frame
    contact["radius_a"], contact["radius_b"] = 0.1, 0.1 if frame == BETWEEN else 0.0
    contact["normal"] = (0.0, 0.0, -1.0)
    contact["gap"] = 0.3 if frame == BETWEEN else 0.4
    contact["position"] = (0.0, 0.0, 0.25 if frame == BETWEEN else 0.2)
    gap, closing = gap_there(contact, here[0], there[0], here[1], there[1])
    if frame == BETWEEN:
        distance = np.hypot(0.2, 0.4)
        assert gap == pytest.approx(distance - 0.2, abs=1e-15)
        assert closing == pytest.approx((0.4 * 1.0 - 0.2 * 2.0) / distance, abs=1e-14)
    else:
        assert gap == pytest.approx(0.3, abs=1e-15)
        assert closing == pytest.approx(1.0, abs=1e-15)


def test_a_search_asks_about_once():
    """What a step costs where impacts are located: 0 asks for its start, which is known, and one for the instant."""
    world = physics.World(push_scene(), num_worlds=4, options=physics.Options(time_step=PUSH_STEP, sleeping=False))
    header = world._storage.header[0]
    pairs = world._storage.arrays["pair_functions"]
    counts = {"searches": 0, "asks": 0}
    inside = []
    kept = []

    def watch(address, arguments, before):
        kind = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * arguments)
        original = kind(int(address))

        def watched(*values):
            before()
            inside.append(arguments)
            result = original(*values)
            inside.pop()
            return result

        kept.append((original, kind(watched)))
        return ctypes.cast(kept[-1][1], ctypes.c_void_p).value

    def note_search():
        counts["searches"] += 1

    def note_ask():
        counts["asks"] += bool(inside)

    header["find_impact_time"] = watch(header["find_impact_time"], 4, note_search)
    for number in np.flatnonzero(pairs):
        pairs[number] = watch(pairs[number], 2, note_ask)
    pushes = push_impulses(np.random.default_rng(0), 30 * 4).reshape(30, 4, 3)
    for push in pushes:
        world.impulse_buffer[:, PUSHED, :3] = push
        world.step(PUSH_STEPS)
    assert counts["searches"] > 300
    assert counts["asks"] < 1.6 * counts["searches"]  # 4 when each instant on the way was asked about


def test_a_facet_that_springs_up_under_a_corner_is_struck_once():
    """A corner that has sunk in by 1e-7 m comes over a facet that it strikes with that overlap.

    The impact was set to the instant before, where it is not to be seen, and found again until the step had no parts
    left: 32 impacts and 6 ms, once in two thousand steps of a box that is pushed over hills.
    """
    line = 0.25 * np.arange(-64, 65)
    x, y = np.meshgrid(line, line)
    heights = 0.15 * np.sin(1.3 * x) * np.cos(1.1 * y) + 0.05 * np.sin(3.1 * x + 2.3 * y)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.HeightField(heights, (32.0, 32.0)), motion="static")
    box = scene.add_body(physics.Box((0.2, 0.2, 0.2)), mass=2.0, position=(-0.4, 0.3, 0.7))
    world = physics.World(scene, options=physics.Options(time_step=0.005, sleeping=False))
    rng = np.random.default_rng(0)
    world.step(100)
    most = 0
    for step in range(2000):
        if step % 4 == 0:
            world.apply_impulse(box, (*rng.normal(scale=0.8, size=2), 0.0))
        if step % 200 == 0:
            world.reset()
            world.step(100)
        world.step()
        assert world.report().event_limit[0] == 0
        most = max(most, int(world.report().events[0]))
    assert most < 10

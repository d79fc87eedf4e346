"""A nut on an upright bolt: it holds above its self-locking friction, and sinks by a lead a turn below, of any size."""

import math

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes.case import GRAVITY
from avalanche_gym.physics.shapes.thread import Thread, bolt, nut

RATE = 240  # [1/s]


def thread_of(radius, lead=0.4):
    """A thread with ``lead`` in radii."""
    return Thread(radius, lead * radius, 0.5 * lead * radius)


def let_go(thread, friction, seconds):
    """Lead as it turned out, against that of the thread; turns; the world in the end; and impacts a step."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    steel = physics.Material(friction=friction)
    scene.add_body(bolt(thread, 10), motion="static", material=steel)
    ring = nut(thread, 2, clearance=0.02 * thread.radius)
    scene.add_body(ring, density=7800.0, position=(0.0, 0.0, 5.0 * thread.pitch), material=steel)
    world = physics.World(scene)
    steps = round(seconds * RATE)
    angles, heights = np.zeros(steps), np.zeros(steps)
    events = 0
    for step in range(steps):
        world.step(1)
        w, z = world.orientation[0, 1, [0, 3]]
        angles[step] = 2.0 * math.atan2(z, w)
        heights[step] = world.position[0, 1, 2]
        assert world.report().penetration[0] < 1e-3 * thread.radius
        events += world.report().events[0]
    turns = np.unwrap(angles) / (2.0 * math.pi)
    settled = steps // 4  # it has fallen through the play
    turned = turns[settled] - turns[-1]
    sunk = (heights[settled] - heights[-1]) / thread.pitch
    return sunk / turned if turned > 0.0 else math.nan, turned, world, events / steps


def test_a_nut_screws_down_below_its_self_locking_friction_and_holds_above():
    thread = thread_of(0.01)
    lead, turned, _, impacts = let_go(thread, 0.9 * thread.self_locking_friction, 0.4)
    assert turned > 0.03
    assert impacts < 0.5  # it touches at hundreds of places, and is not stopped at each while it is slow
    assert lead == pytest.approx(1.0, abs=0.02)
    _, turned, world, _ = let_go(thread, 1.1 * thread.self_locking_friction, 0.4)
    assert turned == 0.0
    assert not world.linear_velocity[0, 1].any() and not world.angular_velocity[0, 1].any()


@pytest.mark.verify
@pytest.mark.parametrize("radius", [0.003, 0.03, 0.3])
@pytest.mark.parametrize("lead", [0.2, 0.6])
def test_nuts_of_all_sizes_hold_or_turn_by_their_friction(radius, lead):
    thread = thread_of(radius, lead)
    # What is left of the notches that facets lie in, as a part of the friction (shapes/thread.py), twice.
    notch = 2.0 * math.pi**2 * math.tan(thread.flank) / (48 * lead) / 16
    for share in (0.5, 1.0 - 2.0 * notch):
        # Long enough that the play it has fallen through is a hundredth of what it sinks.
        found, turned, _, _ = let_go(thread, share * thread.self_locking_friction, 0.5)
        assert turned > 0.0
        assert found == pytest.approx(1.0, abs=0.02)
    for share in (1.0 + 2.0 * notch, 1.5):
        _, turned, world, _ = let_go(thread, share * thread.self_locking_friction, 0.5)
        assert turned == 0.0
        assert not world.angular_velocity[0, 1].any()


@pytest.mark.verify
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_nut_begins_to_turn_as_fast_as_its_equations_say(share):
    """On flanks at angle a across the helix, at the radius r with lead angle l, the normal forces N and friction m give

    m z'' = N (cos a cos l + m sin l) - m g,    I t'' = r N (cos a sin l - m cos l),    z'' = -r tan l t''.
    """
    thread = thread_of(0.03)
    friction = share * thread.self_locking_friction
    solid = nut(thread, 2, clearance=0.02 * thread.radius).mass_properties()
    inertia = solid.inertia[2, 2] / solid.volume
    rise = thread.pitch / (2.0 * math.pi * thread.radius)
    turn = math.atan(rise)
    lean = math.cos(math.atan(math.tan(thread.flank) * math.cos(turn)))
    drive = lean * math.sin(turn) - friction * math.cos(turn)
    drive /= lean * math.cos(turn) + friction * math.sin(turn)
    faster = thread.radius * GRAVITY * drive / (inertia + thread.radius**2 * rise * drive)
    seconds = 0.25
    _, _, world, _ = let_go(thread, friction, seconds)
    # It falls through the play first, and turns over facets: less by the time of the fall, and a little more.
    play = math.sqrt(2.0 * 0.06 * thread.pitch / GRAVITY)
    assert 0.95 * (seconds - play) < -world.angular_velocity[0, 1, 2] / faster < seconds

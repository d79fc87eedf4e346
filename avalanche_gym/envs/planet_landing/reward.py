"""What PlanetLanding rewards: a potential that grows towards standing still on the ground, and how it ends.

shaping   increase of the potential since the last step: lower, closer to the velocity that suits the altitude, more
          upright and with less spin, closer to the site if there is one, and more feet on the ground; a crash earns
          none of it, or slamming down, which stops and brings all feet to the ground at once, would pay half of itself
fuel      minus what was burnt
time      minus a little for each step, so that hovering does not pay
rest      for each control step of a rest, taken back when the rest is broken
success   once
crash     once, when the lander touches too fast or topples
escape    once, when it leaves the planet
"""

from __future__ import annotations

import math

from ...physics.jit import kernel
from ...physics.maths import vec3
from .dynamics import feet_down, is_resting, tilt_of
from .observation import way_to_site

TERMS = ("shaping", "fuel", "time", "rest", "success", "crash", "escape")

ALTITUDE = 1.0  # [1/m]
VELOCITY = 2.0  # [s/m]
TILT = 3.0  # [1/rad] at the ground. Linear: a square has no slope where a lander begins to lean on two of its feet
SPIN = 0.5  # [s/rad]
SITE = 0.5  # [1/m]
FOOT = 2.0  # for each foot on the ground
FUEL = -0.05  # [s/m]
TIME = -0.03
REST = 0.3
SUCCESS = 15.0
CRASH = -10.0
ESCAPE = -10.0

# The descent that suits an altitude: this many m/s a metre, between two speeds.
DESCENT_RATE = 0.35  # [1/s]
DESCENT_SLOWEST = 0.3  # [m/s]
DESCENT_FASTEST = 1.5  # [m/s]
TILT_ALTITUDE = 3.0  # [m] above this the tilt counts half: braking needs it

ESCAPE_ALTITUDE = 20.0  # [m]
REST_STEPS = 10  # control steps: one second


@kernel
def potential_of(lane, position, orientation, velocity, spin):
    """Grows towards rest, upright, with all feet on the ground, at the site."""
    up = vec3.normalize(position)
    altitude = max(lane.altitude, 0.0)
    descent = min(max(DESCENT_RATE * altitude, DESCENT_SLOWEST), DESCENT_FASTEST)
    if lane.touching == 1:
        descent = 0.0
    miss = vec3.norm(vec3.add_scaled(velocity, descent, up))
    tilt = math.acos(min(max(tilt_of(position, orientation), -1.0), 1.0))
    lean = tilt * TILT_ALTITUDE / (TILT_ALTITUDE + altitude)
    distance = vec3.norm(way_to_site(lane, up))
    cost = ALTITUDE * altitude + VELOCITY * miss + TILT * lean + SPIN * vec3.norm(spin) + SITE * distance
    return FOOT * feet_down(lane) - cost


@kernel
def judge_lane(lane, terms, position, orientation, velocity, spin):
    """Write the terms of a control step; return their sum, whether the episode is over, and whether it is a success."""
    before, rested = lane.potential, lane.rest
    lane.potential = potential_of(lane, position, orientation, velocity, spin)
    resting = is_resting(lane, position, orientation, spin)
    if lane.site_radius > 0.0:
        resting = resting and vec3.norm(way_to_site(lane, vec3.normalize(position))) < lane.site_radius
    lane.rest = rested + 1 if resting else 0
    crashed = lane.crashed == 1
    escaped = lane.altitude > ESCAPE_ALTITUDE
    success = lane.rest >= REST_STEPS and not crashed
    gained = lane.potential - before
    terms[0] = min(gained, 0.0) if crashed else gained
    terms[1] = FUEL * lane.burnt
    terms[2] = TIME
    terms[3] = REST * (lane.rest - rested)
    terms[4] = SUCCESS if success else 0.0
    terms[5] = CRASH if crashed else 0.0
    terms[6] = ESCAPE if escaped else 0.0
    total = 0.0
    for term in range(terms.shape[0]):
        total += terms[term]
    return total, success or crashed or escaped, success

"""A disc without friction or rebound on a track of straight pieces, from event to event in closed form.

The centre moves on the curve at one radius from the track: straight pieces, which meet at a corner where the track
bends up. There the velocity into the next piece is lost, so the speed is multiplied by the cosine of the kink.
"""

import math

import numpy as np

GRAVITY = 9.81


def corners_of(x, z, radius):
    """Where the centre is at the ends of the pieces (n, 2) [m], and the slopes of these (n - 1,) [rad]; kinks go up."""
    slopes = np.arctan2(np.diff(z), np.diff(x))
    normals = np.stack([-np.sin(slopes), np.cos(slopes)], axis=1)
    points = np.stack([x, z], axis=1)
    corners = [points[0] + radius * normals[0]]
    for k in range(1, len(slopes)):
        middle = normals[k - 1] + normals[k]
        corners.append(points[k] + 2.0 * radius * middle / (middle @ middle))
    return np.array([*corners, points[-1] + radius * normals[-1]]), slopes


def first_arrival(distance, speed, acceleration):
    """Least t > 0 at which speed t + acceleration t^2 / 2 = distance and the way there is in that direction."""
    best = math.inf
    for t in np.roots([0.5 * acceleration, speed, -distance]):
        if abs(t.imag) < 1e-12 and t.real > 1e-12 and (speed + acceleration * t.real) * distance >= 0.0:
            best = min(best, t.real)
    return best


def slide(x, z, radius, times):
    """Place and velocity (n, 4) of the centre, released in the middle of the first piece."""
    corners, slopes = corners_of(x, z, radius)
    along = np.stack([np.cos(slopes), np.sin(slopes)], axis=1)
    piece, place, speed, clock = 0, 0.5 * (corners[0] + corners[1]), 0.0, 0.0
    found = []
    for time in times:
        while True:
            u, acceleration = along[piece], -GRAVITY * math.sin(slopes[piece])
            # An end on which it stands is left at once; it comes back to it when its speed has turned.
            waits = []
            for end in (0, 1):
                distance = (corners[piece + end] - place) @ u
                back = -2.0 * speed / acceleration
                at_end = abs(distance) < 1e-13
                waits.append(
                    (back if back > 0.0 else math.inf) if at_end else first_arrival(distance, speed, acceleration)
                )
            end = int(np.argmin(waits))
            if time <= clock + waits[end]:
                t = time - clock
                found.append(
                    [*(place + u * (speed * t + 0.5 * acceleration * t * t)), *(u * (speed + acceleration * t))]
                )
                break
            clock += waits[end]
            velocity = u * (speed + acceleration * waits[end])
            place = corners[piece + end]
            piece += 1 if end == 1 else -1
            speed = velocity @ along[piece]
    return np.array(found)

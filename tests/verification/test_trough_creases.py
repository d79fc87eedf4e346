"""A ball without friction slides across the creases of a trough of facets: at each it keeps the cosine of the kink.

With e = 0 the ball loses its velocity into the facet it meets, and nothing else: the true motion is a constant
acceleration on each facet, with speed times cos(kink) where two facets meet.
"""

import math

import numpy as np
import pytest

from avalanche_gym import physics

GRAVITY = 9.81
# Name: heights [m] along x, spacing [m], radius of the ball [m], where along the first facet it starts, [m/s].
TROUGHS = {
    "parabola": (np.linspace(-1.0, 1.0, 9) ** 2, 0.5, 0.1, 0.5, 0.0),
    "fine parabola": (np.linspace(-1.0, 1.0, 25) ** 2, 0.2, 0.05, 0.3, 0.0),
    "valley": (np.array([1.0, 0.0, 1.3]), 2.0, 0.2, 0.4, 0.0),
    "uneven": (np.array([1.0, 0.55, 0.2, 0.0, 0.05, 0.3, 0.7, 1.3]), 0.4, 0.08, 0.7, 1.0),
    "small": (0.01 * np.linspace(-1.0, 1.0, 9) ** 2, 0.005, 0.001, 0.5, 0.0),
}


def track(heights, spacing, radius):
    """Corners (n, 2) [m] of the path of the ball's centre in x and z, and the slopes (n - 1,) [rad] of its pieces."""
    x = spacing * (np.arange(len(heights)) - 0.5 * (len(heights) - 1))
    slopes = np.arctan2(np.diff(heights), spacing)
    corners = []
    for k in range(len(heights)):
        left, right = slopes[max(k - 1, 0)], slopes[min(k, len(slopes) - 1)]
        middle, offset = 0.5 * (left + right), radius / math.cos(0.5 * (right - left))
        corners.append((x[k] - offset * math.sin(middle), heights[k] + offset * math.cos(middle)))
    return np.array(corners), slopes


def first_time(distance, speed, acceleration):
    """Smallest t > 0 with speed t + acceleration t^2 / 2 = distance, or infinity."""
    roots = np.roots([0.5 * acceleration, speed, -distance]) if acceleration else np.array([distance / speed])
    after = [root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 1e-9]
    return min(after, default=math.inf)


def true_motion(corners, slopes, start, speed, seconds):
    """Place along the track (x, z) [m] and speed [m/s] at the end, and how many creases were crossed."""
    piece, along, left, crossed = 0, start * np.linalg.norm(corners[1] - corners[0]), seconds, 0
    while True:
        length = np.linalg.norm(corners[piece + 1] - corners[piece])
        acceleration = -GRAVITY * math.sin(slopes[piece])
        waits = [first_time(length - along, speed, acceleration), first_time(-along, speed, acceleration)]
        wait = min(waits)
        if wait >= left:
            direction = np.array([math.cos(slopes[piece]), math.sin(slopes[piece])])
            place = corners[piece] + direction * (along + speed * left + 0.5 * acceleration * left**2)
            return place, speed + acceleration * left, crossed
        step = 1 if waits[0] < waits[1] else -1
        speed = (speed + acceleration * wait) * math.cos(slopes[piece + step] - slopes[piece])
        piece, left, crossed = piece + step, left - wait, crossed + 1
        along = 0.0 if step == 1 else np.linalg.norm(corners[piece + 1] - corners[piece])


@pytest.mark.parametrize("kind", ["field", "mesh"])
@pytest.mark.parametrize("rate", [60, 240])
@pytest.mark.parametrize("name", TROUGHS)
def test_speed_keeps_the_cosine_of_each_kink(name, rate, kind):
    heights, spacing, radius, start, speed = TROUGHS[name]
    scale = spacing / 0.5
    seconds = 5.0 * math.sqrt(min(scale, 1.0))
    seconds = round(seconds * rate) / rate
    corners, slopes = track(heights, spacing, radius)
    size = (spacing * (len(heights) - 1), 4.0 * spacing)
    samples = np.tile(heights, (5, 1))
    shape = physics.HeightField(samples, size)
    if kind == "mesh":
        x, y = np.meshgrid(np.linspace(-0.5, 0.5, len(heights)) * size[0], np.linspace(-0.5, 0.5, 5) * size[1])
        vertices = np.stack([x.ravel(), y.ravel(), samples.ravel()], axis=1)
        cells = (len(heights) * np.arange(4)[:, None] + np.arange(len(heights) - 1)).ravel()
        a, b, c, d = cells, cells + 1, cells + len(heights) + 1, cells + len(heights)
        shape = physics.TriangleMesh(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    ice = physics.Material(friction=0.0)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(shape, motion="static", material=ice)
    place = corners[0] + start * (corners[1] - corners[0])
    ball = scene.add_body(
        physics.Sphere(radius), mass=1.0, position=(place[0], 0.1 * spacing, place[1]), material=ice,
        linear_velocity=(speed * math.cos(slopes[0]), 0.0, speed * math.sin(slopes[0])),
    )  # fmt: skip
    world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
    world.step(round(seconds * rate))
    truth, true_speed, crossed = true_motion(corners, slopes, start, speed, seconds)
    assert crossed >= 3
    actual = np.linalg.norm(world.linear_velocity[0, ball])
    unit = math.sqrt(GRAVITY * spacing)
    assert actual == pytest.approx(abs(true_speed), abs=1e-6 * unit)
    np.testing.assert_allclose(world.position[0, ball, ::2], truth, rtol=0.0, atol=1e-6 * spacing)

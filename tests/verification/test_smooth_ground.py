"""Bodies on smooth height fields through the World: at rest, sliding, on ground that moves."""

import numpy as np
import pytest

from avalanche_gym import physics

SIZE = (4.0, 4.0)
LINE = np.linspace(-2.0, 2.0, 33)
SMOOTH_ICE = physics.Material(friction=0.0)


def world_on(heights, bodies, motion="static", material=SMOOTH_ICE, num_worlds=1, **options):
    """A world with a smooth field (handle 0) and bodies [(shape, position, more)]."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.HeightField(heights, SIZE, surface="smooth"), motion=motion, material=material)
    for shape, position, more in bodies:
        scene.add_body(shape, position=position, material=material, **{"mass": 1.0, **more})
    return physics.World(scene, num_worlds, physics.Options(**options))


@pytest.mark.parametrize("start", range(6))
def test_bodies_with_corners_come_to_rest_in_a_hollow_and_a_cylinder_nearly(start):
    """A cylinder that stands there may go on rocking by some 1e-5 m on its rim: docs/smooth_ground.md."""
    heights = 0.1 * (LINE[:, None] ** 2 + LINE**2)
    rough = physics.Material(friction=0.8)
    cube = physics.Box((0.1, 0.1, 0.1))
    hull = physics.ConvexHull(np.random.default_rng(1).normal(size=(12, 3)) * 0.12)
    pair = physics.Compound([(cube, (-0.15, 0, 0), (1, 0, 0, 0)), (cube, (0.15, 0, 0), (1, 0, 0, 0))])
    shapes = (cube, hull, pair, physics.Cylinder(0.1, 0.05))
    places = np.array([(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)])
    if start:
        places += np.random.default_rng(start).uniform(-0.1, 0.1, places.shape)
    bodies = [(shape, (*place, 0.4), {}) for shape, place in zip(shapes, places, strict=True)]
    world = world_on(heights, bodies, material=rough)
    world.step(600)
    assert np.abs(world.linear_velocity[0, 1:4]).max() < 1e-9
    assert np.abs(world.linear_velocity[0, 4]).max() < 5e-3
    assert world.report().penetration[0] < 1e-6
    assert world.features.modelled.count("smooth height fields") == 1
    # Warm started: the solution of the last step answers this one.
    assert len(world.contacts()) >= 12
    before = world.position.copy()
    world.step(60)
    np.testing.assert_allclose(world.position[0, :4], before[0, :4], atol=1e-9)
    np.testing.assert_allclose(world.position[0, 4], before[0, 4], atol=1e-3)


@pytest.mark.parametrize(("curvature", "tilt"), [(1.0, 0.01), (0.5, 0.005), (2.0, 0.01)])
def test_a_cylinder_that_stands_in_a_valley_rocks_as_in_closed_form(curvature, tilt):
    """Over z = a x^2 a cap of radius r, tilted by phi about the x axis, touches with the two points of its rim at
    sin(angle) = phi / (2 a r) from that axis, and its middle is a r^2 + phi^2 / (4 a) high. They roll around the rim by
    far more than it tilts, and take no energy: with the half length l and J about the middle of the cap

        J phi'' = -m (g / (2 a) - g l) phi,    J = m (r^2 / 4 + l^2 / 3 + l^2).
    """
    radius, half_length, rate = 0.1, 0.05, 480
    line = np.linspace(-1.0, 1.0, 41)
    heights = np.broadcast_to(curvature * line**2, (41, 41))
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    rough = physics.Material(friction=1.0)
    scene.add_body(physics.HeightField(heights, (2.0, 2.0), surface="smooth"), motion="static", material=rough)
    middle = curvature * radius**2 + tilt**2 / (4.0 * curvature)
    scene.add_body(
        physics.Cylinder(radius, half_length), mass=1.0, material=rough,
        position=(0.0, -half_length * np.sin(tilt), middle + half_length * np.cos(tilt)),
        orientation=(np.cos(0.5 * tilt), np.sin(0.5 * tilt), 0.0, 0.0),
    )  # fmt: skip
    world = physics.World(scene, options=physics.Options(time_step=1.0 / rate, sleeping=False))
    angle = []
    for _ in range(2 * rate):
        world.step()
        angle.append(2.0 * world.orientation[0, 1, 1])
    angle = np.array(angle)
    before = np.flatnonzero((angle[:-1] > 0.0) & (angle[1:] <= 0.0))
    crossings = before + angle[before] / (angle[before] - angle[before + 1])
    found = 2.0 * np.pi * rate * (len(crossings) - 1) / (crossings[-1] - crossings[0])
    inertia = 0.25 * radius**2 + half_length**2 / 3.0 + half_length**2
    expected = np.sqrt((0.5 * 9.81 / curvature - 9.81 * half_length) / inertia)
    assert found == pytest.approx(expected, rel=3e-3)  # of order 2 in the tilt
    assert 0.97 * tilt < np.abs(angle[-rate // 2 :]).max() < 1.001 * tilt


def test_sphere_in_the_bowl_keeps_its_energy_as_the_step_goes_to_zero():
    """A pendulum in a bowl over a quarter of the period: what is left is the order of the stepping, not the ground."""
    errors = []
    line = np.linspace(-1.25, 1.25, 65)
    heights = 2.0 - np.sqrt(4.0 - line[:, None] ** 2 - line**2)
    for rate in (240, 960):
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
        scene.add_body(physics.HeightField(heights, (2.5, 2.5), surface="smooth"), motion="static", material=SMOOTH_ICE)
        start = 1.95 * np.array([0.5, 0.0, -np.sqrt(0.75)]) + (0.0, 0.0, 2.0)
        ball = scene.add_body(physics.Sphere(0.05), mass=1.0, position=start, material=SMOOTH_ICE)
        world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
        before = world.potential_energy()[0]
        world.step(rate)
        errors.append(abs(world.kinetic_energy()[0] + world.potential_energy()[0] - before))
        assert world.position[0, ball, 1] == pytest.approx(0.0, abs=1e-9)
    assert errors[1] < 0.3 * errors[0] or max(errors) < 1e-5


def test_ground_that_rises_lifts_and_its_contacts_feel_the_spline_of_the_rates():
    rng = np.random.default_rng(2)
    bodies = [(physics.Box((0.2, 0.2, 0.1)), (0.0, 0.0, 0.1), {}), (physics.Sphere(0.1), (1.0, 1.0, 0.1), {})]
    world = world_on(np.zeros((33, 33)), bodies, motion="kinematic", material=physics.Material(0.5))
    world.set_heights(0, height_rates=np.full((33, 33), 0.5))
    world.step(120)
    np.testing.assert_allclose(world.position[0, 1:, 2], 0.1 + 0.5 * 0.5, atol=1e-9)
    np.testing.assert_allclose(world.linear_velocity[0, 1:, 2], 0.5, atol=1e-9)
    # The spline that was advanced is the spline through the samples that were advanced.
    rates = rng.normal(size=(33, 33))
    world.set_heights(0, np.zeros((33, 33)), rates)
    world.step(24)
    again = world_on(0.1 * rates, bodies)
    pool = world._storage.arrays["heights"]
    np.testing.assert_allclose(pool, again._storage.arrays["heights"], atol=1e-13)


def test_worlds_keep_their_own_smooth_ground_and_snapshots_hold_it():
    world = world_on(np.zeros((33, 33)), [(physics.Sphere(0.1), (0.0, 0.0, 0.1), {})], num_worlds=2)
    world.set_heights(0, np.tile(0.1 * LINE, (33, 1)), world=1)
    saved = world.snapshot()
    world.step(24)
    assert abs(world.position[0, 1, 0]) < 1e-12 and world.position[1, 1, 0] < -0.003
    ended = world.position.copy()
    world.reset(world=1)
    world.step(24)
    np.testing.assert_allclose(world.position[1, 1], (0.0, 0.0, 0.1), atol=1e-12)
    world.restore(saved)
    world.step(24)
    assert (world.position == ended).all()

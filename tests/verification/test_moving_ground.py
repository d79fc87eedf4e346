"""Bodies on ground that moves, against closed forms and the reduced equation of motion.

A body that sticks keeps its place on ground that moves smoothly, also where the user sets the mean velocity of the
ground anew in each step: the ground then accelerates evenly within it (integrator/driven.py), order 2.
"""

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from avalanche_gym import physics
from avalanche_gym.physics.scenes import moving_ground as scenes


def drift_on_turntable(excess, rate, seconds):
    """[m] how far the box has moved on the disk."""
    world = physics.World(scenes.turntable(excess), options=physics.Options(time_step=1.0 / rate))
    world.step(round(seconds * rate))
    place = scenes.place_on_turntable(world.position[0, 1], seconds)
    return np.linalg.norm(place - (scenes.PLACE, 0.0))


def test_box_on_a_turntable():
    assert drift_on_turntable(2.0, 240, 1.0) < 1e-6
    # One per cent of friction decides.
    assert drift_on_turntable(1.01, 240, 10.0) < 1e-6
    assert drift_on_turntable(0.99, 960, 4.0) > 1.0


TURNED = {
    "plane": physics.Plane(),
    "facets": physics.HeightField(np.zeros((21, 21)), (8.0, 8.0)),
    "smooth": physics.HeightField(np.zeros((21, 21)), (8.0, 8.0), surface="smooth"),
}
CUBE = np.array(list(itertools.product((-0.1, 0.1), repeat=3)))
RIDERS = {
    "box": (physics.Box((0.2, 0.1, 0.05)), 0.05),
    "cylinder": (physics.Cylinder(0.1, 0.05), 0.05),
    "hull": (physics.ConvexHull(CUBE), 0.1),
}


@pytest.mark.parametrize(("radius", "friction"), [(0.4, 0.2), (1.0, 0.5), (3.0, 0.9)])
@pytest.mark.parametrize("rider", RIDERS)
@pytest.mark.parametrize("ground", TURNED)
def test_what_rides_on_turning_ground(ground, rider, radius, friction):
    """One per cent of friction decides on every kind of ground. The trapezoid leaves (omega h)^3 r / 12 in a step, of
    which a quarter is made good in each: where a place is missed in the first prediction, its velocity is as well.
    """
    shape, height = RIDERS[rider]
    material = physics.Material(friction=friction)
    farthest = []
    for excess, seconds in ((1.01, 4.0), (0.99, 2.0)):
        spin = np.sqrt(friction * 9.81 / radius / excess)
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
        scene.add_body(TURNED[ground], motion="kinematic", angular_velocity=(0.0, 0.0, spin), material=material)
        place = radius * np.array([np.cos(0.3), np.sin(0.3)])
        scene.add_body(
            shape, mass=1.0, material=material,
            position=(*place, height), orientation=(np.cos(0.1), 0.0, 0.0, np.sin(0.1)),
            linear_velocity=(-spin * place[1], spin * place[0], 0.0), angular_velocity=(0.0, 0.0, spin),
        )  # fmt: skip
        world = physics.World(scene, options=physics.Options(sleeping=False))
        worst = 0.0
        for step in range(round(240 * seconds)):
            world.step()
            angle = spin * (step + 1) / 240.0
            turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ place
            worst = max(worst, np.linalg.norm(world.position[0, 1, :2] - turned))
        farthest.append(worst)
    assert farthest[0] < 1e-6
    assert farthest[1] > 1e-3 * radius


def slip_on_plate(excess, rate, seconds=3.0):
    """[m] farthest distance of the box from its place on the plate."""
    world = physics.World(scenes.oscillating_plate(excess), options=physics.Options(time_step=1.0 / rate))
    farthest = 0.0
    for step in range(round(seconds * rate)):
        world.set_state(0, linear_velocity=scenes.plate_velocity(excess, step / rate, 1.0 / rate))
        world.step()
        farthest = max(farthest, abs(world.position[0, 1, 0] - world.position[0, 0, 0]))
    return farthest


def test_box_on_an_oscillating_plate_sticks_exactly_if_friction_suffices():
    coarse, fine = (slip_on_plate(1.01, rate) for rate in (240, 960))
    # It lags by the change of the acceleration in a step, a w^3 h^3: what sticks is drawn back.
    assert coarse < 3.0 * scenes.plate_amplitude(1.01) * (scenes.PLATE_FREQUENCY / 240) ** 3
    assert fine < 0.05 * coarse
    assert slip_on_plate(0.99, 960) > 100.0 * fine


def test_box_on_a_disk_that_swings():
    """Turned to and fro about its axis, it carries the box along; what is made good of the creep is a rigid motion."""
    amplitude, frequency, seconds = 0.3, 4.0, 2.0
    errors = []
    for rate in (240, 480):
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
        rubber = physics.Material(friction=0.8)
        spin = (0.0, 0.0, amplitude * frequency)
        scene.add_body(
            physics.Cylinder(2.0, 0.1), motion="kinematic", position=(0.0, 0.0, -0.1), angular_velocity=spin,
            material=rubber,
        )  # fmt: skip
        scene.add_body(
            physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(1.0, 0.0, 0.1), material=rubber,
            linear_velocity=(0.0, amplitude * frequency, 0.0), angular_velocity=spin,
        )  # fmt: skip
        world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
        farthest = 0.0
        for step in range(round(seconds * rate)):
            angles = amplitude * np.sin(frequency * np.array([step, step + 1]) / rate)
            world.set_state(0, angular_velocity=(0.0, 0.0, np.diff(angles)[0] * rate))
            world.step()
            place = world.position[0, 1]
            farthest = max(farthest, np.hypot(place[0] - np.cos(angles[1]), place[1] - np.sin(angles[1])))
        errors.append(farthest)
    # As on the plate: the change of the acceleration in a step, a few times.
    assert errors[0] < 3.0 * amplitude * (frequency / 240) ** 3
    assert errors[1] < 0.25 * errors[0]


def wave_reference(place, seconds):
    """(x, z) [m] of the frictionless ball: Lagrange's equation of the place s below which it touches.

    c_s . (c_ss s'^2 + 2 c_st s' + c_tt + c_s s'') = -g c_s,z for the centre c(s, t).
    """
    e = 1e-4
    c = scenes.ball_on_carpet

    def motion(t, y):
        s, v = y
        cs = (c(s + e, t) - c(s - e, t)) / (2.0 * e)
        css = (c(s + e, t) - 2.0 * c(s, t) + c(s - e, t)) / e**2
        ctt = (c(s, t + e) - 2.0 * c(s, t) + c(s, t - e)) / e**2
        cst = (c(s + e, t + e) - c(s + e, t - e) - c(s - e, t + e) + c(s - e, t - e)) / (4.0 * e * e)
        return v, -(cs @ (css * v * v + 2.0 * cst * v + ctt) + scenes.GRAVITY * cs[1]) / (cs @ cs)

    solution = solve_ivp(motion, (0.0, seconds), [place, 0.0], rtol=1e-9, atol=1e-10)
    return c(solution.y[0, -1], seconds)


def test_frictionless_ball_on_the_travelling_wave():
    reference = wave_reference(0.3, 1.5)
    errors = []
    for rate in (240, 960):
        world = physics.World(scenes.carpet(0.3), options=physics.Options(time_step=1.0 / rate))
        penetration = 0.0
        for step in range(round(1.5 * rate)):
            world.set_heights(0, scenes.carpet_heights(step / rate), scenes.carpet_rates(step / rate, 1.0 / rate))
            world.step()
            penetration = max(penetration, world.report().penetration[0])
        errors.append(np.linalg.norm(world.position[0, 1, ::2] - reference))
        assert penetration < 1e-7
    # The reference itself, by finite differences, is good to some 1e-5 m.
    assert max(errors) < 5e-5


def ground_that_swings(kind, material):
    """A driven box, or a field of samples, with its surface at height 0."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -scenes.GRAVITY)))
    if kind == "box":
        shape, place = physics.Box((1.0, 1.0, 0.1)), (0.0, 0.0, -0.1)
    else:
        shape, place = physics.HeightField(np.zeros((9, 9)), (2.0, 2.0), kind), (0.0, 0.0, 0.0)
    scene.add_body(shape, motion="kinematic", position=place, material=material)
    return scene


def drive(world, kind, speed):
    if kind == "box":
        world.set_state(0, linear_velocity=(0.0, 0.0, speed))
    else:
        world.set_heights(0, height_rates=np.full((9, 9), speed))


@pytest.mark.parametrize("kind", ["box", "facets", "smooth"])
def test_a_ball_bounces_off_ground_that_swings(kind):
    """Struck at t by z = A sin(w t) it leaves with V - e (v - V): order 2 in the steps of the ground."""
    amplitude, frequency, height, seconds = 0.05, 7.0, 0.8, 0.9
    material = physics.Material(restitution=0.9, friction=0.0)
    bounce = 0.9**2  # of the pair
    fall = 0.5 * scenes.GRAVITY
    strike = brentq(lambda t: height - fall * t * t - amplitude * np.sin(frequency * t), 0.2, 0.6, xtol=1e-15)
    ground = amplitude * frequency * np.cos(frequency * strike)
    rebound = ground + bounce * (2.0 * fall * strike + ground)
    left = seconds - strike
    truth = amplitude * np.sin(frequency * strike) + rebound * left - fall * left**2
    errors = []
    for rate in (120, 480):
        scene = ground_that_swings(kind, material)
        scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0.03, 0.02, 0.1 + height), material=material)
        world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
        for step in range(round(seconds * rate)):
            drive(world, kind, amplitude * np.diff(np.sin(frequency * np.array([step, step + 1]) / rate))[0] * rate)
            world.step()
        errors.append(abs(world.position[0, 1, 2] - 0.1 - truth))
    assert errors[0] < 5e-4
    assert errors[1] < 0.1 * errors[0]


@pytest.mark.parametrize("kind", ["box", "facets", "smooth"])
def test_ground_that_starts_at_once_does_not_throw(kind):
    """A jump of its velocity is no acceleration: what it lifts has its velocity, and stays on it."""
    scene = ground_that_swings(kind, physics.Material())
    scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0.0, 0.0, 0.1))
    world = physics.World(scene, options=physics.Options(time_step=1.0 / 240))
    world.step(10)
    for speed in (0.02, 0.5, 0.1):
        drive(world, kind, speed)
        fastest = 0.0
        for _ in range(40):
            world.step()
            fastest = max(fastest, world.linear_velocity[0, 1, 2])
        assert fastest < max(speed, 0.5) * (1.0 + 1e-6)
        assert abs(world.linear_velocity[0, 1, 2] - speed) < 1e-6
    if kind == "box":
        assert world.linear_velocity[0, 0, 2] == speed

"""Bodies on ground that moves, against closed forms and the reduced equation of motion.

A body that sticks keeps its place on ground that moves smoothly. Where the user sets the velocity of the ground anew in
each step, the ground jumps and the body follows half a step behind: order 1, without adding up.
"""

import numpy as np
from scipy.integrate import solve_ivp

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
    step_of_plate = scenes.plate_amplitude(1.01) * scenes.PLATE_FREQUENCY
    for rate in (240, 960):
        assert slip_on_plate(1.01, rate) < 1.01 * step_of_plate / rate
    assert slip_on_plate(0.95, 960) > 2.0 * slip_on_plate(1.01, 960)


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
    assert errors[0] < 3.5e-3 and errors[1] < 0.35 * errors[0]

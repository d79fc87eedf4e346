"""How far down the chain of the exact tier islands of few bodies have to go."""

import ctypes

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene
from avalanche_gym.physics.solver.exact import INTERIOR_POINT


def methods_of_the_push_scene(**options):
    """How the solutions of 40 environment steps of four worlds were found."""
    chosen = physics.Options(time_step=PUSH_STEP, sleeping=False, **options)
    world = physics.World(push_scene(), num_worlds=4, options=chosen)
    header = world._storage.header[0]
    kind = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * 4)
    original = kind(int(header["solve_problem"]))
    methods = []

    def watched(*arguments):
        methods.append(original(*arguments))
        return methods[-1]

    kept = kind(watched)
    header["solve_problem"] = ctypes.cast(kept, ctypes.c_void_p).value
    for push in push_impulses(np.random.default_rng(0), 40 * 4).reshape(40, 4, 3):
        world.impulse_buffer[:, PUSHED, :3] = push
        world.step(PUSH_STEPS)
    return methods


def test_sweeps_and_newton_solve_what_slides_over_facets():
    """A pushed box on up to twelve nearly redundant contacts: the interior point is hardly ever needed.

    With a fixed weight Newton's first step threw away what the sweeps had found: 21 of these solutions fell through.
    """
    methods = methods_of_the_push_scene()
    assert len(methods) > 2000
    assert sum(method >= INTERIOR_POINT for method in methods) <= 3


@pytest.mark.parametrize("tolerance", [1e-2, 0.1])
def test_what_is_within_a_loose_tolerance_is_not_swept_for(tolerance):
    """What the tolerance lets pass went through 200 sweeps in vain, and a loose tolerance cost twice a tight one."""
    assert max(methods_of_the_push_scene(tolerance=tolerance, events=False)) <= INTERIOR_POINT


@pytest.mark.parametrize("shape", [physics.Sphere(0.15), physics.Capsule(0.1, 0.2)])
def test_what_is_pushed_on_one_contact_is_predicted_once(shape):
    """The first prediction knows that the contact will hold; it used to go on at the velocity of the push."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    upright = (1.0, 0.0, 0.0, 0.0)
    height = 0.15 if isinstance(shape, physics.Sphere) else 0.3
    ball = scene.add_body(shape, mass=2.0, position=(0.0, 0.0, height), orientation=upright)
    world = physics.World(scene, options=physics.Options(time_step=0.005, sleeping=False))
    world.step(3)
    # Away from the ground, by less than gravity takes back within the step, and too little to be an impact.
    world.apply_impulse(ball, (0.06, 0.02, 2.0 * 2e-4))
    world.step(1)
    assert world.report().iterations == 1
    assert abs(world.linear_velocity[0, ball, 2]) < 1e-2

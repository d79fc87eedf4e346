"""How far down the chain of the exact tier islands of few bodies have to go."""

import ctypes

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene
from avalanche_gym.physics.solver.exact import INTERIOR_POINT


def test_sweeps_and_newton_solve_what_slides_over_facets():
    """A pushed box on up to twelve nearly redundant contacts: the interior point is hardly ever needed.

    With a fixed weight Newton's first step threw away what the sweeps had found: 21 of these solutions fell through.
    """
    world = physics.World(push_scene(), num_worlds=4, options=physics.Options(time_step=PUSH_STEP, sleeping=False))
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
    assert len(methods) > 2000
    assert sum(method >= INTERIOR_POINT for method in methods) <= 3

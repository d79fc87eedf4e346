"""The view of a world follows its bodies."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.rendering import AGENT, Camera, Renderer, WorldView, primitives

CAMERA = Camera.orbit((0.0, 0.0, 0.5), 7.0, 30.0, 25.0)


def sample_world(num_worlds=1):
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static", name="ground")
    scene.add_body(physics.Sphere(0.4), mass=1.0, position=(0.0, 0.0, 1.5), name="ball")
    scene.add_body(physics.Box((0.3, 0.3, 0.3)), mass=1.0, position=(1.2, 0.0, 0.3), name="box")
    return physics.World(scene, num_worlds=num_worlds)


def frame_of(view):
    return Renderer(64, 48).render(view, CAMERA)


def test_each_world_of_a_batch_is_drawn_in_turn():
    world = sample_world(num_worlds=2)
    world.set_state(1, position=(-1.0, 0.5, 2.0), world=1)
    view = WorldView(world, colors={"ball": AGENT})
    np.testing.assert_array_equal(view.instances["position"], world.position[0])
    first = frame_of(view)
    view.update(world, 1)
    np.testing.assert_array_equal(view.instances["position"], world.position[1])
    second = frame_of(view)
    assert (first != second).any()
    view.update(world, 0)
    np.testing.assert_array_equal(frame_of(view), first)
    assert view.index("box") == 2


def test_bodies_that_come_and_go_are_followed():
    world = sample_world()
    view = WorldView(world)
    with_ball = frame_of(view)
    world.remove_body(1)
    view.update(world)
    without = frame_of(view)
    assert (without != with_ball).any()
    new = world.add_body(physics.Sphere(0.4), mass=1.0, position=(0.0, 0.0, 1.5), name="ball")
    view.update(world)
    assert new == view.index("ball")
    np.testing.assert_array_equal(frame_of(view), with_ball)


def test_what_a_body_looks_like_can_be_chosen():
    world = sample_world()
    bare = frame_of(WorldView(world))
    for options in (
        {"colors": {"box": "#000000"}},
        {"geometries": {"box": primitives.sphere(0.6)}},
        {"hidden": ("box",)},
        {"opacities": {"box": 0.3}},
    ):
        assert (frame_of(WorldView(world, **options)) != bare).any()


def test_names_that_no_body_has_are_refused():
    with pytest.raises(ValueError, match="there are ground, ball, box"):
        WorldView(sample_world(), colors={"bal": AGENT})
    with pytest.raises(ValueError, match="No body is named"):
        WorldView(sample_world()).index("bal")

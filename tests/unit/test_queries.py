"""What ray_cast, closest_point and overlap return, and what they refuse."""

import math

import numpy as np
import pytest

from avalanche_gym import physics


@pytest.fixture(scope="module")
def world():
    scene = physics.Scene()
    scene.add_body(physics.Plane(), motion="static", name="floor")
    scene.add_body(physics.Box((0.5, 0.5, 0.5)), position=(0.0, 0.0, 2.0), name="box")
    scene.add_body(physics.Sphere(0.5), position=(3.0, 0.0, 2.0), name="ball")
    parts = [(physics.Sphere(0.2), (x, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)) for x in (-0.5, 0.5)]
    scene.add_body(physics.Compound(parts), position=(0.0, 3.0, 1.0), name="dumbbell")
    world = physics.World(scene, num_worlds=3)
    world.set_state(1, position=(0.0, 0.0, 5.0), world=2)
    return world


def test_shapes_of_results_and_worlds(world):
    down = (0.0, 0.0, -1.0)
    one = world.ray_cast((0.0, 0.0, 10.0), down, world=0)
    assert one.shape == () and one["body"] == 1 and one["distance"] == pytest.approx(7.5)
    assert one["normal"].tolist() == [0.0, 0.0, 1.0] and one["position"] == pytest.approx([0.0, 0.0, 2.5])
    every = world.ray_cast([(0.0, 0.0, 10.0), (3.0, 0.0, 10.0), (9.0, 0.0, 10.0)], down)
    assert every.shape == (3, 3) and every["body"].tolist() == [[1, 2, 0]] * 3
    assert every["distance"][:, 0] == pytest.approx([7.5, 7.5, 4.5])
    own = np.zeros((2, 1, 3)) + np.array([0.0, 0.0, 10.0])
    own[1, 0] = (3.0, 0.0, 10.0)
    assert world.ray_cast(own, down, world=slice(1, 3))["body"].tolist() == [[1], [2]]
    fan = world.ray_cast((0.0, 3.0, 10.0), [(0.05, 0.0, -1.0), (-0.05, 0.0, -1.0), (0.0, 0.0, -7.0)], world=1)
    assert fan["body"].tolist() == [3, 3, 0]
    assert world.closest_point((3.0, 0.0, 3.0)).shape == (3,)
    assert world.overlap(physics.Sphere(0.1), (0.0, 0.0, 2.0)).shape == (3, 4)


def test_misses_limits_and_rays_from_inside(world):
    miss = world.ray_cast((0.0, 0.0, 10.0), (0.0, 0.0, 1.0), world=0)
    assert miss["body"] == -1 and miss["distance"] == math.inf and np.isnan(miss["position"]).all()
    assert world.ray_cast((0.0, 0.0, 10.0), (0.0, 0.0, -1.0), max_distance=7.4, world=0)["body"] == -1
    inside = world.ray_cast((0.1, 0.0, 2.0), (1.0, 0.0, 0.0), world=0)
    assert inside["body"] == 1 and inside["distance"] == 0.0 and inside["normal"].tolist() == [-1.0, 0.0, 0.0]
    assert world.closest_point((0.0, 0.0, 9.0), max_distance=1.0, world=0)["body"] == -1
    deep = world.closest_point((0.0, 0.0, 2.4), world=0)
    assert deep["body"] == 1 and deep["distance"] == pytest.approx(-0.1)


def test_bodies_that_count(world):
    ray = ((0.0, 0.0, 10.0), (0.0, 0.0, -1.0))
    assert world.ray_cast(*ray, ignore=1, world=0)["body"] == 0
    assert world.ray_cast(*ray, ignore=[0, 1], world=0)["body"] == -1
    assert world.ray_cast(*ray, only=2, world=0)["body"] == -1
    assert world.ray_cast(*ray, ignore=np.array([False, True, False, False]), world=0)["body"] == 0
    found = world.overlap(physics.Box((2.0, 2.0, 2.0)), (1.0, 0.0, 1.0), ignore=0, world=0)
    assert found.tolist() == [False, True, True, False]


def test_overlap(world):
    turned = (math.cos(math.pi / 8), 0.0, 0.0, math.sin(math.pi / 8))
    place = (0.5 + 0.1 * math.sqrt(2.0) - 1e-3, 0.0, 2.0)
    assert world.overlap(physics.Box((0.1, 0.1, 0.1)), place, turned, world=0).tolist() == [False, True, False, False]
    assert not world.overlap(physics.Box((0.1, 0.1, 0.1)), place, world=0).any()
    assert world.overlap(physics.Capsule(0.1, 2.0), (0.6, 0.0, 2.0), world=0).tolist() == [True, True, False, False]
    assert world.overlap(physics.Sphere(0.3), (0.5, 3.0, 0.6), world=0).tolist() == [False, False, False, True]
    assert world.overlap(physics.Sphere(0.3), (0.0, 0.0, 5.0)).tolist()[2] == [False, True, False, False]


def test_they_see_bodies_where_they_are_and_change_nothing():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Sphere(0.5), mass=1.0, position=(0.0, 0.0, 5.0))
    world, other = physics.World(scene), physics.World(scene)
    world.step(60)
    other.step(60)
    hit = world.ray_cast((0.0, 0.0, 20.0), (0.0, 0.0, -1.0), world=0)
    assert hit["position"][2] == pytest.approx(world.position[0, 0, 2] + 0.5)
    world.step(60)
    other.step(60)
    assert (world.position == other.position).all()
    handle = world.add_body(physics.Box((1.0, 1.0, 1.0)), mass=1.0, position=(0.0, 0.0, 10.0))
    assert world.ray_cast((0.0, 0.0, 20.0), (0.0, 0.0, -1.0), world=0)["body"] == handle
    world.remove_body(handle)
    assert world.ray_cast((0.0, 0.0, 20.0), (0.0, 0.0, -1.0), world=0)["body"] == 0


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda w: w.ray_cast((0, 0), (0, 0, 1)), ValueError, r"ray_cast\(origins\) has shape \(2,\)"),
        (lambda w: w.ray_cast((0, 0, 0), (0, 0, 0)), ValueError, "zero"),
        (lambda w: w.ray_cast((0, 0, math.nan), (0, 0, 1)), ValueError, "finite"),
        (lambda w: w.ray_cast(np.zeros((2, 3)), np.ones((3, 3))), ValueError, "2 origins and 3 directions"),
        (lambda w: w.ray_cast(np.zeros((2, 4, 3)), np.ones(3)), ValueError, r"\(3, n, 3\)"),
        (lambda w: w.ray_cast("up", (0, 0, 1)), TypeError, "numeric"),
        (lambda w: w.ray_cast((0, 0, 0), (0, 0, 1), max_distance=-1.0), ValueError, "max_distance"),
        (lambda w: w.ray_cast((0, 0, 0), (0, 0, 1), ignore=9), IndexError, "handles 0 to 3"),
        (lambda w: w.ray_cast((0, 0, 0), (0, 0, 1), ignore="box"), TypeError, "handle"),
        (lambda w: w.ray_cast((0, 0, 0), (0, 0, 1), only=np.array([True])), ValueError, "mask"),
        (lambda w: w.ray_cast((0, 0, 0), (0, 0, 1), world=7), IndexError, "worlds 0 to 2"),
        (lambda w: w.closest_point([(1, 2)]), ValueError, "closest_point"),
        (lambda w: w.overlap(physics.Plane(), (0, 0, 0)), TypeError, "Sphere, Capsule, Box or Cylinder"),
        (lambda w: w.overlap(physics.Sphere(1.0), (0, 0)), ValueError, "position"),
    ],
)
def test_errors_name_what_is_wrong(world, call, error, text):
    with pytest.raises(error, match=text):
        call(world)

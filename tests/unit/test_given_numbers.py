"""Numbers that a user gives: of every type that is one, and refused with a text where they are none or too extreme."""

import math
from fractions import Fraction

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.given import real_array, real_number, whole_number

TOO_LARGE = 10**400  # for a float


@pytest.fixture
def world():
    """A ball above ground of its own heights."""
    scene = physics.Scene()
    scene.add_body(physics.HeightField(np.zeros((2, 2)), size=(9, 9)), motion="static")
    scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0, 0, 1), name="ball")
    return physics.World(scene)


def test_one_number_of_any_type():
    for value in (2, 2.0, np.float32(2), np.int8(2), np.array(2), Fraction(4, 2)):
        assert real_number(value) == 2.0 and type(real_number(value)) is float
    for value in ("2", b"2", True, np.True_, np.array(True), np.str_("2"), 2j, np.complex128(2), None, [2], np.ones(1)):
        assert real_number(value) is None
    assert real_number(TOO_LARGE) == math.inf and real_number(-TOO_LARGE) == -math.inf
    assert [whole_number(value) for value in (3, np.uint8(3), True, np.True_, 3.0, "3")] == [
        3,
        3,
        None,
        None,
        None,
        None,
    ]


def test_arrays_of_any_type():
    for value in ([1, 2], np.float32([1, 2]), np.array([1, 2], object), [Fraction(1), 2]):
        assert real_array(value).tolist() == [1.0, 2.0] and real_array(value).dtype == np.float64
    same = np.ones(3)
    assert real_array(same) is same
    assert real_array([0, TOO_LARGE]).tolist() == [0.0, math.inf]
    for value in (["1", 2], np.array(["1", 2], object), [1j, 2], np.array([1j, 2]), [{}, 2], [[1], [1, 2]]):
        with pytest.raises((TypeError, ValueError)):
            real_array(value)


def test_settings_take_the_numbers_of_numpy():
    options = physics.Options(time_step=np.float32(0.5), substeps=np.int64(4), events=np.False_)
    assert options == physics.Options(time_step=0.5, substeps=4, events=False)
    assert [type(value) for value in (options.time_step, options.substeps, options.events)] == [float, int, bool]
    assert physics.PointGravity((0, 0, 0), np.int64(2)) == physics.PointGravity((0, 0, 0), 2.0)
    assert type(physics.Material(friction=np.float32(0.5)).friction) is float


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("call", "texts"),
    [
        (lambda w: physics.Options(time_step=True), ["time_step=True", "greater than 0"]),
        (lambda w: physics.Options(tolerance=TOO_LARGE), ["tolerance=1000", "finite"]),
        (lambda w: physics.Options(threads=10**30), ["threads=1000", "at most 2147483647"]),
        (lambda w: physics.Material(friction=TOO_LARGE), ["friction=1000", "finite"]),
        (lambda w: physics.PointGravity((0, 0, 0), True), ["mu=True", "finite number"]),
        (lambda w: physics.UniformGravity(("0", "0", "1")), ["UniformGravity(acceleration)", "not numeric"]),
        (lambda w: physics.UniformGravity(np.array([0, 0, 1j])), ["UniformGravity(acceleration)", "not numeric"]),
        (lambda w: physics.UniformGravity((0, TOO_LARGE, 0)), ["inf", "index (1,)", "finite"]),
        (lambda w: physics.Sphere(np.True_), ["Sphere(radius)", "one real number"]),
        (lambda w: physics.Sphere(TOO_LARGE), ["Sphere(radius)", "finite"]),
        (lambda w: w.step(10**30), ["step(num_steps=1000", "at most"]),
        (lambda w: w.apply_impulse(1, ("1", "0", "0")), ["apply_impulse(impulse)", "not numeric"]),
        (lambda w: w.apply_force(1, np.array([1j, 0, 0])), ["apply_force(force)", "not numeric"]),
        (lambda w: w.set_state(1, position=(TOO_LARGE, 0, 0)), ["set_state(position)", "finite"]),
        (lambda w: w.set_heights(0, [["1", "1"], ["1", "1"]]), ["set_heights(heights)", "not numeric"]),
        (lambda w: w.set_parameters(1, mass=True), ["mass", "True", "one number"]),
        (lambda w: w.set_parameters(1, friction="1"), ["friction", "'1'", "one number"]),
        (lambda w: w.set_parameters(1, mass=TOO_LARGE), ["'ball'", "mass=inf", "finite"]),
        (lambda w: w.set_parameters(1, mass=1e-310), ["'ball'", "1e-310 kg", "1e-300 to 1e+300"]),
        (lambda w: w.set_parameters(1, inertia=(1e-310,) * 3), ["'ball'", "1e-310", "1e-300 to 1e+300"]),
        (lambda w: w.set_parameters(1, inertia=(1e308,) * 3), ["'ball'", "1e+308", "up to 1e+300"]),
        (lambda w: w.ray_cast((0, 0, 1), (0, 0, -1), max_distance=-1), ["ray_cast(max_distance)=-1", "at least zero"]),
        (lambda w: w.ray_cast((0, 0, 1), (0, 0, -1), ignore=np.array(1)), ["ray_cast(ignore)", "array(1)", "handle"]),
        (lambda w: w.add_body(physics.Sphere(1e-200), mass=1.0), ["'body_2'", "1 kg", "1e-300 to 1e+300"]),
        (lambda w: w.add_body(physics.Sphere(1e200)), ["'body_2'", "inf kg", "1e-300 to 1e+300"]),
        (lambda w: w.add_body(physics.Sphere(0.1), mass=1e308), ["'body_2'", "1e+308 kg", "1e-300 to 1e+300"]),
        (lambda w: w.add_body(physics.Sphere(0.1), mass="1"), ["'body_2'", "mass='1'", "not a number"]),
        (lambda w: w.add_body(physics.Sphere(0.1), center_of_mass=(1e200, 0, 0)), ["'body_2'", "1e-300 to 1e+300"]),
        (lambda w: w.add_body(physics.Sphere(0.1), motion=np.array(["static", "x"])), ["'body_2'", "motion=array("]),
        (lambda w: w.add_body(physics.Sphere(0.1), orientation=(1e200, 0, 0, 0)), ["'body_2'", "norm inf"]),
        (lambda w: physics.Scene().add_body(physics.Sphere(1.0), alternatives=5), ["alternatives=5", "list of shapes"]),
        (lambda w: physics.World(physics.Scene()).remove_body(0), ["remove_body(body=0)", "no body"]),
    ],
)
def test_what_is_no_number_or_too_extreme_is_refused_and_changes_nothing(world, call, texts):
    def bits():
        return [array.tobytes() for array in world.snapshot().arrays.values()]

    before = bits()
    with pytest.raises((ValueError, TypeError, IndexError)) as raised:
        call(world)
    for text in texts:
        assert text in str(raised.value)
    assert bits() == before and world.num_bodies == 2


@pytest.mark.parametrize(
    ("call", "texts"),
    [
        (lambda w, p: w.add_body(physics.Sphere(0.1), allow_sleep="no"), ["'body_2'", "allow_sleep='no'", "False"]),
        (lambda w, p: physics.TriangleMesh(np.eye(3), [(0, 1, 2)], "no"), ["two_sided)='no'", "True or False"]),
        (lambda w, p: physics.TriangleMesh.from_file(None), ["from_file(path)=None", "str or a Path"]),
        (lambda w, p: physics.HeightField(np.zeros((2, 2)), (1, 1), np.array(["a", "b"])), ["surface", "'smooth'"]),
        (lambda w, p: physics.HeightField.from_image(p, (1, 1)), ["from_image(image)", "cannot be read", "PNG"]),
        (lambda w, p: w.reset(slice(0.5)), ["reset(world=slice(", "whole numbers"]),
        (lambda w, p: w.apply_impulse(1, (0, 0, 1), world=slice(0, 1, 0)), ["apply_impulse(world=", "zero"]),
    ],
)
def test_what_is_of_another_kind_is_refused_by_name(world, tmp_path, call, texts):
    path = tmp_path / "picture.png"
    path.write_text("no picture")
    with pytest.raises((ValueError, TypeError)) as raised:
        call(world, path)
    for text in texts:
        assert text in str(raised.value)


def test_a_field_that_pulls_nowhere_has_no_pole():
    scene = physics.Scene()
    scene.add_field(physics.PointGravity((0, 0, 0), mu=0.0))
    scene.add_body(physics.Sphere(0.1), mass=1.0, linear_velocity=(1, 0, 0))
    world = physics.World(scene, options=physics.Options(time_step=0.5))
    assert world.potential_energy().tolist() == [0.0] and "point gravity" not in world.features
    world.step(2)
    assert world.position[0, 0].tolist() == [1, 0, 0]


def test_a_quaternion_off_by_the_whole_tolerance_is_normalised():
    for norm in (1.0 - 1e-6, 1.0 + 1e-6):
        scene = physics.Scene()
        scene.add_body(physics.Sphere(0.1), mass=1.0, orientation=(norm, 0, 0, 0))
        assert scene.bodies[0].orientation.tolist() == [1, 0, 0, 0]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("length", [5e-324, 1e-200, 1e200, 1.7e308])
def test_a_ray_has_a_direction_of_any_length(world, length):
    hit = world.ray_cast((1, 1, 2), (0, 0, -length), world=0)
    assert hit["body"] == 0 and hit["distance"] == 2.0


def test_no_rays_go_with_one_origin_or_one_direction(world):
    none = np.zeros((0, 3))
    assert world.ray_cast(none, (0, 0, -1)).shape == world.ray_cast((0, 0, 1), none).shape == (1, 0)
    assert world.ray_cast(none, none, world=0).shape == (0,)

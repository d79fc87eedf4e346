"""State arrays: handles, frames, what ``world=`` selects, energies; and the errors of the calls that change a state."""

import math

import numpy as np
import pytest

from avalanche_gym import physics

SQRT_HALF = math.sqrt(0.5)
ARRAYS = ("position", "orientation", "linear_velocity", "angular_velocity")


@pytest.fixture
def world():
    """Three worlds without a field: a lopsided box, a kinematic paddle, a static wall, all far apart."""
    scene = physics.Scene()
    scene.add_body(
        physics.Box((0.1, 0.2, 0.3)), mass=2.0, center_of_mass=(0.5, 0.0, 0.0), angular_velocity=(0, 0, 2), name="box"
    )
    scene.add_body(
        physics.Box((1, 1, 0.1)),
        motion="kinematic",
        position=(20, 0, 0),
        linear_velocity=(0, 1, 0),
        angular_velocity=(0, 0, math.pi / 2),
        name="paddle",
    )
    scene.add_body(physics.Sphere(1.0), motion="static", position=(-20, 0, 0), name="wall")
    return physics.World(scene, num_worlds=3, options=physics.Options(time_step=0.01))


BOX, PADDLE, WALL = 0, 1, 2


def test_handles_index_axis_1_static_bodies_included(world):
    assert world.position.shape == (3, 3, 3) and world.orientation.shape == (3, 3, 4)
    assert world.position[1, WALL].tolist() == [-20, 0, 0]
    assert world.orientation[2, WALL].tolist() == [1, 0, 0, 0]
    assert (world.num_worlds, world.num_bodies) == (3, 3)


def test_arrays_are_read_only_and_stay_current(world):
    views = [getattr(world, name) for name in ARRAYS]
    for view in views:
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 0.0
    world.step(2)
    world.apply_impulse(BOX, (0, 0, 1))
    world.set_state(WALL, position=(-30, 0, 0))
    for name, view in zip(ARRAYS, views, strict=True):
        assert np.shares_memory(view, getattr(world, name))
    assert world.position[0, WALL, 0] == -30 and world.linear_velocity[0, BOX, 2] == 0.5


def test_position_and_velocity_belong_to_the_frame_of_the_shape(world):
    """The box turns about its centre of mass, half a metre beside its origin."""
    # The origin is at rest at first, so the centre of mass moves with w x r.
    assert world.linear_velocity[0, BOX].tolist() == [0, 0, 0]
    assert world.kinetic_energy()[0] == pytest.approx(0.5 * 2.0 * 1.0 + 0.5 * _moment_z() * 4.0, rel=1e-13)
    world.step(50)
    time, spin = 0.5, 2.0
    center = np.array([0.5, spin * 0.5 * time, 0.0])
    turned = 0.5 * np.array([math.cos(spin * time), math.sin(spin * time), 0.0])
    np.testing.assert_allclose(world.position[1, BOX], center - turned, atol=1e-13)
    speed = np.array([0.0, spin * 0.5, 0.0]) - np.cross([0, 0, spin], turned)
    np.testing.assert_allclose(world.linear_velocity[1, BOX], speed, atol=1e-13)


def _moment_z():
    return 2.0 / 3.0 * (0.01 + 0.04) + 2.0 * 0.25


def test_center_of_mass_and_principal_frame_round_trip():
    """A body with products of inertia and its centre elsewhere reads back what it was given."""
    scene = physics.Scene()
    inertia = np.array([[2.0, 0.3, 0.1], [0.3, 2.5, -0.2], [0.1, -0.2, 3.0]])
    given = {
        "position": (1, 2, 3),
        "orientation": (0.5, 0.5, -0.5, 0.5),
        "linear_velocity": (4, 5, 6),
        "angular_velocity": (0.1, 0.2, 0.3),
    }
    scene.add_body(physics.Sphere(1.0), mass=3.0, inertia=inertia, center_of_mass=(0.1, 0.2, 0.3), **given)
    world = physics.World(scene)
    world.apply_impulse(0, (0, 0, 0))
    for name, value in given.items():
        np.testing.assert_allclose(getattr(world, name)[0, 0], value, atol=1e-14)
    # L = R I R^T w + r x m v about the world's origin, v and r of the centre of mass.
    rotation = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]).astype(float)
    spin = np.array([0.1, 0.2, 0.3])
    arm = rotation @ (0.1, 0.2, 0.3)
    center, speed = np.array([1, 2, 3]) + arm, np.array([4, 5, 6]) + np.cross(spin, arm)
    own = rotation @ inertia @ rotation.T @ spin
    np.testing.assert_allclose(world.angular_momentum()[0], own + np.cross(center, 3 * speed), rtol=1e-13)
    assert world.kinetic_energy()[0] == pytest.approx(1.5 * speed @ speed + 0.5 * spin @ own, rel=1e-13)
    np.testing.assert_allclose(world.linear_momentum()[0], 3 * speed, rtol=1e-13)


def test_kinematic_bodies_turn_about_their_origin_until_set_again(world):
    world.step(100)
    assert world.position[0, PADDLE] == pytest.approx([20, 1, 0], abs=1e-12)
    assert world.orientation[0, PADDLE] == pytest.approx(
        [math.cos(math.pi / 4), 0, 0, math.sin(math.pi / 4)], abs=1e-12
    )
    world.set_state(PADDLE, linear_velocity=(0, 0, 0), angular_velocity=(0, 0, 0), world=0)
    before = world.position[:, PADDLE].copy()
    world.step(10)
    assert np.array_equal(world.position[0, PADDLE], before[0]) and world.position[1, PADDLE, 1] > before[1, 1]


def test_static_bodies_can_be_placed_but_not_moved(world):
    world.set_state(WALL, position=(-25, 0, 0), orientation=(SQRT_HALF, 0, 0, SQRT_HALF), linear_velocity=(0, 0, 0))
    world.step(3)
    assert world.position[2, WALL].tolist() == [-25, 0, 0]
    with pytest.raises(ValueError, match="linear_velocity.*'wall'.*kinematic"):
        world.set_state(WALL, linear_velocity=(1, 0, 0))


@pytest.mark.parametrize(
    ("which", "chosen"),
    [
        (1, [1]),
        (-1, [2]),
        (np.int64(0), [0]),
        (slice(1, None), [1, 2]),
        (slice(0, 0), []),
        (np.array([True, False, True]), [0, 2]),
        ([False, True, False], [1]),
        (None, [0, 1, 2]),
    ],
)
def test_world_selects(world, which, chosen):
    world.set_state(BOX, position=(7, 8, 9), world=which)
    assert np.flatnonzero(world.position[:, BOX, 0] == 7).tolist() == chosen


def test_values_broadcast_over_worlds(world):
    world.set_state(BOX, position=[(1, 0, 0), (2, 0, 0), (3, 0, 0)])
    assert world.position[:, BOX, 0].tolist() == [1, 2, 3]
    world.set_state(BOX, position=[(5, 0, 0), (6, 0, 0)], world=np.array([True, False, True]))
    assert world.position[:, BOX, 0].tolist() == [5, 2, 6]
    world.set_state(BOX, position=[(4, 0, 0)], world=slice(0, 2))
    assert world.position[:, BOX, 0].tolist() == [4, 4, 6]
    with pytest.raises(ValueError, match=r"set_state\(position\) has shape \(2, 3\); give shape \(3,\) or \(3, 3\)"):
        world.set_state(BOX, position=[(1, 0, 0), (2, 0, 0)])


def test_set_state_keeps_what_is_not_given(world):
    world.step(7)
    before = {name: getattr(world, name).copy() for name in ARRAYS}
    world.set_state(BOX, linear_velocity=(1, 2, 3), world=1)
    for name in ARRAYS:
        expected = before[name]
        if name == "linear_velocity":
            expected[1, BOX] = (1, 2, 3)
        assert np.array_equal(getattr(world, name), expected)


def test_quaternions_within_1e_6_are_normalised_others_refused(world):
    world.set_state(BOX, orientation=np.array([0.6, 0.8, 0, 0]) * (1 + 9e-7))
    np.testing.assert_allclose(world.orientation[0, BOX], [0.6, 0.8, 0, 0], atol=1e-15)
    with pytest.raises(ValueError, match=r"set_state\(orientation\).*norm.*w comes first"):
        world.set_state(BOX, orientation=np.array([0.6, 0.8, 0, 0]) * (1 + 2e-6))
    with pytest.raises(ValueError, match="norm"):
        world.set_state(BOX, orientation=[(1, 0, 0, 0), (1, 0, 0, 0), (0, 0, 0, 2)])
    np.testing.assert_allclose(world.orientation[2, BOX], [0.6, 0.8, 0, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("call", "error", "texts"),
    [
        (lambda w: w.set_state("box", position=(0, 0, 0)), TypeError, ["body='box'", "handle", "int"]),
        (lambda w: w.set_state(True, position=(0, 0, 0)), TypeError, ["body=True", "handle"]),
        (lambda w: w.set_state(3, position=(0, 0, 0)), IndexError, ["body=3", "0 to 2"]),
        (lambda w: w.set_state(-1, position=(0, 0, 0)), IndexError, ["body=-1", "0 to 2"]),
        (lambda w: w.set_state(BOX, position=(0, 0, 0), world=3), IndexError, ["world=3", "0 to 2"]),
        (
            lambda w: w.set_state(BOX, position=(0, 0, 0), world=[0, 1]),
            TypeError,
            ["world=[0, 1]", "mask of shape (3,)"],
        ),
        (lambda w: w.set_state(BOX, position=(0, 0, 0), world=True), TypeError, ["world=True", "mask of shape (3,)"]),
        (lambda w: w.set_state(BOX, position=(0, 0)), ValueError, ["set_state(position)", "(2,)", "(3,) or (3, 3)"]),
        (lambda w: w.set_state(BOX, position=(0, 0, math.nan)), ValueError, ["set_state(position)", "nan", "finite"]),
        (lambda w: w.set_state(BOX, linear_velocity="up"), TypeError, ["set_state(linear_velocity)", "'up'", "(3,)"]),
        (lambda w: w.apply_impulse(BOX, (0, 0, math.inf)), ValueError, ["apply_impulse(impulse)", "inf", "finite"]),
        (lambda w: w.apply_impulse(BOX, (0, 0, 1), point=(0, 0)), ValueError, ["apply_impulse(point)", "(2,)"]),
        (lambda w: w.apply_impulse(PADDLE, (0, 0, 1)), ValueError, ["'paddle'", "kinematic", "set_state("]),
        (lambda w: w.apply_force(WALL, (0, 0, 1)), ValueError, ["apply_force", "'wall'", "static", "dynamic"]),
        (lambda w: w.step(0), ValueError, ["num_steps=0", "at least 1"]),
        (lambda w: w.step(1.5), ValueError, ["num_steps=1.5", "whole number"]),
        (lambda w: w.step("10"), ValueError, ["num_steps='10'", "whole number"]),
        (lambda w: w.contacts(world=None), TypeError, ["contacts(world=None)", "one int"]),
        (lambda w: w.contacts(world=5), IndexError, ["contacts(world=5)", "0 to 2"]),
        (lambda w: w.reset(world="all"), TypeError, ["reset(world='all')", "mask"]),
        (lambda w: w.restore(None), TypeError, ["restore(None)", "snapshot"]),
        (lambda w: w.set_heights(BOX, np.zeros((2, 2))), ValueError, ["'box'", "HeightField"]),
        (lambda w: w.set_parameters(BOX, colour=1), TypeError, ["colour", "friction"]),
        (lambda w: w.set_parameters(BOX, mass=-1), ValueError, ["'box'", "mass", "-1", "above zero"]),
        (lambda w: w.set_parameters(BOX, mass=[1, 2]), ValueError, ["mass", "[1, 2]", "3 selected worlds"]),
        (lambda w: w.set_parameters(BOX, restitution=2), ValueError, ["'box'", "restitution", "0 to 1"]),
        (lambda w: w.set_parameters(BOX, inertia=(1, 1, 3)), ValueError, ["'box'", "inertia", "sum of the other two"]),
        (lambda w: w.set_parameters(WALL, mass=1), ValueError, ["'wall'", "mass", "static"]),
        (lambda w: w.add_body(physics.Sphere(1.0)), ValueError, ["add_body", "num_worlds=3", "num_worlds=1"]),
        (lambda w: w.remove_body(BOX), ValueError, ["remove_body", "num_worlds=3", "num_worlds=1"]),
    ],
)
def test_mistakes_change_nothing(world, call, error, texts):
    before = {name: getattr(world, name).copy() for name in ARRAYS}
    energy = world.kinetic_energy()
    with pytest.raises(error) as raised:
        call(world)
    for text in texts:
        assert text in str(raised.value)
    for name in ARRAYS:
        assert np.array_equal(getattr(world, name), before[name])
    assert np.array_equal(world.kinetic_energy(), energy)
    world.step()


def test_potential_energy_of_all_fields():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_field(physics.PointGravity(center=(0, 0, 0), mu=100.0))
    scene.add_body(physics.Sphere(0.1), mass=2.0, position=(3, 0, 4))
    scene.add_body(physics.Sphere(0.1), motion="static", position=(0, 0, -9))
    world = physics.World(scene, num_worlds=2)
    assert world.potential_energy() == pytest.approx([2 * 9.81 * 4 - 2 * 100 / 5] * 2, rel=1e-14)
    assert world.potential_energy().shape == (2,) and world.angular_momentum().shape == (2, 3)


def test_a_scene_may_have_no_field_and_no_static_body_and_no_body():
    scene = physics.Scene()
    physics.World(scene).step(3)
    scene.add_body(physics.Sphere(0.1), mass=1.0, linear_velocity=(1, 0, 0))
    world = physics.World(scene, options=physics.Options(time_step=0.01))
    world.step(100)
    assert world.position[0, 0].tolist() == pytest.approx([1, 0, 0])
    assert world.potential_energy().tolist() == [0.0] and len(world.contacts()) == 0

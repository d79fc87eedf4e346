"""Nothing outside a snapshot decides the future: scratch memory may hold anything when a step begins."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene


def bouncing_heap():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    material = physics.Material(friction=0.4, restitution=0.3, rolling_friction=0.002)
    shapes = (physics.Box((0.1, 0.15, 0.2)), physics.Sphere(0.12), physics.Capsule(0.08, 0.15))
    for index in range(6):
        position = (0.11 * (index % 2), 0.07 * (index % 3), 0.3 + 0.45 * index)
        spin = (1.0, 0.3 * index, 0.2)
        scene.add_body(shapes[index % 3], density=1000.0, position=position, angular_velocity=spin, material=material)
    return scene


def rolling_crowd():
    """Enough bodies for the hash grid and the pile tier."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.HeightField(0.1 * np.random.default_rng(0).random((9, 9)), (4, 4)), motion="static")
    for index in range(80):
        place = (0.25 * (index % 4) - 0.4, 0.25 * (index // 4 % 4) - 0.4, 0.4 + 0.25 * (index // 16))
        scene.add_body(physics.Sphere(0.1) if index % 2 else physics.Box((0.08,) * 3), mass=1.0, position=place)
    return scene


def fill_with_noise(world, generator):
    """Every scratch table: numbers that are wrong, but no addresses."""
    for name, table in world._storage.workspaces.tables[0].items():
        for field in table.dtype.names or (None,):
            column = table if field is None else table[field]
            if name in ("query", "probe"):  # addresses of the question that is asked
                continue
            if column.dtype.kind == "f":
                column[...] = generator.standard_normal(column.shape)
            else:
                column[...] = generator.integers(0, 2, column.shape)


@pytest.mark.parametrize(
    ("scene", "steps", "time_step"),
    [(bouncing_heap, 150, 1 / 100), (push_scene, 100, 0.005), (rolling_crowd, 60, 1 / 60)],
)
def test_scratch_memory_decides_nothing(scene, steps, time_step):
    generator = np.random.default_rng(1)
    pushes = push_impulses(generator, steps)
    worlds = [physics.World(scene(), options=physics.Options(time_step=time_step)) for _ in range(2)]
    for push in pushes:
        for world in worlds:
            world.apply_impulse(2, push)
            world.step(1)
        assert np.array_equal(worlds[0].linear_velocity, worlds[1].linear_velocity)
        assert np.array_equal(worlds[0].contacts(), worlds[1].contacts())
        fill_with_noise(worlds[1], generator)


def test_no_step_of_a_pushed_box_gains_energy():
    """A jolt in a short part of a step was handed on as a force, and threw the box off at kilometres a second."""
    count = 64
    options = physics.Options(time_step=PUSH_STEP, sleeping=False)
    world = physics.World(push_scene(), num_worlds=count, options=options)
    pushes = push_impulses(np.random.default_rng(0), 64 * count).reshape(64, count, 3)
    for turn in range(100):
        world.impulse_buffer[:, PUSHED, :3] = pushes[turn % 64]
        world.step(PUSH_STEPS)
        # Of order 1e-4 J, as the trapezoid leaves it; a push brings up to 0.2 J.
        assert world.report().energy_change.max() < 1e-3


@pytest.mark.parametrize(
    ("scene", "steps", "time_step"),
    [(bouncing_heap, 400, 1 / 100), (push_scene, 200, 0.005), (rolling_crowd, 150, 1 / 60)],
)
def test_contacts_of_what_has_not_moved_are_those_that_would_be_found(scene, steps, time_step):
    worlds = [physics.World(scene(), options=physics.Options(time_step=time_step, sleeping=False)) for _ in range(2)]
    for step in range(steps):
        for world in worlds:
            if step % 100 == 60:
                world.apply_impulse(2, (0.4, 0.0, 0.1))
            if 80 < step % 100 < 85:
                world.apply_force(2, (0.3, 0.2, 0.0))
            world.step(1)
        assert np.array_equal(worlds[0].linear_velocity, worlds[1].linear_velocity)
        assert np.array_equal(worlds[0].contacts(), worlds[1].contacts())
        worlds[1]._storage.arrays["rest"]["seen"] = 0.0  # asks for every contact


def test_what_stands_feels_new_parameters_and_what_is_taken_away():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    boxes = [scene.add_body(physics.Box((0.1,) * 3), mass=1.0, position=(0, 0, 0.1 + 0.2 * k)) for k in range(3)]
    world = physics.World(scene, options=physics.Options(sleeping=False))

    def loads():
        world.step(20)
        contacts = world.contacts()
        under = contacts[contacts["body_a"] == 0]["impulse"][:, 2].sum()
        return under / world.options.time_step / 9.81

    assert loads() == pytest.approx(3.0, rel=1e-9)
    world.set_parameters(boxes[1], mass=5.0)
    assert loads() == pytest.approx(7.0, rel=1e-9)
    world.remove_body(boxes[2])
    assert loads() == pytest.approx(6.0, rel=1e-9)
    world.set_parameters(boxes[0], friction=0.0)
    world.apply_force(boxes[0], (0.0, 0.0, 9.81))
    assert loads() == pytest.approx(5.0, rel=1e-9)
    assert loads() == pytest.approx(6.0, rel=1e-9)  # the force has ended with the call

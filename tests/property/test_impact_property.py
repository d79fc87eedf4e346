"""What holds in every step of every scene with impacts."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from avalanche_gym import physics

GRAVITY = np.array([0.0, 0.0, -9.81])


def any_shape(generator: np.random.Generator) -> physics.Shape:
    size = generator.uniform(0.05, 0.2, 3)
    shapes = (
        physics.Sphere(size[0]),
        physics.Capsule(size[0], size[1]),
        physics.Box(size),
        physics.Cylinder(size[0], size[1]),
        physics.ConvexHull(0.1 * generator.normal(size=(10, 3))),
    )
    return shapes[generator.integers(len(shapes))]


def any_turn(generator: np.random.Generator) -> NDArray[np.float64]:
    turn = generator.normal(size=4)
    return turn / np.linalg.norm(turn)


def grounds(generator: np.random.Generator) -> list[physics.Shape]:
    heights = 0.2 * generator.normal(size=(12, 12))
    return [physics.Plane(), physics.HeightField(heights, size=(8.0, 8.0)), physics.Box((4.0, 4.0, 0.1))]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("restitution", [0.0, 0.7, 1.0])
def test_impulses_of_the_contacts_are_the_change_of_momentum(seed: int, restitution: float) -> None:
    """Of every body in every step, to round-off: blows of contacts that are out of reach at its end count too."""
    generator = np.random.default_rng(seed)
    time_step = (1 / 30, 1 / 60, 1 / 240)[seed % 3]
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity(tuple(GRAVITY)))
    material = physics.Material(friction=0.4 * (seed % 2), restitution=restitution)
    scene.add_body(grounds(generator)[seed % 3], motion="static", position=(0, 0, -0.1), material=material)
    masses = generator.uniform(0.5, 3.0, 6)
    for number, mass in enumerate(masses):
        scene.add_body(
            any_shape(generator), mass=mass, position=(*generator.uniform(-0.3, 0.3, 2), 0.6 + 0.5 * number),
            orientation=any_turn(generator), linear_velocity=2.0 * generator.normal(size=3),
            angular_velocity=5.0 * generator.normal(size=3), material=material,
            center_of_mass=(0.0, 0.0, 0.0),
        )  # fmt: skip
    world = physics.World(scene, options=physics.Options(time_step=time_step))
    for _ in range(round(1.5 / time_step)):
        before = masses[:, None] * world.linear_velocity[0, 1:]
        world.step(1)
        given = np.zeros((len(masses) + 1, 3))
        for contact in world.contacts():
            given[contact["body_b"]] += contact["impulse"]
            given[contact["body_a"]] -= contact["impulse"]
        gained = masses[:, None] * world.linear_velocity[0, 1:] - before - time_step * masses[:, None] * GRAVITY
        largest = max(np.abs(before).max(), np.abs(given).max())
        np.testing.assert_allclose(gained, given[1:], rtol=0.0, atol=1e-12 * largest)


@pytest.mark.parametrize("moving", [False, True])
def test_who_else_is_in_the_world_changes_nothing(moving: bool) -> None:
    """Bodies that meet nobody but the ground take the same way, bit for bit, as each of them alone."""

    def world_of(chosen: range) -> physics.World:
        generator = np.random.default_rng(1)
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity(tuple(GRAVITY)))
        material = physics.Material(friction=0.5, restitution=0.9)
        if moving:
            scene.add_body(
                physics.Box((9, 9, 0.1)), motion="kinematic", position=(0, 0, -0.1), linear_velocity=(0.1, 0.0, 0.7),
                material=material,
            )  # fmt: skip
        else:
            scene.add_body(physics.Plane(), motion="static", material=material)
        for number in range(70):
            turn, height = any_turn(generator), generator.uniform(0.3, 0.6)
            if number in chosen:
                shape = (physics.Sphere(0.1), physics.Box((0.1, 0.08, 0.05)), physics.Capsule(0.05, 0.1))[number % 3]
                place = (0.9 * (number % 10) - 4.0, 0.9 * (number // 10) - 3.0, height)
                scene.add_body(shape, mass=1.0, position=place, orientation=turn, material=material)
        return physics.World(scene, options=physics.Options(time_step=1 / 60))

    crowd = world_of(range(70))
    crowd.step(40)
    for number in (0, 10, 20):
        single = world_of(range(number, number + 1))
        single.step(40)
        np.testing.assert_array_equal(single.position[0, 1], crowd.position[0, number + 1])


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 120])
@pytest.mark.parametrize("number", range(5), ids=["sphere", "capsule", "box", "cylinder", "hull"])
@pytest.mark.parametrize("kind", range(3), ids=["plane", "field", "box"])
def test_a_lone_body_without_loss_keeps_or_loses_energy(kind: int, number: int, time_step: float) -> None:
    """In every step, to round-off, however far it turns in one: up to a radian here, and more after a blow."""
    for seed in range(3):
        generator = np.random.default_rng(6 + seed)
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity(tuple(GRAVITY)))
        material = physics.Material(friction=0.5 * (seed % 2), restitution=1.0)
        scene.add_body(grounds(generator)[kind], motion="static", position=(0, 0, -0.1), material=material)
        size = generator.uniform(0.05, 0.2, 3)
        shape = (
            physics.Sphere(size[0]), physics.Capsule(size[0], size[1]), physics.Box(size),
            physics.Cylinder(size[0], size[1]), physics.ConvexHull(0.1 * generator.normal(size=(10, 3))),
        )[number]  # fmt: skip
        scene.add_body(
            shape, mass=1.0, position=(0.1, 0.2, 1.0), orientation=any_turn(generator),
            linear_velocity=generator.normal(size=3), angular_velocity=15.0 * generator.normal(size=3),
            material=material,
        )  # fmt: skip
        world = physics.World(scene, options=physics.Options(time_step=time_step))
        start = world.kinetic_energy()[0] + 9.81
        before = world.kinetic_energy()[0] + world.potential_energy()[0]
        for _ in range(round(1.0 / time_step)):
            world.step(1)
            after = world.kinetic_energy()[0] + world.potential_energy()[0]
            assert after <= before + 1e-12 * start
            before = after
            if np.abs(world.position[0, 1, :2]).max() > 3.7:
                break


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_a_stick_that_whirls_on_a_plane_gains_no_energy(restitution: float) -> None:
    """By up to 7 rad in a step: it rolls from edge to edge. What is left is the error of its smooth parts (order 2)."""
    for seed in range(3):
        generator = np.random.default_rng(seed)
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity(tuple(GRAVITY)))
        material = physics.Material(friction=0.0, restitution=restitution)
        scene.add_body(physics.Plane(), motion="static", material=material)
        scene.add_body(
            physics.Box((0.02, 0.02, 0.3)), mass=1.0, position=(0, 0, 0.8), orientation=any_turn(generator),
            angular_velocity=12.0 * generator.normal(size=3), material=material,
        )  # fmt: skip
        world = physics.World(scene, options=physics.Options(time_step=1 / 30))
        before = world.kinetic_energy()[0] + world.potential_energy()[0]
        start = before
        for _ in range(45):
            world.step(1)
            after = world.kinetic_energy()[0] + world.potential_energy()[0]
            assert after <= before + 2e-2 * start
            before = after


def rough_ground(surface: str) -> tuple[physics.Shape, float]:
    """A ground, and the height over which all starts are clear of it."""
    heights = 0.1 * np.random.default_rng(5).normal(size=(33, 33))
    if surface == "mesh":
        line = np.linspace(-4.0, 4.0, 33)
        x, y = np.meshgrid(line, line)
        i, j = (index.ravel() for index in np.mgrid[:32, :32])
        a = 33 * i + j
        faces = np.concatenate([np.stack([a, a + 1, a + 34], 1), np.stack([a, a + 34, a + 33], 1)])
        return physics.TriangleMesh(np.stack([x, y, heights], 2).reshape(-1, 3), faces), 0.35
    return physics.HeightField(heights, (8.0, 8.0), surface=surface), 0.35


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 60, 1 / 240])
@pytest.mark.parametrize("surface", ["facets", "mesh"])
def test_a_ball_that_jams_between_facets_gains_no_energy(surface: str, time_step: float) -> None:
    """Where friction holds whatever presses, the impulses of a smooth step have no bound: such a step is struck."""
    ground, top = rough_ground(surface)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity(tuple(GRAVITY)))
    material = physics.Material(friction=1.0)
    scene.add_body(ground, motion="static", material=material)
    ball = scene.add_body(physics.Sphere(0.12), mass=1.0, position=(0, 0, top + 1.0), material=material)
    count = 24
    world = physics.World(scene, num_worlds=count, options=physics.Options(time_step=time_step))
    generator = np.random.default_rng(2)
    for number in range(count):
        world.set_state(
            ball, world=number, position=(*generator.uniform(-0.5, 0.5, 2), top + generator.uniform(0.4, 0.8)),
            linear_velocity=generator.normal(size=3), angular_velocity=5.0 * generator.normal(size=3),
        )  # fmt: skip
    before = world.kinetic_energy() + world.potential_energy()
    start = world.kinetic_energy() + 9.81
    for _ in range(round(1.5 / time_step)):
        world.step(1)
        after = world.kinetic_energy() + world.potential_energy()
        assert np.all(after <= before + 5e-4 * start)
        before = after


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 60, 1 / 240])
@pytest.mark.parametrize("number", range(3), ids=["capsule", "box", "stick"])
def test_a_body_that_rolls_and_whirls_never_has_more_energy_than_at_the_start(number: int, time_step: float) -> None:
    """On a plane, to round-off; what it loses in one step it may regain in part in another: order 2."""
    shape = (physics.Capsule(0.08, 0.15), physics.Box((0.15, 0.1, 0.07)), physics.Box((0.02, 0.02, 0.3)))[number]
    for friction in (0.0, 0.3, 1.0):
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity(tuple(GRAVITY)))
        material = physics.Material(friction=friction)
        scene.add_body(physics.Plane(), motion="static", material=material)
        body = scene.add_body(shape, mass=1.0, position=(0, 0, 1.0), material=material)
        count = 6
        world = physics.World(scene, num_worlds=count, options=physics.Options(time_step=time_step))
        generator = np.random.default_rng(number)
        for lane in range(count):
            axis = generator.normal(size=3)
            world.set_state(
                body, world=lane, position=(0.0, 0.0, generator.uniform(0.4, 0.8)), orientation=any_turn(generator),
                linear_velocity=generator.normal(size=3), angular_velocity=5.0 * lane * axis / np.linalg.norm(axis),
            )  # fmt: skip
        before = world.kinetic_energy() + world.potential_energy()
        start, scale = before, world.kinetic_energy() + 9.81
        for _ in range(round(1.5 / time_step)):
            world.step(1)
            after = world.kinetic_energy() + world.potential_energy()
            assert np.all(after <= before + 2e-3 * scale)
            assert np.all(after <= start + 1e-12 * scale)
            before = after

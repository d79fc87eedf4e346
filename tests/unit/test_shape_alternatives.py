"""Single worlds give a body another of its shapes, without a rebuild."""

from __future__ import annotations

import numpy as np
import pytest

from avalanche_gym import physics

SHAPES = (
    physics.Box((0.1, 0.2, 0.3)),
    physics.Sphere(0.15),
    physics.Compound(
        [(physics.Sphere(0.1), (0.3, 0.0, 0.0), (1, 0, 0, 0)), (physics.Box((0.1, 0.1, 0.1)), (0, 0, 0), (1, 0, 0, 0))]
    ),
    physics.ConvexHull(np.array([(0, 0, 0), (0.4, 0, 0), (0, 0.3, 0), (0, 0, 0.2)], float)),
)


def scene_with(shape: physics.shapes.Shape, alternatives: tuple[physics.shapes.Shape, ...] = ()) -> physics.Scene:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    scene.add_body(
        shape, density=500.0, position=(0.1, 0.2, 0.6), orientation=(0.8, 0.6, 0.0, 0.0),
        angular_velocity=(1.0, 2.0, 3.0), name="changeling", alternatives=alternatives,
    )  # fmt: skip
    scene.add_body(physics.Sphere(0.2), density=500.0, position=(0.15, 0.2, 1.3))
    return scene


def trajectory(world: physics.World, lane: int) -> np.ndarray:
    places = []
    for _ in range(40):
        world.step(3)
        places.append(np.concatenate([world.position[lane].ravel(), world.orientation[lane].ravel()]))
    return np.array(places)


def test_a_chosen_shape_moves_as_if_the_world_had_been_built_with_it() -> None:
    world = physics.World(scene_with(SHAPES[0], SHAPES[1:]), num_worlds=5)
    world.set_parameters(1, shape=[0, 1, 2, 3, 2])
    places = _all_lanes(world)
    for lane, number in enumerate([0, 1, 2, 3, 2]):
        alone = trajectory(physics.World(scene_with(SHAPES[number])), 0)
        assert np.abs(places[lane] - alone).max() < 1e-9, number
    assert (places[2] == places[4]).all()


def _all_lanes(world: physics.World) -> list[np.ndarray]:
    lanes: list[list[np.ndarray]] = [[] for _ in range(world.num_worlds)]
    for _ in range(40):
        world.step(3)
        for lane in range(world.num_worlds):
            lanes[lane].append(np.concatenate([world.position[lane].ravel(), world.orientation[lane].ravel()]))
    return [np.array(lane) for lane in lanes]


def test_a_resting_body_that_grows_is_pushed_up() -> None:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    scene.add_body(
        physics.Box((0.1, 0.1, 0.1)), density=500.0, position=(0, 0, 0.1), alternatives=[physics.Box((0.1, 0.1, 0.12))]
    )
    world = physics.World(scene)
    world.step(100)
    world.set_parameters(1, shape=1)
    world.step(100)
    assert np.isclose(world.position[0, 1, 2], 0.12, atol=1e-6)


def test_reset_and_snapshot_keep_the_chosen_shape() -> None:
    world = physics.World(scene_with(SHAPES[0], SHAPES[1:]), num_worlds=2)
    start = world.position.copy()
    world.set_parameters(1, shape=3, world=1)
    assert (world.position == start).all()
    saved = world.snapshot()
    first = trajectory(world, 1)
    world.reset()
    assert np.allclose(world.position, start, rtol=0, atol=1e-15)
    assert (trajectory(world, 1) == first).all()
    world.set_parameters(1, shape=0)
    world.restore(saved)
    assert (trajectory(world, 1) == first).all()


def test_queries_meet_the_shape_that_the_world_has() -> None:
    world = physics.World(scene_with(SHAPES[0], SHAPES[1:]), num_worlds=2)
    world.set_parameters(1, shape=1, world=1)
    down = world.ray_cast((0.1, 0.2, 1.0), (0.0, 0.0, -1.0), only=1)
    assert np.isclose(down["distance"][1], 0.4 - 0.15) and not np.isclose(down["distance"][0], 0.4 - 0.15)
    assert np.isclose(world.closest_point((0.1, 0.2, 1.0), only=1)["distance"][1], 0.4 - 0.15)
    assert world.overlap(physics.Sphere(0.01), (0.1, 0.2 + 0.14, 0.6), only=1)[1, 1]
    assert not world.overlap(physics.Sphere(0.001), (0.1, 0.2 + 0.14, 0.6 + 0.14), only=1)[1, 1]


def test_mass_follows_density_and_may_be_set_at_the_same_time() -> None:
    world = physics.World(scene_with(SHAPES[0], SHAPES[1:]), num_worlds=2)
    world.set_parameters(1, shape=1)
    world.set_parameters(1, shape=1, mass=7.0, world=1)
    height = world.position[:, 1, 2]
    energy = world.potential_energy() - np.array([500.0 * 4 / 3 * np.pi * 0.2**3 * 9.81 * 1.3] * 2)
    assert np.allclose(energy, np.array([500.0 * 4 / 3 * np.pi * 0.15**3, 7.0]) * 9.81 * height)


@pytest.mark.parametrize(
    ("values", "message"),
    [({"shape": 4}, "1 to 3"), ({"shape": -1}, "1 to 3"), ({"shape": 0.5}, "1 to 3"), ({"shape": [1, 2, 3]}, "1 to 3")],
)
def test_a_shape_that_is_not_there_is_refused(values: dict[str, object], message: str) -> None:
    world = physics.World(scene_with(SHAPES[0], SHAPES[1:]), num_worlds=2)
    with pytest.raises(ValueError, match=message):
        world.set_parameters(1, **values)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="one shape alone"):
        world.set_parameters(2, shape=0)


def test_alternatives_that_cannot_be_are_refused() -> None:
    scene = physics.Scene()
    with pytest.raises(ValueError, match="set_heights"):
        scene.add_body(physics.Sphere(1.0), alternatives=[physics.Plane()])
    with pytest.raises(ValueError, match="leave it out"):
        scene.add_body(physics.Sphere(1.0), inertia=(1, 1, 1), alternatives=[physics.Sphere(2.0)])
    with pytest.raises(TypeError, match="list of shapes"):
        scene.add_body(physics.Sphere(1.0), alternatives=physics.Sphere(2.0))  # type: ignore[arg-type]
    scene.add_body(physics.Sphere(1.0), alternatives=[physics.Sphere(2.0)])
    world = physics.World(scene)
    with pytest.raises(ValueError, match="bodies stay"):
        world.add_body(physics.Sphere(1.0))

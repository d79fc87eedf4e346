"""The demos: parameters of the original, bodies that come and go, and what must not stop them."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes import demos, falling_bodies


def test_extents_and_gravity_are_those_of_the_original():
    showcase, terrain, carpet, planet = (demo() for demo in demos.DEMOS.values())
    assert showcase.world.scene.bodies[0].shape.half_extents == (10.0, 10.0, 0.5)
    ground = terrain.world.scene.bodies[0]
    assert ground.shape.extent == (20.0, 20.0)
    assert (ground.shape.heights.min(), ground.shape.heights.max()) == (0.0, 8.0)
    assert ground.material.friction == terrain.material.friction == 0.0
    assert carpet.world.scene.bodies[0].shape.extent == (30.0, 30.0)
    assert planet.world.scene.fields == [physics.PointGravity((0.0, 0.0, 0.0), 100.0)]
    radii = np.linalg.norm(planet.world.scene.bodies[0].shape.vertices, axis=1)
    assert abs(radii.mean() - 5.0) < 0.25
    assert [demo.interval for demo in (showcase, terrain, planet)] == [1.0, 1.0 / 12.0, 3.3]
    for demo in (showcase, terrain, carpet):
        assert demo.world.scene.fields == [physics.UniformGravity((0.0, 0.0, -9.81))]


def test_solids_are_regular():
    for solid, num_faces in ((falling_bodies.octahedron(0.5), 8), (falling_bodies.dodecahedron(0.5), 36)):
        np.testing.assert_allclose(np.linalg.norm(solid.vertices, axis=1), 0.5)
        assert len(solid.faces) == num_faces
        moments = np.linalg.eigvalsh(solid.mass_properties().inertia)
        np.testing.assert_allclose(moments, moments[0])


@pytest.mark.parametrize("name", demos.DEMOS)
def test_bodies_come_at_the_rate_and_a_reset_repeats_them(name):
    demo = demos.DEMOS[name]()
    steps = round(2.5 * demo.interval * 240)
    paths = []
    for _ in range(2):
        for _ in range(steps):
            demo.advance()
        assert len(demo.world.scene.bodies) == 1 + 3
        paths.append(demo.world.position.copy())
        demo.reset()
        assert len(demo.world.scene.bodies) == 1
    np.testing.assert_array_equal(*paths)


def test_bodies_that_leave_are_removed_and_the_oldest_makes_room(monkeypatch):
    monkeypatch.setattr(demos.Showcase, "max_bodies", 2)
    demo = demos.Showcase()
    demo.advance()
    demo.world.set_state(1, position=(0.0, 0.0, -20.0))
    demo.advance()
    assert demo.world.scene.bodies[1] is None
    for _ in range(3):
        demo.time = demo._next
        demo.advance()
    moving = [body for body in demo.world.scene.bodies if body is not None and body.motion == "dynamic"]
    assert len(moving) == 2


def test_a_body_the_engine_cannot_go_on_with_is_taken_out():
    demo = demos.Showcase()
    demo.advance()
    demo.world.apply_force(1, (1e308, 0.0, 0.0))
    demo.advance()
    assert demo.world.scene.bodies[1] is None
    demo.advance()


def test_the_carpet_is_the_wave_at_every_call():
    demo = demos.Carpet()
    for steps in (4, 1, 8):
        demo.advance(steps)
        np.testing.assert_allclose(demo.world.heights(0), demos.carpet_heights(demo.time), atol=1e-12)


def test_point_gravity_keeps_every_motion():
    demo = demos.Terrain()
    for _ in range(30):
        demo.advance(4)
    before = [getattr(demo.world, name).copy() for name in ("position", "linear_velocity", "angular_velocity")]
    demo.set_point_gravity(True)
    assert demo.has_point_gravity
    after = [getattr(demo.world, name) for name in ("position", "linear_velocity", "angular_velocity")]
    for old, new in zip(before, after, strict=True):
        np.testing.assert_allclose(new, old, atol=1e-12)
    demo.advance(4)
    demo.set_point_gravity(False)
    assert demo.world.scene.fields == [demos.GRAVITY]
    demo.advance(4)
    demo.set_point_gravity(True)
    demo.reset()
    assert not demo.has_point_gravity

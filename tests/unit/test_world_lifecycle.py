"""Bodies that come and go, resets, snapshots, batches, threads, and the report."""

import numpy as np
import pytest

from avalanche_gym import physics
from tests.world_bits import PUBLIC, bits

STEP = 0.01


def pile_scene(count=6):
    """Boxes, spheres and capsules that fall on a plane and each other."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.Plane(), motion="static", name="ground")
    bouncy = physics.Material(friction=0.4, restitution=0.3)
    shapes = (physics.Box((0.1, 0.15, 0.2)), physics.Sphere(0.12), physics.Capsule(0.08, 0.15))
    for index in range(count):
        scene.add_body(
            shapes[index % 3],
            density=1000.0,
            position=(0.11 * (index % 2), 0.07 * (index % 3), 0.3 + 0.35 * index),
            angular_velocity=(1.0, 0.3 * index, 0.2),
            material=bouncy,
            name=f"stone {index}",
        )
    return scene


# --- Bodies that come and go ----------------------------------------------------------------------


@pytest.fixture
def table():
    """Three boxes at rest on a plane, side by side."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.Plane(), motion="static", name="ground")
    for index in range(3):
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0 + index, position=(index, 0, 0.1), name=f"box {index}")
    world = physics.World(scene, options=physics.Options(time_step=STEP))
    world.step(10)
    return world


def test_a_removed_slot_reads_nan_and_is_reused(table):
    before = {name: getattr(table, name).copy() for name in PUBLIC}
    kept = [0, 1, 3]
    table.remove_body(2)
    assert table.num_bodies == 4
    for name in PUBLIC:
        assert np.isnan(getattr(table, name)[0, 2]).all()
        assert np.array_equal(getattr(table, name)[0, kept], before[name][0, kept])
    assert table.kinetic_energy()[0] < 1e-20
    assert table.potential_energy()[0] == pytest.approx(9.81 * 0.1 * (1 + 3))
    table.step(5)
    assert np.isnan(table.position[0, 2]).all() and {tuple(p) for p in contact_pairs(table)} == {(0, 1), (0, 3)}
    with pytest.raises(ValueError, match="body=2.*removed"):
        table.apply_impulse(2, (0, 0, 1))
    with pytest.raises(ValueError, match="body=2.*removed"):
        table.remove_body(2)
    ball = table.add_body(physics.Sphere(0.2), mass=1.0, position=(1, 0, 0.2), linear_velocity=(0, 0, 1), name="ball")
    assert ball == 2 and table.position[0, 2].tolist() == [1, 0, 0.2] and table.linear_velocity[0, 2, 2] == 1
    assert table.add_body(physics.Sphere(0.2), mass=1.0, position=(9, 0, 0.2), name="another") == 4
    assert table.position.shape == (1, 5, 3)
    table.step(100)
    np.testing.assert_allclose(table.position[0, [1, 3], 2], 0.1, atol=1e-9)
    np.testing.assert_allclose(table.position[0, [2, 4], 2], 0.2, atol=1e-9)


def contact_pairs(world):
    return np.stack([world.contacts()["body_a"], world.contacts()["body_b"]], axis=1)


def test_other_bodies_do_not_notice_one_that_comes_and_goes(table):
    """State, contacts, impulses of warm starts, waiting forces and parameters are kept, bit for bit."""
    twin = table.snapshot()
    table.set_parameters(3, friction=0.125)
    table.apply_force(1, (20, 0, 0))
    table.step(7)
    expected = table.position[0, [1, 3]].copy(), table.contacts()
    table.restore(twin)
    table.set_parameters(3, friction=0.125)
    table.apply_force(1, (20, 0, 0))
    table.remove_body(2)
    assert len(table.contacts()) == 8 and (table.contacts()["impulse"][:, 2] > 0).all()
    table.add_body(
        physics.Compound([(physics.Sphere(0.1), (0, 0, z), (1, 0, 0, 0)) for z in (0, 0.1)]), position=(0, 9, 9)
    )
    table.step(7)
    assert np.array_equal(table.position[0, [1, 3]], expected[0])
    ours = table.contacts()
    rest = expected[1][(expected[1]["body_b"] != 2)]
    assert all(np.array_equal(ours[name], rest[name]) for name in ours.dtype.names)


def test_a_body_that_cannot_be_added_changes_nothing(table):
    before = bits(table)
    for arguments in ({"mass": -1.0}, {"name": "box 1"}):
        with pytest.raises(ValueError, match=r"mass|box 1"):
            table.add_body(physics.Sphere(0.1), **arguments)
    assert bits(table) == before and table.num_bodies == 4
    # A mesh of needles only: found when the tables are built.
    needle = physics.TriangleMesh([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    with pytest.raises(ValueError, match="none of 1 faces is left"):
        table.add_body(needle, motion="static")
    assert bits(table) == before and table.num_bodies == 4
    table.step()


def test_heights_survive_a_rebuild():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    other = scene.add_body(physics.HeightField(np.zeros((2, 2)), size=(1, 1)), motion="static", position=(9, 0, 0))
    ground = scene.add_body(physics.HeightField(np.zeros((3, 4)), size=(4, 4)), motion="static")
    ball = scene.add_body(physics.Sphere(0.2), mass=1.0, position=(0, 0, 1))
    world = physics.World(scene, options=physics.Options(time_step=STEP))
    world.set_heights(ground, np.full((3, 4), 0.75))
    world.remove_body(other)
    world.step(100)
    assert world.position[0, ball, 2] == pytest.approx(0.95, abs=1e-9)
    snapshot = world.snapshot()
    world.add_body(physics.Sphere(0.1), mass=1.0, position=(0, 9, 9))
    world.restore(snapshot)
    world.step(10)
    assert world.position[0, ball, 2] == pytest.approx(0.95, abs=1e-9) and world.num_bodies == 3


# --- Reset and snapshot ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pile():
    return physics.World(pile_scene(), num_worlds=3, options=physics.Options(time_step=STEP))


def test_reset_by_mask(pile):
    pile.reset()
    fresh = bits(pile)
    pile.apply_force(1, (1, 0, 0))
    pile.impulse_buffer[:] = 1.0
    pile.reset()
    pile.step(30)
    after = bits(pile, 0)
    assert bits(pile, 2) == after
    pile.reset(world=np.array([True, False, True]))
    assert bits(pile, 0) == [part[: len(part) // 3] for part in fresh[:4]] + [b""]
    assert bits(pile, 1) == after
    pile.step(30)
    assert bits(pile, 0) == bits(pile, 2) == after


def test_a_snapshot_holds_every_bit_that_decides_the_future(pile):
    """Taken in the middle of a call's doings: loaded contacts, waiting forces, other parameters in one world."""
    pile.reset()
    pile.step(60)
    pile.set_parameters(2, mass=9.0, friction=0.1, world=1)
    pile.apply_force(3, (5, 0, 0))
    pile.impulse_buffer[2, 4] = (1, 0, 0, 0, 0.1, 0)
    snapshot = pile.snapshot()
    now = bits(pile)
    futures = []
    for disturbance in (0.0, 3.0, -5.0):
        pile.step(40)
        futures.append(bits(pile))
        pile.apply_impulse(1, (disturbance, 0, 1))
        pile.step(13)
        pile.reset(world=0)
        pile.restore(snapshot)
        assert bits(pile) == now
    assert futures[0] == futures[1] == futures[2]
    assert futures[0] != now


def test_a_snapshot_brings_removed_bodies_back():
    world = physics.World(pile_scene(3), options=physics.Options(time_step=STEP))
    world.step(40)
    snapshot = world.snapshot()
    world.step(20)
    future = bits(world)
    world.restore(snapshot)
    world.remove_body(2)
    ball = world.add_body(physics.Sphere(0.3), mass=1.0, position=(5, 0, 1), name="late")
    world.add_body(physics.Sphere(0.3), mass=1.0, position=(7, 0, 1))
    both = world.snapshot()
    world.restore(snapshot)
    assert world.position.shape == (1, 4, 3)
    world.step(20)
    assert bits(world) == future
    world.restore(both)
    assert world.position[0, ball, 0] == 5 and world.num_bodies == 5
    with pytest.raises(ValueError, match="another World"):
        physics.World(pile_scene(3)).restore(snapshot)


# --- Batches and threads --------------------------------------------------------------------------


def test_a_batch_is_bit_equal_to_single_worlds_whatever_the_threads():
    scene = pile_scene(5)
    pushes = np.array([(0, 0, 0), (0.5, 0, 0), (0, -0.7, 0), (0.3, 0.2, 1.0), (1, 1, 1)])
    batch = physics.World(scene, num_worlds=5, options=physics.Options(time_step=STEP))
    threaded = physics.World(scene, num_worlds=5, options=physics.Options(time_step=STEP, threads=2))
    single = physics.World(scene, options=physics.Options(time_step=STEP))
    for world in (batch, threaded):
        for _ in range(5):
            world.apply_impulse(2, pushes)
            world.step(12)
    assert bits(batch) == bits(threaded)
    assert np.array_equal(batch.report().residual, threaded.report().residual)
    for lane, push in enumerate(pushes):
        single.reset()
        for _ in range(5):
            single.apply_impulse(2, push)
            single.step(12)
        assert bits(single) == bits(batch, lane)
    assert len({tuple(position) for position in batch.position[:, 2]}) == 5


def test_one_call_of_many_steps_equals_many_calls():
    worlds = [physics.World(pile_scene(3), options=physics.Options(time_step=STEP)) for _ in range(2)]
    worlds[0].step(50)
    for _ in range(50):
        worlds[1].step()
    assert bits(worlds[0]) == bits(worlds[1])


# --- Report ---------------------------------------------------------------------------------------


def test_the_report_is_that_of_the_last_call(pile):
    pile.reset()
    pile.step(80)
    energy = pile.kinetic_energy() + pile.potential_energy()
    pile.step(25)
    report = pile.report()
    change = pile.kinetic_energy() + pile.potential_energy() - energy
    np.testing.assert_allclose(report.energy_change, change, atol=1e-9)
    assert (report.energy_change < 0).all()
    assert report.steps.tolist() == [25] * 3 and (report.contacts > 3).all()
    assert np.isfinite(report.residual).all() and (report.iterations > 0).all() and (report.penetration >= 0).all()
    assert set(report.tier) <= {"certificate", "single contact", "newton", "newton with sweeps", "sweeps"}
    for name in ("residual", "iterations", "tier", "events", "penetration", "energy_change"):
        assert getattr(report, name).shape == (3,)
    with pytest.raises(AttributeError):
        report.residual = 0.0

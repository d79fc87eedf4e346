"""Whatever is done to worlds: lanes stay independent to the bit, units do not matter, energy does not grow."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avalanche_gym import physics
from avalanche_gym.physics.mass_properties import rotation_matrix

STEP = 0.01
WORLDS = 3
# Share of the energy that eight steps may add where a body turns while it touches: first order in the step.
ENERGY_SLACK = 1e-4


def pile_scene(length=1.0, mass=1.0, time=1.0, lift=0.0):
    """A box, a sphere and a capsule above a plane, in units that are these multiples of ours."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81 * length / time**2)))
    scene.add_body(physics.Plane(), motion="static", position=(0, 0, 0))
    material = physics.Material(friction=0.4, restitution=0.25)
    for index, (kind, size) in enumerate([("box", (0.1, 0.15, 0.2)), ("sphere", (0.12,)), ("capsule", (0.08, 0.15))]):
        size = [length * value for value in size]
        shape = {"box": physics.Box, "sphere": physics.Sphere, "capsule": physics.Capsule}[kind]
        scene.add_body(
            shape(size) if kind == "box" else shape(*size),
            mass=mass * (1.0 + index),
            position=np.array([0.05 * index, 0.03, lift + 0.3 + 0.3 * index]) * length,
            angular_velocity=np.array([1.0, 0.5 * index, 0.2]) / time,
            material=material,
        )
    return scene


def bits(world, lane):
    arrays = (world.position, world.orientation, world.linear_velocity, world.angular_velocity)
    return b"".join([array[lane].tobytes() for array in arrays] + [world.contacts(world=lane).tobytes()])


@pytest.fixture(scope="module")
def worlds():
    """A batch, the same in two threads, and a single world; with bodies near the ground, so that contacts are many."""
    scene = pile_scene(lift=-0.1)
    options = physics.Options(time_step=STEP)
    return (
        physics.World(scene, num_worlds=WORLDS, options=options),
        physics.World(scene, num_worlds=WORLDS, options=physics.Options(time_step=STEP, threads=2)),
        physics.World(scene, options=options),
    )


BODY = st.integers(1, 3)
VECTOR = st.tuples(*[st.floats(-2, 2)] * 3)
LANE = st.integers(0, WORLDS - 1)
CALLS = st.lists(
    st.one_of(
        st.tuples(st.just("step"), st.integers(1, 12)),
        st.tuples(st.just("impulse"), BODY, VECTOR, LANE),
        st.tuples(st.just("force"), BODY, VECTOR, LANE),
        st.tuples(st.just("place"), BODY, VECTOR, LANE),
        st.tuples(st.just("mass"), BODY, st.floats(0.1, 10), LANE),
        st.tuples(st.just("reset"), LANE),
    ),
    min_size=3,
    max_size=14,
)


def perform(world, call, lane_map):
    """One call on a world; ``lane_map`` says where a lane is in it, or is not."""
    what, *arguments = call
    if what == "step":
        world.step(arguments[0])
        return
    lane = lane_map(arguments[-1])
    if lane is None:
        return
    if what == "impulse":
        world.apply_impulse(arguments[0], arguments[1], point=world.position[lane, arguments[0]] + 0.1, world=lane)
    elif what == "force":
        world.apply_force(arguments[0], 5 * np.array(arguments[1]), world=lane)
    elif what == "place":
        place = np.array(arguments[1]) * 0.2 + [0, 0, 0.6]
        world.set_state(arguments[0], position=place, linear_velocity=arguments[1], world=lane)
    elif what == "mass":
        world.set_parameters(arguments[0], mass=arguments[1], friction=0.1 * arguments[1], world=lane)
    else:
        world.reset(world=lane)


@settings(max_examples=25)
@given(calls=CALLS, cut=st.integers(0, 14))
def test_lanes_are_independent_and_snapshots_exact(worlds, calls, cut):
    batch, threaded, single = worlds
    for world in worlds:
        for body, mass in ((1, 1.0), (2, 2.0), (3, 3.0)):
            world.set_parameters(body, mass=mass, friction=0.4)
        world.reset()
    for call in calls[:cut]:
        perform(batch, call, lambda lane: lane)
    snapshot = batch.snapshot()
    for call in calls[cut:]:
        perform(batch, call, lambda lane: lane)
    expected = [bits(batch, lane) for lane in range(WORLDS)]
    batch.restore(snapshot)
    for call in calls[cut:]:
        perform(batch, call, lambda lane: lane)
    assert [bits(batch, lane) for lane in range(WORLDS)] == expected
    for call in calls:
        perform(threaded, call, lambda lane: lane)
    assert [bits(threaded, lane) for lane in range(WORLDS)] == expected
    chosen = len(calls) % WORLDS
    for call in calls:
        perform(single, call, lambda lane: 0 if lane == chosen else None)
    assert bits(single, 0) == expected[chosen]


@settings(max_examples=8)
@given(st.integers(-12, 12), st.integers(-6, 6), st.integers(-8, 8))
def test_units_do_not_matter(length, mass, time):
    """Powers of two scale floats without rounding, powers of four also their roots: not a bit may differ."""
    length, mass, time = 2.0**length, 4.0**mass, 2.0**time
    steps = 60
    reference = physics.World(pile_scene(), options=physics.Options(time_step=STEP))
    world = physics.World(pile_scene(length, mass, time), options=physics.Options(time_step=STEP * time))
    reference.step(steps)
    world.step(steps)
    assert np.array_equal(world.position, reference.position * length)
    assert np.array_equal(world.orientation, reference.orientation)
    assert np.array_equal(world.angular_velocity, reference.angular_velocity / time)
    force = mass * length / time
    assert np.array_equal(world.contacts()["impulse"], reference.contacts()["impulse"] * force)
    assert len(reference.contacts()) >= 3


@pytest.fixture(scope="module")
def tumblers():
    scene = pile_scene()
    return physics.World(scene, options=physics.Options(time_step=1 / 240))


UNIT = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


@settings(max_examples=25)
@given(st.lists(st.tuples(UNIT, VECTOR, VECTOR), min_size=3, max_size=3))
def test_energy_does_not_grow(tumblers, states):
    """Bodies thrown on the ground in any pose, with restitution 0.0625 and friction."""
    tumblers.reset()
    for body, (turn, velocity, spin) in enumerate(states, start=1):
        tumblers.set_state(
            body,
            position=(2.0 * body, 0, 0.4),
            orientation=np.array(turn) / np.linalg.norm(turn),
            linear_velocity=velocity,
            angular_velocity=3 * np.array(spin),
        )
    energy = tumblers.kinetic_energy() + tumblers.potential_energy()
    scale = energy[0]
    for _ in range(30):
        tumblers.step(8)
        after = tumblers.kinetic_energy() + tumblers.potential_energy()
        assert after[0] <= energy[0] + ENERGY_SLACK * scale
        energy = after


@settings(max_examples=25)
@given(UNIT, VECTOR, VECTOR, VECTOR, st.tuples(*[st.floats(0.5, 1.0)] * 3))
def test_frames_and_impulses_agree_with_plain_mechanics(turn, velocity, spin, impulse, moments):
    """A body whose centre and principal axes are not its frame's, against NumPy."""
    q = np.array(turn) / np.linalg.norm(turn)
    axes = np.linalg.qr(np.eye(3) + 0.1 * np.arange(9).reshape(3, 3))[0]
    inertia = axes @ np.diag(moments) @ axes.T
    offset = np.array([0.2, -0.1, 0.3])
    scene = physics.Scene()
    scene.add_body(
        physics.Sphere(0.1),
        mass=2.0,
        inertia=inertia,
        center_of_mass=offset,
        position=(1, 2, 3),
        orientation=q,
        linear_velocity=velocity,
        angular_velocity=spin,
    )
    world = physics.World(scene)
    rotation = rotation_matrix(q)
    point = np.array([1.5, 2.0, 2.5])
    arm = rotation @ offset
    center = np.array([1, 2, 3]) + arm
    tensor = rotation @ inertia @ rotation.T
    speed = np.array(velocity) + np.cross(spin, arm) + np.array(impulse) / 2.0
    turned = np.array(spin) + np.linalg.solve(tensor, np.cross(point - center, impulse))
    energy = 0.5 * 2.0 * speed @ speed + 0.5 * turned @ tensor @ turned
    world.apply_impulse(0, impulse, point=point)
    np.testing.assert_allclose(world.angular_velocity[0, 0], turned, atol=1e-12)
    np.testing.assert_allclose(world.linear_velocity[0, 0], speed - np.cross(turned, arm), atol=1e-12)
    np.testing.assert_allclose(world.kinetic_energy(), [energy], rtol=1e-12, atol=1e-14)
    total = tensor @ turned + np.cross(center, 2.0 * speed)
    np.testing.assert_allclose(world.angular_momentum()[0], total, atol=1e-11)

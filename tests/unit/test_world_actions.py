"""Impulses, forces, contacts, materials, parameters and heights: what acts on bodies, and what it does."""

import numpy as np
import pytest

from avalanche_gym import physics

GRAVITY = 9.81
STEP = 0.01
OPTIONS = physics.Options(time_step=STEP)


def gravity_scene():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -GRAVITY)))
    return scene


# --- Impulses and forces --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def free():
    """Two worlds, one body of 2 kg with inertia (1, 2, 3) and its centre at x = 0.5 of its frame, no field."""
    scene = physics.Scene()
    scene.add_body(physics.Sphere(1.0), mass=2.0, inertia=(1, 2, 3), center_of_mass=(0.5, 0, 0))
    return physics.World(scene, num_worlds=2, options=OPTIONS)


@pytest.fixture(autouse=True)
def _fresh(free):
    free.reset()


def test_an_impulse_at_the_centre_of_mass_changes_the_velocity_at_once(free):
    free.apply_impulse(0, (0, 0, 3), world=1)
    assert free.linear_velocity[:, 0, 2].tolist() == [0, 1.5]
    assert not free.angular_velocity.any() and free.position[1, 0].tolist() == [0, 0, 0]


def test_an_impulse_at_a_point_turns_the_body(free):
    free.apply_impulse(0, (0, 0, 3), point=(0.5, 1.0, 0.0))
    # (0, 1, 0) x (0, 0, 3) = (3, 0, 0), Ixx = 1; the origin lies on the axis through the centre of mass.
    assert free.angular_velocity[0, 0].tolist() == [3, 0, 0]
    assert free.linear_velocity[0, 0] == pytest.approx([0, 0, 1.5])
    free.apply_impulse(0, [(0, 2, 0), (0, 0, 0)], point=[(1.5, 0, 0), (0, 0, 0)])
    assert free.angular_velocity[:, 0] == pytest.approx(np.array([[3, 0, 2 / 3], [3, 0, 0]]))
    # v_origin = v + w x r with r = (-0.5, 0, 0)
    assert free.linear_velocity[0, 0] == pytest.approx([0, 1 - 1 / 3, 1.5])


def test_forces_add_up_act_through_one_call_and_clear(free):
    free.apply_force(0, (2, 0, 0))
    free.apply_force(0, (2, 0, 0), world=1)
    assert not free.linear_velocity.any()
    free.step(10)
    assert free.linear_velocity[:, 0, 0] == pytest.approx([0.1, 0.2], rel=1e-13)
    assert free.position[:, 0, 0] == pytest.approx([0.005, 0.01], rel=1e-12)
    free.step(10)
    assert free.linear_velocity[:, 0, 0] == pytest.approx([0.1, 0.2], rel=1e-13)


def test_a_force_off_the_centre_is_a_moment_too(free):
    free.apply_force(0, (0, 0, 4), point=(0.5, 0.25, 0))
    free.step(1)
    assert free.angular_velocity[0, 0] == pytest.approx([STEP, 0, 0])


def test_the_impulse_buffer_waits_for_the_next_step(free):
    free.impulse_buffer[1, 0] = (0, 0, 2, 0, 0, 3)
    assert not free.linear_velocity.any()
    free.step(1)
    assert free.linear_velocity[1, 0, 2] == 1.0 and free.angular_velocity[1, 0, 2] == 1.0
    assert not free.impulse_buffer.any() and not free.linear_velocity[0].any()


# --- Contacts -------------------------------------------------------------------------------------


def test_contacts_of_a_resting_stack():
    """Handles in the wrong order for the stack: the upper box comes first."""
    scene = gravity_scene()
    upper = scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.3))
    ground = scene.add_body(physics.Plane(), motion="static")
    lower = scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=3.0, position=(0, 0, 0.1))
    world = physics.World(scene, num_worlds=2, options=OPTIONS)
    assert len(world.contacts()) == 0
    world.step(20)
    contacts = world.contacts(world=1)
    assert contacts.dtype.names == ("body_a", "body_b", "position", "normal", "gap", "impulse")
    pairs = {(int(c["body_a"]), int(c["body_b"])) for c in contacts}
    assert pairs == {(upper, lower), (ground, lower)} and len(contacts) == 8
    between = contacts[contacts["body_a"] == upper]
    below = contacts[contacts["body_a"] == ground]
    # Normals from a to b, the impulse on b.
    np.testing.assert_allclose(between["normal"], [[0, 0, -1]] * 4, atol=1e-12)
    np.testing.assert_allclose(between["impulse"].sum(axis=0), [0, 0, -GRAVITY * STEP], atol=1e-12)
    np.testing.assert_allclose(below["normal"], [[0, 0, 1]] * 4, atol=1e-12)
    np.testing.assert_allclose(below["impulse"].sum(axis=0), [0, 0, 4 * GRAVITY * STEP], atol=1e-11)
    np.testing.assert_allclose(np.abs(between["position"]), [[0.1, 0.1, 0.2]] * 4, atol=1e-10)
    np.testing.assert_allclose(contacts["gap"], 0, atol=1e-10)
    assert world.report().contacts.tolist() == [8, 8]
    assert world.report().penetration.max() < 1e-9 * 0.1 * 2
    world.reset(world=1)
    assert len(world.contacts(world=1)) == 0 and len(world.contacts(world=0)) == 8


def test_the_gap_is_that_at_the_end_of_the_step():
    scene = gravity_scene()
    ball = scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0, 0, 0.2), linear_velocity=(0, 0, -9.92))
    scene.add_body(physics.Plane(), motion="static")
    world = physics.World(scene, options=OPTIONS)
    world.step(1)
    contacts = world.contacts()
    apart = world.position[0, ball, 2] - 0.1
    assert apart == pytest.approx(0.0008 - 0.5 * GRAVITY * STEP**2, rel=1e-12)
    assert contacts["gap"].tolist() == pytest.approx([apart], rel=1e-12) and not contacts["impulse"].any()


# --- Materials ------------------------------------------------------------------------------------


def decelerations(friction, other, rule=None, parameters=None):
    """Of a box that slides on a plane, in units of g."""
    scene = gravity_scene()
    materials = physics.Material(friction=friction), physics.Material(friction=other)
    box = scene.add_body(
        physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1), linear_velocity=(2, 0, 0), material=materials[0]
    )
    scene.add_body(physics.Plane(), motion="static", material=materials[1])
    if rule is not None:
        scene.set_pair(materials[1], materials[0], friction=rule)
    world = physics.World(scene, num_worlds=2, options=OPTIONS)
    if parameters is not None:
        world.set_parameters(box, **parameters)
    world.step(2)
    speed = world.linear_velocity[:, box, 0].copy()
    world.step(5)
    return (speed - world.linear_velocity[:, box, 0]) / (5 * STEP * GRAVITY)


def test_a_pair_takes_the_larger_friction():
    assert decelerations(0.2, 0.4) == pytest.approx([0.4] * 2, rel=1e-9)
    assert decelerations(0.3, 0.1) == pytest.approx([0.3] * 2, rel=1e-9)
    assert decelerations(0.0, 0.0) == pytest.approx([0.0] * 2, abs=1e-12)


def test_set_pair_overrides_the_mixing():
    assert decelerations(0.9, 0.4, rule=0.25) == pytest.approx([0.25] * 2, rel=1e-9)
    assert decelerations(0.9, 0.4, rule=0.0) == pytest.approx([0.0] * 2, abs=1e-12)


def test_parameters_differ_between_worlds():
    changed = {"friction": [0.5, 0.25], "mass": [5.0, 7.0]}
    assert decelerations(0.1, 0.2, parameters=changed) == pytest.approx([0.5, 0.25], rel=1e-9)
    assert decelerations(0.1, 0.2, parameters={"friction": 0.3, "world": 1}) == pytest.approx([0.2, 0.3], rel=1e-9)


def test_restitution_is_the_product():
    """Head-on spheres of equal mass: the relative speed turns into minus e times itself."""
    for pair, expected in ((None, 0.4), (0.9, 0.9)):
        scene = physics.Scene()
        a, b = physics.Material(restitution=0.5), physics.Material(restitution=0.8)
        for side, material in ((-1, a), (1, b)):
            scene.add_body(
                physics.Sphere(0.1), mass=1.0, position=(side, 0, 0), linear_velocity=(-side, 0, 0), material=material
            )
        if pair is not None:
            scene.set_pair(a, b, restitution=pair)
        world = physics.World(scene, options=OPTIONS)
        world.step(150)
        speeds = world.linear_velocity[0, :, 0]
        assert speeds == pytest.approx([-expected, expected], rel=1e-12)


# --- Parameters -----------------------------------------------------------------------------------


def test_mass_scales_the_inertia_and_inertia_chooses_the_flow():
    scene = physics.Scene()
    ball = scene.add_body(physics.Sphere(1.0), mass=2.0, angular_velocity=(1, 0.1, 0.2))
    world = physics.World(scene, num_worlds=3, options=OPTIONS)
    world.set_parameters(ball, mass=4.0, world=0)
    world.set_parameters(ball, inertia=(1, 2, 2.5), world=1)
    spin = 1 + 0.01 + 0.04
    energy = [0.5 * 1.6 * spin, 0.5 * (1 + 0.02 + 0.1), 0.5 * 0.8 * spin]
    assert world.kinetic_energy() == pytest.approx(energy)
    world.apply_impulse(ball, (4, 0, 0))
    assert world.linear_velocity[:, ball, 0] == pytest.approx([1, 2, 2])
    momentum = world.angular_momentum()
    world.step(100)
    assert world.angular_momentum() == pytest.approx(momentum, rel=1e-12)
    # A body that is no sphere any more does not keep its axis.
    turned = np.abs(world.angular_velocity[:, ball] - (1, 0.1, 0.2)).max(axis=1)
    assert turned[0] == turned[2] == 0.0 and turned[1] > 0.05


def test_parameters_do_not_remember_what_was_set_before():
    """Nothing is lost by rounding: a lane that was set many times equals a new one, bit for bit."""
    scene = physics.Scene()
    box = scene.add_body(physics.Box((0.1, 0.2, 0.37)), mass=1.3, angular_velocity=(1, 2, 3))
    world = physics.World(scene, num_worlds=2, options=OPTIONS)
    for mass in (0.7, 11.0, 1 / 3, 1.7):
        world.set_parameters(box, mass=mass, world=0)
    world.set_parameters(box, mass=1.7, world=1)
    assert world.kinetic_energy()[0] == world.kinetic_energy()[1]
    world.set_parameters(box, inertia=(0.1, 0.1, 0.1))
    world.set_parameters(box, mass=3.4)
    assert world.kinetic_energy() == pytest.approx([0.5 * 0.2 * 14] * 2)


def test_inertia_of_a_running_world_keeps_its_principal_axes():
    scene = physics.Scene()
    tensor = np.array([[2.0, 0.3, 0.0], [0.3, 2.5, 0.0], [0.0, 0.0, 3.0]])
    ball = scene.add_body(physics.Sphere(1.0), mass=2.0, inertia=tensor, angular_velocity=(1, 2, 3))
    world = physics.World(scene, options=OPTIONS)
    world.set_parameters(ball, inertia=2 * tensor)
    spin = np.array([1, 2, 3])
    assert world.kinetic_energy() == pytest.approx([spin @ tensor @ spin])
    with pytest.raises(ValueError, match="principal axes"):
        world.set_parameters(ball, inertia=(1, 1.5, 2))


# --- Heights --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def carpet():
    """Three worlds: a moving height field with a ball of 1 kg, another static field behind it in the table."""
    scene = gravity_scene()
    ball = scene.add_body(physics.Sphere(0.2), mass=1.0, position=(0, 0, 0.2))
    ground = scene.add_body(physics.HeightField(np.zeros((5, 7)), size=(6.0, 4.0)), motion="kinematic", name="carpet")
    scene.add_body(physics.HeightField(np.ones((3, 3)), size=(1, 1)), motion="static", position=(50, 0, 0), name="hill")
    return physics.World(scene, num_worlds=3, options=OPTIONS), ball, ground


def test_heights_differ_between_worlds(carpet):
    world, ball, ground = carpet
    world.reset()
    world.set_heights(ground, np.full((5, 7), -0.5), world=1)
    world.set_heights(ground, [np.full((5, 7), 0.0), np.full((5, 7), -0.25)], world=np.array([True, False, True]))
    world.step(100)
    assert world.position[:, ball, 2] == pytest.approx([0.2, -0.3, -0.05], abs=1e-8)
    assert "heights per world" in world.features
    world.reset(world=1)
    world.step(1)
    assert world.position[:, ball, 2] == pytest.approx([0.2, 0.2, -0.05], abs=1e-8)
    world.reset()


def test_moving_heights_advance_at_their_rates_and_carry_what_lies_on_them(carpet):
    world, ball, ground = carpet
    world.reset()
    world.step(5)
    rates = np.full((5, 7), 0.5)
    world.set_heights(ground, height_rates=rates)
    assert "moving heights" in world.features
    world.step(60)
    assert world.position[:, ball, 2] == pytest.approx([0.5] * 3, abs=1e-6)
    assert world.linear_velocity[:, ball, 2] == pytest.approx([0.5] * 3, abs=1e-9)
    # The same in some worlds only; the others come to rest.
    world.set_heights(ground, height_rates=-rates, world=slice(1, None))
    world.set_heights(ground, world=0)
    world.step(40)
    assert world.position[1:, ball, 2] == pytest.approx([0.3] * 2, abs=1e-6)
    world.step(20)
    assert world.position[0, ball, 2] == pytest.approx(0.5, abs=1e-6)
    world.reset()
    world.step(5)
    assert world.position[:, ball, 2] == pytest.approx([0.2] * 3, abs=1e-9) and "moving heights" not in world.features


def test_a_wave_moves_each_facet_with_its_corners(carpet):
    """Rates that grow along x tilt the ground: the ball's height follows the rate where it is."""
    world, ball, ground = carpet
    world.reset()
    world.set_state(ball, position=[(-1, 0, 0.2), (0, 0, 0.2), (1, 0, 0.2)])
    world.step(2)
    x = np.linspace(-3, 3, 7)
    world.set_heights(ground, height_rates=np.broadcast_to(0.2 * x, (5, 7)))
    world.step(1)
    assert world.linear_velocity[:, ball, 2] == pytest.approx([-GRAVITY * STEP, 0.0, 0.2], abs=1e-9)
    world.reset()


@pytest.mark.parametrize(
    ("arguments", "texts"),
    [
        ({"heights": np.zeros((4, 7))}, ["set_heights(heights)", "(4, 7)", "(5, 7) or (3, 5, 7)"]),
        ({"heights": np.full((5, 7), np.nan)}, ["set_heights(heights)", "finite"]),
        ({"heights": "flat"}, ["set_heights(heights)", "numeric"]),
        ({"height_rates": np.full((5, 7), np.inf)}, ["set_heights(height_rates)", "finite"]),
    ],
)
def test_mistakes_in_set_heights(carpet, arguments, texts):
    world, _, ground = carpet
    with pytest.raises((ValueError, TypeError)) as raised:
        world.set_heights(ground, **arguments)
    for text in texts:
        assert text in str(raised.value)


def test_static_heights_cannot_move(carpet):
    world, _, ground = carpet
    with pytest.raises(ValueError, match="'hill' is static.*kinematic"):
        world.set_heights(ground + 1, height_rates=np.zeros((3, 3)))


# --- Features -------------------------------------------------------------------------------------


def test_features_say_what_runs_and_what_was_left_out():
    scene = physics.Scene()
    top = scene.add_body(physics.Box((1, 2, 3)), mass=1.0, name="top")
    world = physics.World(scene)
    assert world.features.modelled == () and "collisions" in world.features.left_out
    assert world.features.flows == {"top": "translation and triaxial top"}
    scene.add_field(physics.PointGravity(center=(0, 0, 0), mu=1.0))
    icy = physics.Material(friction=0.0)
    scene.add_body(physics.Sphere(1.0), motion="static", position=(9, 0, 0), material=icy)
    scene.add_body(physics.Sphere(1.0), motion="kinematic", position=(-9, 0, 0), material=icy, name="moon")
    features = physics.World(scene).features
    assert set(features.modelled) == {
        *("point gravity", "kinematic bodies", "collisions", "friction", "located impacts", "sleeping"),
    }
    assert set(features.modelled).isdisjoint(features.left_out)
    assert "uniform gravity" in features.left_out and features.flows["moon"] == "constant velocities"
    assert "modelled: point gravity" in str(features)
    bare = physics.Scene()
    bare.add_body(physics.Sphere(1.0), mass=1.0, material=icy)
    bare.add_body(physics.Plane(), motion="static", material=icy)
    world = physics.World(bare)
    assert "friction" not in world.features and "restitution" not in world.features
    world.set_parameters(top, friction=0.5)
    assert "friction" in world.features

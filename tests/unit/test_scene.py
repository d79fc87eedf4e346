"""What a user describes: defaults, mixing rules as they are stored, mass, frames; every mistake with its remedy."""

import math

import numpy as np
import pytest

from avalanche_gym.physics import (
    Box,
    Compound,
    HeightField,
    Material,
    Options,
    Plane,
    PointGravity,
    Scene,
    Sphere,
    TriangleMesh,
    UniformGravity,
    World,
)
from avalanche_gym.physics.tables.construction import build_tables

TETRAHEDRON = ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
OPEN_MESH = TriangleMesh(TETRAHEDRON[0], TETRAHEDRON[1][:3])


def table_of(scene, handle):
    return build_tables(scene).arrays["bodies"][handle]


def test_handles_count_up_and_name_bodies():
    scene = Scene()
    assert [scene.add_body(Sphere(1.0), mass=1.0) for _ in range(3)] == [0, 1, 2]
    assert scene.add_body(Plane(), motion="static", name="floor") == 3
    assert [body.name for body in scene.bodies] == ["body_0", "body_1", "body_2", "floor"]
    assert all(type(handle) is int for handle in (scene.add_body(Sphere(1.0)),))


def test_a_world_does_not_follow_later_changes_of_its_scene():
    scene = Scene()
    scene.add_body(Sphere(1.0), mass=1.0)
    copy = scene.copy()
    scene.add_body(Sphere(1.0), mass=1.0)
    scene.add_field(UniformGravity((0, 0, -1)))
    assert len(copy.bodies) == 1 and copy.fields == []


def test_defaults():
    material = Material()
    assert (material.friction, material.restitution) == (0.5, 0.0)
    assert (material.rolling_friction, material.torsional_friction) == (0.0, 0.0)
    scene = Scene()
    body = scene.bodies[scene.add_body(Sphere(0.5))]
    assert body.motion == "dynamic" and body.mass == pytest.approx(1000.0 * 4 / 3 * math.pi * 0.125)
    assert body.position.tolist() == [0, 0, 0] and body.orientation.tolist() == [1, 0, 0, 0]
    options = Options()
    assert (options.time_step, options.tolerance, options.threads, options.max_contacts) == (1 / 240, 1e-12, 1, None)
    assert options.events is True and options.sleeping is True


def test_mass_or_density():
    scene = Scene()
    heavy = scene.bodies[scene.add_body(Box((0.5, 0.5, 0.5)), density=7.0)]
    assert heavy.mass == pytest.approx(7.0) and np.trace(heavy.inertia) == pytest.approx(3.5)
    light = scene.bodies[scene.add_body(Box((0.5, 0.5, 0.5)), mass=3.0)]
    assert light.mass == 3.0 and np.diagonal(light.inertia) == pytest.approx([0.5] * 3)


def test_given_inertia_with_products_becomes_principal():
    scene = Scene()
    tensor = np.array([[2.0, 0.3, 0.1], [0.3, 2.5, -0.2], [0.1, -0.2, 3.0]])
    row = table_of(scene, scene.add_body(Sphere(1.0), mass=1.0, inertia=tensor))
    assert sorted(row["inertia"]) == pytest.approx(np.linalg.eigvalsh(tensor))
    plate = table_of(scene, scene.add_body(Sphere(1.0), mass=1.0, inertia=(1.0, 2.0, 3.0)))  # Ixx + Iyy = Izz
    assert plate["inertia"].tolist() == [1.0, 2.0, 3.0]


def test_center_of_mass_moves_the_frame_not_the_shape():
    scene = Scene()
    handle = scene.add_body(Sphere(1.0), mass=2.0, center_of_mass=(0.5, 0.0, 0.0))
    tables = build_tables(scene)
    assert tables.arrays["colliders"][0]["position"].tolist() == [-0.5, 0, 0]
    assert tables.arrays["bodies"][handle]["origin"].tolist() == [-0.5, 0, 0]
    # Parallel axes: 2/5 m r^2, and m d^2 more across the offset.
    assert tables.arrays["bodies"][handle]["inertia"] == pytest.approx([0.8, 0.8 + 0.5, 0.8 + 0.5])
    assert tables.public["position"][handle].tolist() == [0, 0, 0]


def test_compound_has_one_collider_a_part():
    scene = Scene()
    dumbbell = Compound([(Sphere(0.1), (0, 0, -1), (1, 0, 0, 0)), (Sphere(0.1), (0, 0, 1), (1, 0, 0, 0))])
    handle = scene.add_body(dumbbell, mass=2.0)
    row = table_of(scene, handle)
    assert row["num_colliders"] == 2 and row["radius"] == pytest.approx(1.1) and row["size"] == 0.1
    assert row["inertia"][0] == pytest.approx(2.0 * (0.4 * 0.01 + 1.0))


def test_set_pair_goes_by_identity_and_the_last_call_counts():
    ice, rubber, twin = Material(friction=0.1), Material(), Material()
    scene = Scene()
    for material in (ice, rubber, twin):
        scene.add_body(Sphere(1.0), mass=1.0, material=material)
    scene.set_pair(ice, rubber, friction=0.9)
    scene.set_pair(rubber, ice, restitution=0.25)
    scene.set_pair(twin, twin, friction=0.0)
    rules = build_tables(scene).arrays["pair_rules"].reshape(3, 3)
    assert np.isnan(rules["friction"][0, 1]) and rules["restitution"][0, 1] == rules["restitution"][1, 0] == 0.25
    assert rules["friction"][2, 2] == 0.0
    assert np.isnan(rules["friction"][1, 2]) and np.isnan(rules["friction"][1, 1])


def test_quaternions_near_unit_norm_are_normalised():
    scene = Scene()
    body = scene.bodies[scene.add_body(Sphere(1.0), orientation=(0.6, 0.8 * (1 + 5e-7), 0, 0))]
    assert np.linalg.norm(body.orientation) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    ("shape", "arguments", "texts"),
    [
        (Sphere(1.0), {"mass": -1.0, "name": "ball"}, ["'ball'", "mass", "-1.0", "above zero"]),
        (Sphere(1.0), {"mass": 0.0, "name": "ball"}, ["'ball'", "0.0", "above zero"]),
        (Sphere(1.0), {"mass": math.nan, "name": "ball"}, ["'ball'", "nan", "finite"]),
        (Sphere(1.0), {"mass": "1 kg"}, ["body_1", "1 kg", "number"]),
        (Sphere(1.0), {"density": -5.0}, ["density", "-5.0", "above zero"]),
        (Sphere(1.0), {"mass": 1.0, "density": 1.0}, ["mass", "density", "one of them"]),
        (Sphere(1.0), {"inertia": (1, 1, 3)}, ["inertia", "[1.0, 1.0, 3.0]", "sum of the other two"]),
        (Sphere(1.0), {"inertia": (1, 1, -1)}, ["inertia", "positive"]),
        (Sphere(1.0), {"inertia": [[1, 2], [3, 4]]}, ["inertia", "(2, 2)", "3 x 3"]),
        (Sphere(1.0), {"inertia": [[2, 1, 0], [0, 2, 0], [0, 0, 2]]}, ["inertia", "symmetric"]),
        (OPEN_MESH, {"mass": 1.0, "name": "shell"}, ["'shell'", "open", "static"]),
        (Plane(), {"mass": 1.0}, ["Plane", 'motion="static"']),
        (HeightField(np.zeros((2, 2)), size=(1, 1)), {}, ["HeightField", 'motion="static"']),
        (Sphere(1.0), {"motion": "floating"}, ["floating", "'dynamic', 'kinematic', 'static'"]),
        (Sphere(1.0), {"motion": "static", "mass": 1.0}, ["mass", "static", "leave it out"]),
        (Sphere(1.0), {"motion": "kinematic", "center_of_mass": (0, 0, 1)}, ["center_of_mass", "kinematic"]),
        (Sphere(1.0), {"motion": "static", "linear_velocity": (1, 0, 0)}, ["static", "kinematic"]),
        (Sphere(1.0), {"position": (0, 0)}, ["body_1", "position", "(2,)", "three finite numbers"]),
        (Sphere(1.0), {"position": (0, 0, math.inf)}, ["position", "inf", "finite"]),
        (Sphere(1.0), {"linear_velocity": (0, 0, math.nan)}, ["linear_velocity", "nan"]),
        (Sphere(1.0), {"angular_velocity": "fast"}, ["angular_velocity", "three finite numbers"]),
        (Sphere(1.0), {"orientation": (0, 0, 0, 0)}, ["orientation", "unit quaternion"]),
        (Sphere(1.0), {"orientation": (1 + 2e-6, 0, 0, 0)}, ["norm 1.000002", "w comes first"]),
        (Sphere(1.0), {"center_of_mass": (0, math.nan, 0)}, ["center_of_mass", "nan"]),
        (Sphere(1.0), {"name": "first"}, ["first", "name already", "another"]),
        (Sphere(1.0), {"name": ""}, ["name=''", "non-empty"]),
        (Sphere(1.0), {"material": 0.5}, ["material=0.5", "Material("]),
        (Sphere(1.0), {"visual": "cat.obj"}, ["visual", "TriangleMesh"]),
        ("sphere", {}, ["shape='sphere'", "Sphere("]),
    ],
)
def test_mistakes_in_add_body(shape, arguments, texts):
    scene = Scene()
    scene.add_body(Sphere(1.0), mass=1.0, name="first")
    with pytest.raises((ValueError, TypeError)) as raised:
        scene.add_body(shape, **arguments)
    for text in texts:
        assert text in str(raised.value)
    assert len(scene.bodies) == 1
    assert scene.add_body(Sphere(1.0), mass=1.0, name="second") == 1


@pytest.mark.parametrize(
    ("call", "texts"),
    [
        (lambda: Material(friction=-0.1), ["friction=-0.1", "at least 0"]),
        (lambda: Material(friction=math.inf), ["friction=inf", "finite"]),
        (lambda: Material(restitution=1.5), ["restitution=1.5", "from 0 to 1"]),
        (lambda: Material(rolling_friction="0.1"), ["rolling_friction='0.1'", "number"]),
        (lambda: UniformGravity((0, 0)), ["UniformGravity(acceleration)", "(2,)", "three"]),
        (lambda: UniformGravity((0, 0, math.nan)), ["UniformGravity(acceleration)", "nan"]),
        (lambda: PointGravity(center=(0, 0, 0), mu=math.nan), ["mu=nan", "finite"]),
        (lambda: PointGravity(center=(0, 0), mu=1.0), ["PointGravity(center)", "three"]),
        (lambda: Scene().add_field((0, 0, -9.81)), ["-9.81", "UniformGravity"]),
        (lambda: Scene().set_pair(0.5, Material()), ["a=0.5", "Material"]),
        (lambda: Scene().set_pair(Material(), Material(), friction=-1), ["friction=-1", "at least 0"]),
        (lambda: World("scene"), ["scene='scene'", "Scene"]),
        (lambda: World(Scene(), num_worlds=0), ["num_worlds=0", "at least 1"]),
        (lambda: World(Scene(), num_worlds=1.5), ["num_worlds=1.5", "whole number"]),
        (lambda: World(Scene(), options={"time_step": 0.01}), ["time_step", "Options("]),
        (lambda: Options(time_step=0.0), ["time_step=0.0", "greater than 0"]),
        (lambda: Options(time_step=math.nan), ["time_step=nan", "finite"]),
        (lambda: Options(tolerance=-1.0), ["tolerance=-1.0", "greater than 0"]),
        (lambda: Options(threads=0), ["threads=0", "at least 1"]),
        (lambda: Options(max_contacts=0), ["max_contacts=0", "None"]),
        (lambda: Options(events=1), ["events=1", "True or False"]),
    ],
)
def test_mistakes_elsewhere(call, texts):
    with pytest.raises((ValueError, TypeError)) as raised:
        call()
    for text in texts:
        assert text in str(raised.value)


def test_options_are_frozen():
    with pytest.raises(AttributeError):
        Options().time_step = 0.1

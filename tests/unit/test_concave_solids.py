"""Solids made by code, and meshes that cannot be dynamic bodies."""

import math

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.shapes.rabbit import rabbit
from avalanche_gym.physics.shapes.ring_solids import gear, torus
from avalanche_gym.physics.shapes.thread import Thread, bolt, nut

THREAD = Thread(0.01, 0.004, 0.002)


def euler_number(mesh):
    edges = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    return len(mesh.vertices) - len(np.unique(edges, axis=0)) + len(mesh.faces)


@pytest.mark.parametrize(
    ("mesh", "holes"),
    [
        (rabbit(0.2), 0),
        (rabbit(0.2, np.random.default_rng(2), triangles=1500), 0),
        (torus(0.1, 0.03), 1),
        (gear(0.1, 0.02), 1),
        (bolt(THREAD), 0),
        (nut(THREAD, clearance=1e-4), 1),
    ],
)
def test_solids_are_closed_and_do_not_cross_themselves(mesh, holes):
    assert mesh.is_closed
    assert len(mesh.crossing_faces) == 0
    assert euler_number(mesh) == 2 - 2 * holes
    assert mesh.mass_properties().volume > 0.0


def test_a_rabbit_has_five_thousand_triangles_and_follows_its_seed():
    assert len(rabbit(0.2).faces) == pytest.approx(5000, rel=0.01)
    one, other = (rabbit(0.2, np.random.default_rng(5), triangles=800) for _ in range(2))
    assert np.array_equal(one.vertices, other.vertices)


def test_volumes_approach_those_of_the_round_solids():
    exact = 2.0 * math.pi**2 * 0.1 * 0.03**2
    coarse, fine = (1.0 - torus(0.1, 0.03, segments=2 * n, sides=n).mass_properties().volume / exact for n in (16, 32))
    assert 3.9 < coarse / fine < 4.1  # order 2 in the length of the sides


def test_the_profile_of_a_nut_keeps_its_clearance():
    shares, radii = THREAD.profile()
    wider, outer = THREAD.profile(1e-4)
    np.testing.assert_allclose(outer - radii, 1e-4)
    flank = np.array([shares[1] - shares[0], 0.0]) * THREAD.pitch + np.array([0.0, radii[1] - radii[0]])
    normal = np.array([-flank[1], flank[0]]) / np.linalg.norm(flank)
    moved = np.array([(wider[0] - shares[0]) * THREAD.pitch, outer[0] - radii[0]])
    assert moved @ normal == pytest.approx(1e-4, rel=1e-9)


def test_self_locking_friction_of_a_square_thread_is_the_tangent_of_the_lead():
    deep = Thread(0.01, 1e-4, 0.008)  # flanks almost flat
    tangent = deep.pitch / (2.0 * math.pi * deep.radius)
    assert deep.self_locking_friction == pytest.approx(tangent, rel=1e-4)


def test_a_mesh_that_crosses_itself_is_refused_as_a_dynamic_body():
    parts = [torus(0.1, 0.03, segments=12, sides=6), gear(0.1, 0.03)]
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([parts[0].faces, parts[1].faces + len(parts[0].vertices)])
    both = physics.TriangleMesh(vertices, faces)
    scene = physics.Scene()
    with pytest.raises(ValueError, match=r"'knot'.*crosses itself.*Unite its parts"):
        scene.add_body(both, mass=1.0, name="knot")
    scene.add_body(both, motion="static")


def test_crossings_are_those_of_all_pairs_of_faces():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(60, 3))
    mesh = physics.TriangleMesh(points, np.arange(60).reshape(-1, 3))
    found = {tuple(sorted(pair)) for pair in mesh.crossing_faces.tolist()}
    corners = points.reshape(-1, 3, 3)
    expected = set()
    for i in range(20):
        for j in range(20):
            a, b, c = corners[j]
            for k in range(3):
                p, q = corners[i, k], corners[i, (k + 1) % 3]
                x = np.linalg.solve(np.stack([b - a, c - a, p - q], axis=1), p - a) if i != j else np.full(3, -1.0)
                if (x > 0.0).all() and x[0] + x[1] < 1.0 and x[2] < 1.0:
                    expected.add((min(i, j), max(i, j)))
    assert found == expected and len(found) > 5


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: torus(0.1, 0.2), "would fill the hole"),
        (lambda: torus(0.1, 0.02, sides=2), "at least 3"),
        (lambda: gear(0.1, 0.02, bore=0.9), "bore must be less"),
        (lambda: rabbit(0.2, triangles=10), "allowed are 600"),
        (lambda: Thread(0.01, 0.004, 0.02), "must be less than radius"),
        (lambda: nut(THREAD, clearance=1e-4, segments=20), "multiple of six"),
        (lambda: nut(THREAD, clearance=1e-4, width=0.02), "leaves no wall"),
    ],
)
def test_what_cannot_be_made_is_refused_with_a_remedy(make, text):
    with pytest.raises(ValueError, match=text):
        make()

"""What mesh preparation repairs, what it refuses, and what it finds."""

import numpy as np
import pytest
import trimesh

from avalanche_gym.physics.shapes.mesh_preparation import prepare_mesh
from avalanche_gym.physics.shapes.static_tree import build_static_tree, is_clear
from tests.oracles import terrain_oracle as oracle


def sphere_mesh(subdivisions=2):
    mesh = trimesh.creation.icosphere(subdivisions)
    return np.array(mesh.vertices), np.array(mesh.faces)


def convex_edges(prepared):
    return int(sum((prepared.faces["flags"] >> k & 1).sum() for k in range(3)))


def test_soup_is_welded():
    vertices, faces = sphere_mesh()
    prepared = prepare_mesh(vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3))
    assert len(prepared.vertices) == len(vertices)
    assert prepared.repairs == {"welded vertices": faces.size - len(vertices)}
    assert prepared.mesh["closed"][0] == 1
    assert (prepared.faces["neighbours"] >= 0).all()


def test_vertices_within_round_off_are_welded():
    vertices, faces = sphere_mesh()
    torn = vertices[faces].reshape(-1, 3) + np.random.default_rng(0).uniform(-1e-12, 1e-12, (faces.size, 3))
    prepared = prepare_mesh(torn, np.arange(faces.size).reshape(-1, 3))
    assert len(prepared.vertices) == len(vertices)


def test_every_edge_and_vertex_of_a_sphere_sticks_out_once():
    vertices, faces = sphere_mesh()
    prepared = prepare_mesh(vertices, faces)
    assert convex_edges(prepared) == 3 * len(faces) // 2
    assert int(sum((prepared.faces["flags"] >> (3 + k) & 1).sum() for k in range(3))) == len(vertices)
    # Pseudo-normals of a sphere point away from its middle.
    assert (np.einsum("ij,ij->i", prepared.vertices["normal"], prepared.vertices["position"]) > 0.99).all()


def test_flat_and_concave_edges_do_not_stick_out():
    heights = np.tile(np.abs(np.linspace(-1.0, 1.0, 9)), (9, 1))
    prepared = prepare_mesh(*oracle.grid_mesh(heights, (2.0, 2.0)))
    # The rim of 8 edges a side only.
    assert convex_edges(prepared) == 32


def test_flat_faces_share_one_normal():
    rng = np.random.default_rng(3)
    vertices, faces = oracle.random_floor(rng)
    turn = np.reshape(oracle.rotation_matrix((0.4, -0.8, 0.2)), (3, 3))
    prepared = prepare_mesh(vertices @ turn.T + (5.0, 7.0, 9.0), faces)
    assert np.ptp(prepared.faces["normal"], axis=0).max() == 0.0
    np.testing.assert_allclose(prepared.faces["normal"][0], turn[:, 2], atol=1e-14)


def test_degenerate_and_duplicate_faces_are_dropped():
    vertices, faces = sphere_mesh()
    # The middle of an edge as a vertex makes a needle without area, whose place its neighbours must close.
    middle = 0.5 * (vertices[faces[0, 0]] + vertices[faces[0, 1]])
    extra = [[faces[0, 0], len(vertices), faces[0, 1]], [5, 5, 6], faces[3], faces[4][::-1]]
    prepared = prepare_mesh(np.concatenate([vertices, [middle]]), np.concatenate([faces, extra]))
    assert prepared.repairs["degenerate faces"] == 2
    assert prepared.repairs["duplicate faces"] == 2
    assert len(prepared.faces) == len(faces)
    assert prepared.mesh["closed"][0] == 1


def test_t_junctions_are_split():
    """A square of two faces beside one of a finer grid: its edge is split where the others have vertices."""
    fine, faces = oracle.grid_mesh(np.zeros((5, 5)), (1.0, 1.0))
    coarse, more = oracle.grid_mesh(np.zeros((2, 2)), (1.0, 1.0))
    vertices = np.concatenate([fine, coarse + np.array([1.0, 0.0, 0.0])])
    prepared = prepare_mesh(vertices, np.concatenate([faces, more + len(fine)]))
    assert prepared.repairs["T-junctions"] == 3
    # What is left of the rim is its outside: 4 edges each on three sides of the fine square, 3 of the coarse one.
    assert (prepared.faces["neighbours"] < 0).sum() == 15


def test_flipped_faces_are_turned_to_the_majority():
    vertices, faces = sphere_mesh()
    flipped = faces.copy()
    flipped[::7] = flipped[::7, ::-1]
    prepared = prepare_mesh(vertices, flipped)
    assert prepared.repairs["flipped faces"] == len(faces[::7])
    centroid = prepared.vertices["position"][prepared.faces["vertices"]].mean(axis=1)
    assert (np.einsum("ij,ij->i", prepared.faces["normal"], centroid) > 0.0).all()


def test_where_four_faces_meet_the_free_sides_are_paired():
    """Two cubes that share one edge: across it each face continues on the other cube, around the free space."""
    cube = trimesh.creation.box(extents=(1.0, 1.0, 1.0))
    vertices = np.concatenate([cube.vertices, cube.vertices + np.array([1.0, 1.0, 0.0])])
    prepared = prepare_mesh(vertices, np.concatenate([cube.faces, cube.faces + 8]))
    assert prepared.mesh["closed"][0] == 1
    # The shared edge is concave from both free sides: 23 of the cubes' 24 edges are left, less one more.
    assert convex_edges(prepared) == 22


def test_refusals_name_the_body_and_count():
    vertices, faces = sphere_mesh()
    with pytest.raises(ValueError, match=r"rock.*320 faces is inside out"):
        prepare_mesh(vertices, faces[:, ::-1], name="rock")
    assert prepare_mesh(vertices, faces[:, ::-1], two_sided=True).mesh["two_sided"][0] == 1
    with pytest.raises(ValueError, match=r"rock: 1 of 162 vertices"):
        prepare_mesh(np.where(np.arange(162)[:, None] == 7, np.nan, vertices), faces, name="rock")
    with pytest.raises(ValueError, match=r"none of 2 faces is left: 2 have no area"):
        prepare_mesh(np.eye(3), [[0, 0, 1], [1, 2, 1]])
    with pytest.raises(ValueError, match="without faces"):
        prepare_mesh(vertices, np.zeros((0, 3), int))


def test_moebius_strip_is_refused():
    n = 24
    turn = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    radial = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    across = np.cos(0.5 * turn)[:, None] * radial + np.sin(0.5 * turn)[:, None] * (0.0, 0.0, 1.0)
    vertices = np.concatenate([radial - 0.3 * across, radial + 0.3 * across])
    i = np.arange(n - 1)
    faces = np.concatenate([np.stack([i, i + 1, i + n], axis=1), np.stack([i + 1, i + 1 + n, i + n], axis=1)])
    faces = np.concatenate([faces, [[n - 1, n, 2 * n - 1], [n, 0, 2 * n - 1]]])
    with pytest.raises(ValueError, match="one side only"):
        prepare_mesh(vertices, faces)


def test_tree_finds_the_faces_of_a_box():
    rng = np.random.default_rng(1)
    for n in (1, 2, 5, 37, 1000):
        lower = rng.uniform(-1.0, 1.0, (n, 3))
        upper = lower + rng.uniform(0.0, 0.2, (n, 3))
        nodes, order = build_static_tree(lower, upper)
        assert sorted(order) == list(range(n))
        for _ in range(20):
            low = rng.uniform(-1.0, 1.0, 3)
            high = low + rng.uniform(0.0, 0.5, 3)
            inside = set(np.flatnonzero((lower <= high).all(axis=1) & (upper >= low).all(axis=1)))
            found, node = set(), 0
            while node < len(nodes):
                here = nodes[node]
                if is_clear(here, tuple(low), tuple(high)):
                    node = int(here["skip"])
                    continue
                found |= set(order[here["first"] : here["first"] + here["count"]].tolist())
                node += 1
            assert inside <= found

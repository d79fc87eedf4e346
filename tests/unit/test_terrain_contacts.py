"""Contacts of sphere, capsule and box with height fields and meshes: known places and normals."""

import itertools

import numpy as np
import pytest
import trimesh

from avalanche_gym.physics.model import BOX, CAPSULE, SPHERE
from avalanche_gym.physics.shapes.mesh_preparation import prepare_mesh
from tests.oracles import terrain_oracle as oracle

UP = (0.0, 0.0, -1.0)  # normals point from the shape into the ground
SHAPES = {"sphere": (SPHERE, (0.1, 0.0, 0.0)), "capsule": (CAPSULE, (0.1, 0.25, 0.0)), "box": (BOX, (0.3, 0.2, 0.1))}


def flat_field():
    return oracle.height_field(np.zeros((17, 17)), (4.0, 4.0))


def ridge(slope=0.5):
    """A ridge along y at x = 0, its top at z = 0, as a height field."""
    x = np.linspace(-2.0, 2.0, 17)
    return np.tile(-slope * np.abs(x), (17, 1)), (4.0, 4.0)


def both(heights, size):
    """Callers of the height field and of the same surface as a mesh."""
    field = oracle.height_field(heights, size)
    mesh = prepare_mesh(*oracle.grid_mesh(heights, size))
    return {
        "field": lambda *query: oracle.field_contacts(*query[:4], field, query[4]),
        "mesh": lambda *query: oracle.mesh_contacts(*query[:4], mesh, query[4]),
    }


def assert_like_plane(contacts, shape, position, rotation, size, margin):
    expected = oracle.plane_contacts(shape, position, rotation, size, margin)
    assert len(contacts) == len(expected)
    for contact in contacts:
        gap, place = expected[oracle.point_of(contact)]
        assert contact["gap"] == pytest.approx(gap, abs=1e-14)
        np.testing.assert_allclose(contact["position"], place, atol=1e-14)
        np.testing.assert_allclose(contact["normal"], UP, atol=1e-15)


def poses(rng, shape, size):
    """Shapes that touch the plane z = 0 with a face, an edge or a corner: above it, in it, or tilted by round-off."""
    half, radius = oracle.core(shape, size)
    for tilt in (0.0, 1e-12, 1e-6, 0.3):
        turn = oracle.rotation_matrix(rng.uniform(-np.pi, np.pi) * np.array([0.0, 0.0, 1.0]))
        lean = oracle.rotation_matrix(tilt * rng.normal(size=3) * (1.0, 1.0, 0.0))
        side = oracle.rotation_matrix([[0.0, 0.0, 0.0], [np.pi / 2, 0.0, 0.0]][rng.integers(2)])
        rotation = np.reshape(lean, (3, 3)) @ np.reshape(turn, (3, 3)) @ np.reshape(side, (3, 3))
        reach = radius + np.abs(rotation[2]) @ half
        for offset in (0.0, 0.004, -0.003):
            place = rng.uniform(-1.0, 1.0, 2)
            # On vertices and edges of the grid as well.
            place = place if rng.integers(2) else np.round(place * 8.0) / 8.0
            yield np.array([*place, reach + offset]), oracle.floats(rotation.ravel())


@pytest.mark.parametrize("name", SHAPES)
def test_flat_height_field_is_a_plane(name):
    shape, size = SHAPES[name]
    rng = np.random.default_rng(1)
    for _ in range(10):
        for position, rotation in poses(rng, shape, size):
            contacts = oracle.field_contacts(shape, position, rotation, size, flat_field(), 0.01)
            assert_like_plane(contacts, shape, position, rotation, size, 0.01)


@pytest.mark.parametrize("name", SHAPES)
def test_floor_cut_at_random_is_a_plane(name):
    shape, size = SHAPES[name]
    rng = np.random.default_rng(2)
    for _ in range(5):
        mesh = prepare_mesh(*oracle.random_floor(rng))
        for position, rotation in poses(rng, shape, size):
            contacts = oracle.mesh_contacts(shape, position, rotation, size, mesh, 0.01)
            assert_like_plane(contacts, shape, position, rotation, size, 0.01)


@pytest.mark.parametrize("name", SHAPES)
def test_t_junctions_and_seams_are_a_plane(name):
    """Two floors of different grids that meet at x = 0, and duplicates of some faces."""
    left, faces = oracle.grid_mesh(np.zeros((9, 9)), (2.0, 4.0))
    right, more = oracle.grid_mesh(np.zeros((14, 6)), (2.0, 4.0))
    vertices = np.concatenate([left - (1.0, 0.0, 0.0), right + np.array([1.0, 0.0, 0.0])])
    mesh = prepare_mesh(vertices, np.concatenate([faces, more + len(left), faces[:5]]))
    assert mesh.repairs["T-junctions"] > 0 and mesh.repairs["duplicate faces"] == 5
    shape, size = SHAPES[name]
    rng = np.random.default_rng(3)
    for _ in range(5):
        for position, rotation in poses(rng, shape, size):
            position = position * (0.2, 1.0, 1.0)
            contacts = oracle.mesh_contacts(shape, position, rotation, size, mesh, 0.01)
            assert_like_plane(contacts, shape, position, rotation, size, 0.01)


@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_sphere_over_a_ridge(terrain):
    """In the cone of the ridge its edge is the contact; beyond it one face, continuously."""
    contacts_with = both(*ridge())[terrain]
    for angle in np.linspace(-1.0, 1.0, 41):
        direction = np.array([np.sin(angle), 0.0, np.cos(angle)])
        position = 0.11 * direction + (0.0, 0.3, 0.0)
        (contact,) = contacts_with(SPHERE, position, oracle.IDENTITY, (0.1, 0.0, 0.0), 0.05)
        limit = np.arctan(0.5)
        nearest = np.clip(angle, -limit, limit)
        assert contact["gap"] == pytest.approx(0.11 * np.cos(angle - nearest) - 0.1, abs=1e-12)
        np.testing.assert_allclose(contact["normal"], (-np.sin(nearest), 0.0, -np.cos(nearest)), atol=1e-12)


@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_sphere_in_a_valley_touches_both_sides(terrain):
    heights, size = ridge()
    contacts_with = both(-heights, size)[terrain]
    height = 0.1 * np.hypot(1.0, 0.5)
    contacts = contacts_with(SPHERE, (0.0, 0.1, height), oracle.IDENTITY, (0.1, 0.0, 0.0), 0.01)
    assert len(contacts) == 2
    np.testing.assert_allclose(contacts["gap"], 0.0, atol=1e-14)
    np.testing.assert_allclose(np.abs(contacts["normal"][:, 0]), 0.5 / np.hypot(1.0, 0.5))
    assert list(map(oracle.point_of, contacts)) == [0, 0] and len(set(contacts["feature"])) == 2


@pytest.mark.parametrize("terrain", ["field", "mesh"])
@pytest.mark.parametrize("tilt", [0.0, 1e-9, -1e-9])
def test_box_flat_on_a_ridge_stands_on_both_ends(terrain, tilt):
    contacts = both(*ridge())[terrain](
        BOX, (0.02, 0.1, 0.1), oracle.rotation_matrix((tilt, 0.0, 0.0)), (0.3, 0.2, 0.1), 0.01
    )
    assert len(contacts) == 2
    np.testing.assert_allclose(np.sort(contacts["position"][:, 1]), (-0.1, 0.3), atol=1e-8)
    np.testing.assert_allclose(contacts["normal"], [UP, UP], atol=1e-8)
    np.testing.assert_allclose(contacts["gap"], 0.0, atol=1e-8)
    assert len(set(contacts["feature"])) == 2


@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_capsule_across_a_ridge_balances_on_it(terrain):
    lying = oracle.rotation_matrix((0.0, np.pi / 2, 0.0))
    (contact,) = both(*ridge())[terrain](CAPSULE, (0.03, 0.1, 0.1), lying, (0.1, 0.25, 0.0), 0.01)
    np.testing.assert_allclose(contact["position"], (0.0, 0.1, 0.0), atol=1e-14)
    np.testing.assert_allclose(contact["normal"], UP, atol=1e-14)


@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_box_on_a_spike(terrain):
    """The vertex of a pyramid below the middle of a face."""
    heights = np.full((9, 9), -1.0)
    heights[4, 4] = 0.0
    for depth in (0.0, 0.03):
        (contact,) = both(heights, (4.0, 4.0))[terrain](
            BOX, (0.05, -0.1, 0.2 - depth), oracle.IDENTITY, (0.3, 0.2, 0.2), 0.01
        )
        np.testing.assert_allclose(contact["normal"], UP, atol=1e-14)
        np.testing.assert_allclose(contact["position"], (0.0, 0.0, -0.5 * depth), atol=1e-14)
        assert contact["gap"] == pytest.approx(-depth, abs=1e-14)


@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_box_larger_than_a_plateau_stands_on_its_corners(terrain):
    heights = np.full((9, 9), -1.0)
    heights[3:6, 3:6] = 0.0
    contacts = both(heights, (2.0, 2.0))[terrain](
        BOX, (0.0, 0.0, 0.5), oracle.rotation_matrix((1e-10, 2e-10, 0.0)), (0.5, 0.5, 0.5), 0.01
    )
    places = {tuple(np.round(p, 6)) for p in contacts["position"][:, :2]}
    assert places >= {(-0.25, -0.25), (0.25, 0.25)}
    np.testing.assert_allclose(contacts["gap"], 0.0, atol=1e-8)
    np.testing.assert_allclose(contacts["normal"] @ UP, 1.0)
    # The plane's normal moment can be held in every direction: the middle is inside of the support.
    for direction in np.linspace(0.0, 2.0 * np.pi, 16):
        assert (contacts["position"][:, :2] @ (np.cos(direction), np.sin(direction))).max() > 0.2


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_deep_below_flat_ground_is_pushed_straight_up(name, terrain):
    shape, size = SHAPES[name]
    contacts = both(np.zeros((17, 17)), (4.0, 4.0))[terrain](shape, (0.3, 0.2, -0.05), oracle.IDENTITY, size, 0.01)
    assert len(contacts) >= 1
    np.testing.assert_allclose(contacts["normal"] @ UP, 1.0)
    half, radius = oracle.core(shape, size)
    assert contacts["gap"].min() == pytest.approx(-0.05 - half[2] - radius)


def test_corner_of_a_room_holds_a_box_by_one_contact_a_wall():
    """A box pressed slightly into floor and two walls: the corner it has there meets all three."""
    room = trimesh.creation.box(extents=(2.0, 2.0, 2.0)).subdivide()
    mesh = prepare_mesh(room.vertices, room.faces[:, ::-1], two_sided=True)
    for depth in (-1e-3, 0.0, 1e-13, 1e-4):
        contacts = oracle.mesh_contacts(BOX, np.full(3, 0.9 + depth), oracle.IDENTITY, (0.1, 0.1, 0.1), mesh, 0.01)
        assert len(contacts) == 12
        corner = contacts[[oracle.point_of(contact) == 7 for contact in contacts]]
        np.testing.assert_allclose(sorted(corner["normal"].tolist()), np.eye(3)[::-1], atol=1e-14)
        np.testing.assert_allclose(corner["gap"], -depth, atol=1e-14)


def test_crossed_beams_meet_edge_on_edge():
    """A beam as a mesh, turned on its edge; a box across it, on its edge too: one contact, whatever the depth."""
    beam = trimesh.creation.box(extents=(4.0, 0.2, 0.2))
    on_edge = oracle.rotation_matrix((np.pi / 4, 0.0, 0.0))
    mesh = prepare_mesh(beam.vertices @ np.reshape(on_edge, (3, 3)).T, beam.faces)
    across = np.reshape(oracle.rotation_matrix((0.0, 0.0, np.pi / 2)), (3, 3)) @ np.reshape(on_edge, (3, 3))
    for gap in (0.005, -0.02):
        (contact,) = oracle.mesh_contacts(
            BOX, (0.0, 0.0, np.sqrt(0.08) + gap), oracle.floats(across.ravel()), (2.0, 0.1, 0.1), mesh, 0.01
        )
        np.testing.assert_allclose(contact["normal"], UP, atol=1e-12)
        assert contact["gap"] == pytest.approx(gap, abs=1e-12)
        np.testing.assert_allclose(contact["position"][:2], 0.0, atol=1e-12)


def test_thin_wall_pushes_to_the_nearer_side():
    wall = trimesh.creation.box(extents=(0.1, 4.0, 4.0))
    mesh = prepare_mesh(wall.vertices, wall.faces)
    for side in (-1.0, 1.0):
        contacts = oracle.mesh_contacts(BOX, (side * 0.24, 0.0, 0.0), oracle.IDENTITY, (0.2, 0.2, 0.2), mesh, 0.01)
        assert len(contacts) == 4
        np.testing.assert_allclose(contacts["normal"], np.tile((-side, 0.0, 0.0), (4, 1)), atol=1e-14)
        np.testing.assert_allclose(contacts["gap"], -0.01)


@pytest.mark.parametrize("name", SHAPES)
def test_inside_a_closed_mesh_the_way_out_is_the_nearest(name):
    solid = trimesh.creation.box(extents=(4.0, 4.0, 4.0))
    mesh = prepare_mesh(solid.vertices, solid.faces)
    shape, size = SHAPES[name]
    (contact,) = oracle.mesh_contacts(shape, (0.3, 0.2, 1.2), oracle.IDENTITY, size, mesh, 0.01)
    half, radius = oracle.core(shape, size)
    np.testing.assert_allclose(contact["normal"], UP, atol=1e-14)
    assert contact["gap"] == pytest.approx(-0.8 - half[2] - radius)
    assert len(oracle.mesh_contacts(shape, (0.3, 0.2, 2.9), oracle.IDENTITY, size, mesh, 0.01)) == 0


def test_sheet_acts_on_both_sides_and_an_open_mesh_on_one():
    vertices, faces = oracle.grid_mesh(np.zeros((5, 5)), (2.0, 2.0))
    sheet, surface = prepare_mesh(vertices, faces, two_sided=True), prepare_mesh(vertices, faces)
    for side, (shape, size) in itertools.product((-1.0, 1.0), SHAPES.values()):
        half, radius = oracle.core(shape, size)
        place = (0.1, 0.2, side * (half[2] + radius - 0.01))
        contacts = oracle.mesh_contacts(shape, place, oracle.IDENTITY, size, sheet, 0.01)
        np.testing.assert_allclose(contacts["normal"], np.tile((0.0, 0.0, -side), (len(contacts), 1)), atol=1e-15)
        assert len(contacts) == {SPHERE: 1, CAPSULE: 1, BOX: 4}[shape]
        one_sided = oracle.mesh_contacts(shape, place, oracle.IDENTITY, size, surface, 0.01)
        assert (one_sided["normal"][:, 2] == -1.0).all()


def test_beside_an_open_mesh_nothing_is_behind_it():
    """Below the plane of the surface, but beside its rim."""
    mesh = prepare_mesh(*oracle.grid_mesh(np.zeros((5, 5)), (2.0, 2.0)))
    for shape, size in SHAPES.values():
        assert len(oracle.mesh_contacts(shape, (1.4, 0.0, -0.05), oracle.IDENTITY, size, mesh, 0.01)) == 0


def test_features_stay_while_sliding():
    """Sphere, capsule and box slid over a flat floor: the same points of the body on every triangle."""
    mesh = prepare_mesh(*oracle.random_floor(np.random.default_rng(5)))
    for name, count in (("sphere", 1), ("capsule", 2), ("box", 4)):
        shape, size = SHAPES[name]
        rotation = oracle.rotation_matrix((0.0, np.pi / 2, 0.0)) if name == "capsule" else oracle.IDENTITY
        seen = {
            tuple(sorted(map(oracle.point_of, oracle.mesh_contacts(shape, (x, 0.05, 0.1), rotation, size, mesh, 0.01))))
            for x in np.linspace(-1.0, 1.0, 101)
        }
        assert len(seen) == 1 and len(seen.pop()) == count


@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_a_second_facet_does_not_rename_the_first(terrain):
    """A sphere that rolls along one side of a valley and comes to the other: the contact it had keeps its feature."""
    heights, size = ridge()
    contacts_with = both(-heights, size)[terrain]
    seen = []
    for x in np.linspace(0.3, 0.0, 61):
        place = (x, 0.07, 0.5 * x + 0.1 * np.hypot(1.0, 0.5))
        contacts = contacts_with(SPHERE, place, oracle.IDENTITY, (0.1, 0.0, 0.0), 0.01)
        rolling = contacts[contacts["normal"][:, 0] > 0.0]
        assert len(rolling) == 1
        seen.append(int(rolling[0]["feature"]))
    changes = np.count_nonzero(np.diff(seen))
    assert changes == len(set(seen)) - 1 <= 4


@pytest.mark.parametrize("terrain", ["field", "mesh"])
def test_placed_terrain_gives_the_same_contacts_in_its_frame(terrain):
    rng = np.random.default_rng(7)
    heights = rng.normal(0.0, 0.05, (17, 17))
    turn = oracle.rotation_matrix((0.3, -0.2, 0.9))
    frame, shift = np.reshape(turn, (3, 3)), np.array([3.0, -2.0, 1.0])
    if terrain == "field":
        caller, data = oracle.field_contacts, oracle.height_field(heights, (4.0, 4.0))
    else:
        caller, data = oracle.mesh_contacts, prepare_mesh(*oracle.grid_mesh(heights, (4.0, 4.0)))
    for shape, size in SHAPES.values():
        position, rotation = np.array([0.1, 0.2, 0.12]), oracle.rotation_matrix((0.1, 0.2, 0.3))
        here = caller(shape, position, rotation, size, data, 0.02)
        placed = oracle.floats((frame @ np.reshape(rotation, (3, 3))).ravel())
        there = caller(shape, frame @ position + shift, placed, size, data, 0.02, (oracle.floats(shift), turn))
        assert len(here) == len(there) > 0
        np.testing.assert_allclose(there["position"], here["position"] @ frame.T + shift, atol=1e-12)
        np.testing.assert_allclose(there["normal"], here["normal"] @ frame.T, atol=1e-12)
        np.testing.assert_allclose(there["gap"], here["gap"], atol=1e-12)
        assert (there["feature"] == here["feature"]).all()


def test_many_contacts_are_reduced_to_their_extremes():
    """A large box in rough ground keeps the deepest contact and ones near its four corners."""
    rng = np.random.default_rng(8)
    terrain = oracle.height_field(rng.normal(0.0, 0.05, (65, 65)), (8.0, 8.0))
    contacts = oracle.field_contacts(BOX, (0.1, 0.2, 0.1), oracle.IDENTITY, (1.0, 1.0, 0.1), terrain, 0.01)
    assert len(contacts) == len(set(contacts["feature"])) == 12
    for x, y in itertools.product((-1.0, 1.0), repeat=2):
        assert ((contacts["position"][:, :2] - (0.1, 0.2)) @ (x, y)).max() > 1.2


@pytest.mark.parametrize("depth", [0.0, 1e-12, 1e-9, 1e-8])
@pytest.mark.parametrize("distance", [1e-3, 1e-6, 1e-7])
def test_a_corner_that_lies_in_a_little_knows_the_next_face(depth, distance):
    """A box that slides down a valley, its lowest corner ``distance`` before the crease, sunk by what a step leaves."""
    slope = 0.2
    x = np.linspace(-2.0, 2.0, 17)
    terrain = oracle.height_field(np.tile(slope * np.abs(x), (17, 1)), (4.0, 4.0))
    size = np.array(SHAPES["box"][1])
    turn = np.reshape(oracle.rotation_matrix(np.array([0.3, 0.4, 0.2])), (3, 3))
    corner = np.array([-distance, 0.06, slope * distance - depth])
    # Of all eight the corner that is lowest.
    signs = -np.sign(turn[2])
    position = corner - turn @ (signs * size)
    contacts = oracle.field_contacts(BOX, position, oracle.floats(turn.ravel()), size, terrain, 0.01, motion=5e-3)
    own = [contact for contact in contacts if oracle.point_of(contact) is not None and abs(contact["gap"]) < 1e-3]
    tilts = sorted(float(contact["normal"][0]) for contact in own)
    level = slope / np.hypot(1.0, slope)
    np.testing.assert_allclose(tilts, (-level, level), rtol=1e-12)
    for contact in own:
        # Normals lead into the ground: that of the corner's own face to the left.
        expected = -depth if contact["normal"][0] < 0.0 else 2.0 * slope * distance - depth
        assert contact["gap"] == pytest.approx(expected / np.hypot(1.0, slope), abs=1e-15)

"""Contacts of moving meshes against distances by all triangles."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from avalanche_gym.physics.narrow_phase.mesh_pieces import NEAR_MARGIN
from avalanche_gym.physics.shapes import TriangleMesh
from avalanche_gym.physics.shapes.icosphere import icosphere
from avalanche_gym.physics.shapes.planet import bumpy_planet
from avalanche_gym.physics.shapes.rabbit import rabbit
from avalanche_gym.physics.shapes.ring_solids import gear, torus
from avalanche_gym.physics.shapes.thread import Thread, bolt, nut
from tests.oracles import mesh_oracle as oracle
from tests.oracles import smooth_oracle, terrain_oracle

BOX_FACES = [
    (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
    (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
]  # fmt: skip
SOLIDS = (
    gear(0.1, 0.05, teeth=4),
    torus(0.1, 0.03, segments=10, sides=5),
    bumpy_planet(0.1, np.random.default_rng(0), subdivisions=1, amplitude=0.4, bumps=5),
)


def random_place(rng):
    return np.zeros(3), Rotation.random(random_state=rng).as_matrix()


def brought_near(first, place, second, gap, rng):
    """A place of the second mesh, turned at random, at about this distance from the first; and the distance."""
    turn = Rotation.random(random_state=rng).as_matrix()
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    triangles = oracle.placed(first, place)
    near, far = 0.0, 0.5
    for _ in range(9):
        along = 0.5 * (near + far)
        other = oracle.placed(second, (along * direction, turn))
        overlap = oracle.is_inside(other.reshape(-1, 3), triangles).any()
        overlap |= oracle.is_inside(triangles.reshape(-1, 3), other).any()
        distance = 0.0 if overlap else oracle.mesh_distance(triangles, other)
        if 0.3 * gap < distance < gap:
            return (along * direction, turn), distance
        near, far = (along, far) if distance < gap else (near, along)
    return None, 0.0


@pytest.mark.parametrize("seed", range(6))
def test_the_smallest_gap_is_the_distance(seed):
    rng = np.random.default_rng(seed)
    other = None
    while other is None:  # some only overlap or stay apart along their line
        first, second = (SOLIDS[k] for k in rng.integers(0, 3, 2))
        place = random_place(rng)
        other, distance = brought_near(first, place, second, 0.004, rng)
    contacts = oracle.meshes_contacts(first, place, second, other, 0.006)
    assert contacts["gap"].min() == pytest.approx(distance, rel=1e-9)
    swapped = oracle.meshes_contacts(second, other, first, place, 0.006)
    assert swapped["gap"].min() == pytest.approx(distance, rel=1e-9)
    # The two points of the deepest contact lie on the surfaces.
    deepest = contacts[contacts["gap"].argmin()]
    for mesh, at, side in ((first, place, -0.5), (second, other, 0.5)):
        point = deepest["position"] + side * deepest["gap"] * deepest["normal"]
        assert oracle.distances(point[None], oracle.placed(mesh, at))[0] < 1e-12


def test_order_of_two_meshes_does_not_matter():
    place = (np.array([0.0, 0.0, 0.161]), Rotation.from_euler("x", 0.1).as_matrix())
    one = oracle.meshes_contacts(SOLIDS[0], oracle.IDENTITY, SOLIDS[1], place, 0.12)
    other = oracle.meshes_contacts(SOLIDS[1], place, SOLIDS[0], oracle.IDENTITY, 0.12)
    assert len(one) == len(other) > 0
    for a in one:
        match = [b for b in other if np.allclose(a["position"], b["position"], atol=1e-12)]
        assert match and np.allclose(match[0]["normal"], -a["normal"], atol=1e-12)


def test_overlap_is_the_depth_of_the_vertices():
    vertices, faces = icosphere(2)
    ball = TriangleMesh(0.1 * vertices, faces)
    slab = gear(1.0, 0.2, teeth=4, bore=0.01)
    depth = 1e-3
    place = (np.array([0.4, 0.1, 0.1 - (0.1 * vertices[:, 2]).min() - depth]), np.eye(3))
    contacts = oracle.meshes_contacts(slab, oracle.IDENTITY, ball, place, 0.005)
    assert contacts["gap"].min() == pytest.approx(-depth, rel=1e-9)
    np.testing.assert_allclose(contacts["normal"], [[0, 0, 1]] * len(contacts), atol=1e-12)


def test_a_tip_sunk_into_a_face_that_is_flat_to_ten_digits_is_found():
    """The faces share one normal, their corners on the edges of the block stay where they are: up to 1e-10 off it.

    A tip came through such a face, and the nearest point of that counted as behind it: there was no contact at all.
    """
    rng = np.random.default_rng(3)
    block = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide().subdivide().subdivide()
    block = TriangleMesh(block.vertices + rng.uniform(-3e-11, 3e-11, block.vertices.shape), block.faces)
    tip = TriangleMesh(
        [(0.0, 0.0, 0.0), (0.01, 0.0, 0.02), (-0.005, 0.01, 0.02), (-0.005, -0.01, 0.02)],
        [(0, 1, 3), (0, 3, 2), (0, 2, 1), (1, 2, 3)],
    )
    for depth in (1e-10, 1e-8, 1e-6, 1e-4):
        for _ in range(100):
            place = (np.array([*rng.uniform(-0.049, 0.049, 2), 0.05 - depth]), np.eye(3))
            for one, other in (((block, oracle.IDENTITY), (tip, place)), ((tip, place), (block, oracle.IDENTITY))):
                contacts = oracle.meshes_contacts(*one, *other, 0.001)
                assert len(contacts) > 0
                assert contacts["gap"].min() == pytest.approx(-depth, abs=1e-9)


def bar(section, width):
    """A prism along y with this section, (n, 2) [m] of x and z, counter-clockwise seen along y, its first corner in
    sight of all others.
    """
    n = len(section)
    vertices = [(x, y, z) for y in (-0.5 * width, 0.5 * width) for x, z in section]
    caps = [(0, k, k + 1) for k in range(1, n - 1)]
    faces = caps + [(n + a, n + c, n + b) for a, b, c in caps]
    for k in range(n):
        faces += [(k, k + n, (k + 1) % n + n), (k, (k + 1) % n + n, (k + 1) % n)]
    return TriangleMesh(vertices, faces)


def edge_on_top(slope, height):
    """A block with an edge on top of it that runs along x, is ``height`` [m] high at x = 0 and falls with ``slope``."""
    turn = Rotation.from_euler("yx", (np.arctan(slope), np.radians(3.0))).as_matrix()
    block = trimesh.creation.box((0.2, 0.1, 0.1))
    block.apply_translation((0.0, -0.05, -0.05))
    return TriangleMesh(block.vertices, block.faces), (np.array([0.0, 0.0, height]), turn)


@pytest.mark.parametrize("depth", [1e-5, 1e-4, 1e-3])
def test_an_edge_under_a_sharp_rim_is_found(depth):
    """The rim is that of a ramp of 60 degrees; straight below it, at x = 0, the edge is not yet behind its side."""
    way, up = np.radians(5.0), np.radians(65.0)
    section = [(0.0, 0.0), (0.05 * np.cos(way), 0.05 * np.sin(way)), (0.05 * np.cos(up), 0.05 * np.sin(up))]
    ramp = bar(section, 0.02)
    block, place = edge_on_top(0.0, depth)
    for one, other in (((ramp, oracle.IDENTITY), (block, place)), ((block, place), (ramp, oracle.IDENTITY))):
        contacts = oracle.meshes_contacts(*one, *other, 1e-4)
        deepest = contacts[contacts["gap"].argmin()]
        assert deepest["gap"] == pytest.approx(-depth, rel=0.01)
        assert abs(deepest["normal"][2]) > 0.99


def test_threads_touch_neighbouring_turns_only():
    thread = Thread(0.01, 0.004, 0.002)
    rod, ring = bolt(thread, 4, segments=12), nut(thread, 1, clearance=2e-4, segments=12)
    place = (np.array([0.0, 0.0, 1.0 * thread.pitch]), np.eye(3))
    distance = oracle.mesh_distance(oracle.placed(rod, oracle.IDENTITY), oracle.placed(ring, place))
    contacts = oracle.meshes_contacts(rod, oracle.IDENTITY, ring, place, 5e-4)
    assert len(contacts) == 12
    assert contacts["gap"].min() == pytest.approx(distance, rel=1e-9)
    # A little too deep: still no contact with the turn beyond.
    lower = (place[0] - (0.0, 0.0, 3e-4), place[1])
    contacts = oracle.meshes_contacts(rod, oracle.IDENTITY, ring, lower, 5e-4)
    assert -2e-4 < contacts["gap"].min() < 0.0


@pytest.mark.parametrize("seed", range(4))
def test_a_height_field_is_the_mesh_of_its_facets(seed):
    rng = np.random.default_rng(seed)
    heights = 0.05 * rng.random((9, 9))
    ground = TriangleMesh(*terrain_oracle.grid_mesh(heights, (1.0, 1.0)))
    field = terrain_oracle.height_field(heights, (1.0, 1.0))
    turn = Rotation.random(random_state=rng).as_matrix()
    solid = SOLIDS[seed % 3]
    lowest = (solid.vertices @ turn.T)[:, 2].min()
    place = (np.array([0.02, 0.03, 0.05 - lowest]), turn)
    distance = oracle.mesh_distance(oracle.placed(ground, oracle.IDENTITY), oracle.placed(solid, place))
    place[0][2] -= 0.9 * distance  # still apart
    distance = oracle.mesh_distance(oracle.placed(ground, oracle.IDENTITY), oracle.placed(solid, place))
    on_field = oracle.field_mesh_contacts(field, solid, place, 2.0 * distance)
    on_mesh = oracle.meshes_contacts(ground, oracle.IDENTITY, solid, place, 2.0 * distance)
    assert on_field["gap"].min() == pytest.approx(distance, rel=1e-9)
    assert on_mesh["gap"].min() == pytest.approx(distance, rel=1e-9)


@pytest.mark.parametrize("depth", [1e-4, 1e-3, 8e-3])
def test_a_peak_sunk_into_a_face_is_found_however_little_is_asked_for(depth):
    """Its vertex lies in the middle of a large face, farther from it than the margin."""
    heights = np.zeros((9, 9))
    heights[4, 4] = 0.02
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * (0.1, 0.08, 0.05)
    slab = TriangleMesh(corners, BOX_FACES)
    place = (np.array([0.01, -0.02, 0.02 - depth + 0.05]), np.eye(3))
    contacts = oracle.field_mesh_contacts(terrain_oracle.height_field(heights, (0.4, 0.4)), slab, place, 0.0)
    assert contacts["gap"].min() == pytest.approx(-depth, rel=1e-9)


def test_what_is_near_is_listed_without_what_is_far():
    """With little motion, contacts farther off are left out where something is nearer."""
    vertices, faces = icosphere(3)
    ball = TriangleMesh(0.1 * vertices, faces)
    field = terrain_oracle.height_field(np.zeros((3, 3)), (2.0, 2.0))
    place = (np.array([0.0, 0.0, -(0.1 * vertices[:, 2]).min() + 1e-4]), np.eye(3))
    all_near = oracle.field_mesh_contacts(field, ball, place, 5e-3)
    near = oracle.field_mesh_contacts(field, ball, place, 5e-3, motion=1e-4)
    assert near["gap"].max() <= 2e-4 + NEAR_MARGIN * 5e-3 < all_near["gap"].max()
    far = (place[0] + (0.0, 0.0, 3e-3), place[1])
    assert len(oracle.field_mesh_contacts(field, ball, far, 5e-3, motion=1e-4)) > 0


@pytest.mark.parametrize("ground", ["field", "mesh"])
def test_what_strikes_in_the_step_is_among_the_contacts(ground):
    """Of a ball of many vertices that turns, the one that will be the lowest counts, not those that are near now."""
    vertices, faces = icosphere(4)
    ball = TriangleMesh(0.1 * vertices * (1.0, 1.0, 1.2), faces)
    turn = -0.3
    axis = Rotation.from_rotvec((0.0, 0.4, 0.0)).as_matrix()
    points = ball.vertices @ axis.T
    place = (np.array([0.0, 0.0, 1e-4 - points[:, 2].min()]), axis)
    path = ((0.0, 0.0, place[0][2]), (0.0, 0.0, 0.0), (0.0, turn, 0.0))
    end = points[:, 2] + place[0][2] + np.cross(path[2], points)[:, 2]
    assert end.min() < -1e-3
    if ground == "field":
        field = terrain_oracle.height_field(np.zeros((3, 3)), (2.0, 2.0))
        contacts = oracle.field_mesh_contacts(field, ball, place, 0.05, motion=0.04, path=path, loose=0.0)
    else:
        sheet = TriangleMesh(*terrain_oracle.grid_mesh(np.zeros((3, 3)), (2.0, 2.0)))
        contacts = oracle.meshes_contacts(sheet, oracle.IDENTITY, ball, place, 0.05, motion=0.04, path=path, loose=0.0)
    foot = contacts["position"] + 0.5 * contacts["gap"][:, None] * contacts["normal"] - place[0]
    assert len(contacts) == 12
    reached = contacts["gap"] + np.cross(path[2], foot)[:, 2]
    assert reached.min() == pytest.approx(end.min(), abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_mesh_meets_a_smooth_field_where_the_two_are_nearest(seed):
    """The deepest contact is as far off as the nearest of all points of a fine lattice over the mesh, moving or not."""
    rng = np.random.default_rng(seed)
    heights, size = 0.05 * rng.random((9, 9)), (1.0, 1.0)
    field = smooth_oracle.smooth_terrain(heights, size)
    turn = Rotation.random(random_state=rng).as_matrix()
    solid = SOLIDS[seed % 3]
    # Vertices, and points of edges and faces.
    u, v = rng.random((2, 300))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    u, v = np.concatenate([[0.0], np.linspace(0.0, 1.0, 200), u]), np.concatenate([[0.0], np.zeros(200), v])
    a, b, c = (np.array(solid.vertices)[solid.faces[:, k]] @ turn.T for k in range(3))
    sides = [(a, b, c), (b, c, a), (c, a, b)]
    points = [p[:, None] + u[:, None] * (q - p)[:, None] + v[:, None] * (r - p)[:, None] for p, q, r in sides]
    points = np.concatenate(points).reshape(-1, 3)
    points += (0.02, 0.03, 0.0)
    below = smooth_oracle.spline_height(heights, size, points[:, 0], points[:, 1])
    points[:, 2] += 1e-3 + (below - points[:, 2]).max()
    near = points[np.argsort(points[:, 2] - below)[:40]]
    distance = min(smooth_oracle.nearest_distance(heights, size, p, 101) for p in near)
    place = (np.array([0.02, 0.03, points[0, 2] - a[0, 2]]), turn)
    still = oracle.smooth_mesh_contacts(field, solid, place, 4e-3)
    assert still["gap"].min() <= distance + 1e-9
    assert still["gap"].min() == pytest.approx(distance, abs=2e-4)
    falls = ((0.0, 0.0, 0.0), (0.0, 0.0, -2e-3), (0.0, 0.0, 0.0))
    moving = oracle.smooth_mesh_contacts(field, solid, place, 4e-3, motion=2e-3, path=falls, loose=0.0)
    assert moving["gap"].min() == still["gap"].min()


THREAD = Thread(0.03, 0.012, 0.006)
WEDGED = {
    # The rim of a tooth and a corner of a nut cut each other's wedge, the way out almost along a side of the tooth.
    "tooth in a nut": (
        gear(0.1, 0.05), nut(THREAD, 2, clearance=1e-3), (-0.10125, -0.01833, 0.07167), (1.69455, 0.31157, 0.13527)
    ),
    # ... almost along a side of the nut, too.
    "tooth and nut flat": (
        gear(0.1, 0.05), nut(THREAD, 2, clearance=1e-3), (0.07355, -0.01614, 0.05926), (-1.88256, -2.3829, -0.01219)
    ),
    # A tube lies on the rim of a hole: the wall of the hole is nearer than the face, but not what it came through.
    "tube on a hole": (torus(0.1, 0.03), gear(0.1, 0.05), (0.00915, 0.14487, -0.03588), (0.44984, -0.02029, -0.33544)),
}  # fmt: skip


def deepest(one, place, other, place_of_other):
    """[m] of the vertices and middles of edges of a mesh inside another one."""
    triangles, own = oracle.placed(other, place_of_other), oracle.placed(one, place)
    points = np.unique(np.concatenate([own.reshape(-1, 3), oracle.edges(own).mean(axis=1)]), axis=0)
    points = points[((points > triangles.min((0, 1))) & (points < triangles.max((0, 1)))).all(axis=1)]
    parts = np.array_split(points, len(points) // 200 + 1)
    inside = np.concatenate([part[oracle.is_inside(part, triangles)] for part in parts])
    return oracle.distances(inside, triangles).max(initial=0.0) if len(inside) else 0.0


@pytest.mark.parametrize("name", WEDGED)
def test_the_deepest_contact_leads_out(name):
    """Even with a margin far below the depth: what a step failed to stop does not stay where it is."""
    first, second, position, turn = WEDGED[name]
    place = (np.array(position), Rotation.from_rotvec(turn).as_matrix())
    contacts = oracle.meshes_contacts(first, oracle.IDENTITY, second, place, 5e-4)
    contact = contacts[contacts["gap"].argmin()]
    deep = max(deepest(first, oracle.IDENTITY, second, place), deepest(second, place, first, oracle.IDENTITY))
    assert deep > 2e-4 and -2.5 * deep < contact["gap"] < -0.9 * deep
    moved = (place[0] - contact["gap"] * contact["normal"], place[1])
    assert deepest(first, oracle.IDENTITY, second, moved) < 1e-9
    assert deepest(second, moved, first, oracle.IDENTITY) < 1e-9


def test_what_touches_is_kept_beside_what_strikes_elsewhere():
    """A rabbit stands on one foot and comes down with another: a vertex beside the first, still open, does not do."""
    solid = rabbit(0.2)
    field = terrain_oracle.height_field(0.1 * np.random.default_rng(7).random((21, 21)), (4.0, 4.0))
    rotation = Rotation.from_quat([0.729333, -0.307621, 0.28002, -0.543168]).as_matrix()
    place = (np.array([0.100214, 0.038277, 0.113465]), rotation)
    place[0][2] -= oracle.field_mesh_contacts(field, solid, place, 1e-3)["gap"].min()
    center = place[0] + rotation @ solid.mass_properties().center
    turn, velocity = np.array([3.24, 1.154, 0.759]) / 240, np.array([0.3504, -0.0919, -0.2197])
    shift = velocity / 240 + np.cross(turn, center - place[0]) - np.array([0.0, 0.0, 9.81 / 240**2])
    path = (tuple(center), tuple(shift), tuple(turn))
    contacts = oracle.field_mesh_contacts(field, solid, place, 3.9e-3, motion=3.4e-3, path=path, loose=1.4e-5)
    assert contacts["gap"].min() < 1e-6

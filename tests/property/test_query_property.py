"""Ray cast and nearest point of every shape against slow twins, in random places."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull as SciPyHull
from scipy.spatial.transform import Rotation

from avalanche_gym import physics
from tests.oracles import query_oracle, smooth_oracle, terrain_oracle

RNG = np.random.default_rng(0)
HULL_POINTS = RNG.normal(size=(14, 3)) * 0.4
HULL_PLANES = SciPyHull(HULL_POINTS).equations
SOLIDS = {
    "sphere": (physics.Sphere(0.5), query_oracle.in_capsule((0.5, 0.0))),
    "capsule": (physics.Capsule(0.3, 0.4), query_oracle.in_capsule((0.3, 0.4))),
    "box": (physics.Box((0.5, 0.3, 0.4)), query_oracle.in_box((0.5, 0.3, 0.4))),
    "cylinder": (physics.Cylinder(0.4, 0.3), query_oracle.in_cylinder((0.4, 0.3))),
    "hull": (physics.ConvexHull(HULL_POINTS), query_oracle.in_hull(HULL_PLANES[:, :3], -HULL_PLANES[:, 3])),
}


def world_of(shape, motion="dynamic", position=(0.0, 0.0, 0.0), orientation=(1.0, 0.0, 0.0, 0.0)):
    scene = physics.Scene()
    scene.add_body(shape, motion=motion, position=position, orientation=orientation)
    return physics.World(scene)


def rays(rng, count, reach=1.5):
    """Origins around, and directions towards, the origin; some along the axes."""
    origins = rng.uniform(-reach, reach, (count, 3))
    directions = rng.normal(scale=0.35, size=(count, 3)) - origins
    axes = np.eye(3)[rng.integers(3, size=count)] * rng.choice([-1.0, 1.0], count)[:, None]
    directions[::4] = axes[::4]
    return origins, directions / np.linalg.norm(directions, axis=1)[:, None]


@pytest.mark.parametrize("name", SOLIDS)
def test_rays_meet_solids_where_points_along_them_enter(name):
    shape, inside = SOLIDS[name]
    rng = np.random.default_rng(1)
    turn, shift = Rotation.random(random_state=2), np.array([1.0, -2.0, 0.5])
    orientation = np.roll(turn.as_quat(), 1)
    world = world_of(shape, position=shift, orientation=orientation)
    origins, directions = rays(rng, 150)
    placed = turn.apply(origins) + shift, turn.apply(directions)
    hits = world.ray_cast(*placed, max_distance=4.0, world=0)
    for hit, origin, direction in zip(hits, origins, directions, strict=True):
        expected = query_oracle.march(inside, origin, direction, 4.0)
        if np.isfinite(expected):
            assert hit["distance"] == pytest.approx(expected, abs=1e-9)
            assert np.dot(hit["normal"], turn.apply(direction)) <= 1e-9
        elif hit["body"] == 0:  # it grazes: between two points of the march
            middle = origin + (hit["distance"] + 1e-6) * direction
            assert query_oracle.march(inside, middle, direction, 2e-3, 400) < np.inf or hit["distance"] > 3.99


@pytest.mark.parametrize("name", SOLIDS)
def test_nearest_points_lie_on_the_surface_and_none_is_nearer(name):
    shape, inside = SOLIDS[name]
    rng = np.random.default_rng(3)
    world = world_of(shape)
    points = rng.uniform(-1.0, 1.0, (200, 3))
    found = world.closest_point(points, world=0)
    assert ((found["distance"] <= 0.0) == inside(points)).all()
    np.testing.assert_allclose(found["position"], points - found["distance"][:, None] * found["normal"], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found["normal"], axis=1), 1.0, atol=1e-12)
    # On the surface: a step along the normal is out, a step to the middle of the shape is in.
    assert not inside(found["position"] + 1e-9 * found["normal"]).any()
    assert inside((1.0 - 1e-9) * found["position"]).all()
    # No direction leads to the other side sooner.
    for _ in range(30):
        ways = rng.normal(size=points.shape)
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        stepped = points + 0.999 * np.abs(found["distance"])[:, None] * ways
        assert (inside(stepped) == inside(points)).all()


def rough(rng, shape=(9, 8)):
    return rng.normal(0.0, 0.15, shape), (2.0, 1.6)


def terrain_rays(rng, count):
    origins = np.column_stack([rng.uniform(-1.2, 1.2, (count, 2)), rng.uniform(0.0, 1.0, count)])
    directions = np.column_stack([rng.normal(size=(count, 2)), -rng.uniform(-0.1, 1.0, count)])
    directions[::5] = (0.0, 0.0, -1.0)
    directions[1::5, 1] = 0.0
    return origins, directions / np.linalg.norm(directions, axis=1)[:, None]


def test_rays_meet_facets_where_the_triangles_are():
    rng = np.random.default_rng(4)
    heights, size = rough(rng)
    vertices, faces = terrain_oracle.grid_mesh(heights, size)
    field = world_of(physics.HeightField(heights, size), "static")
    mesh = world_of(physics.TriangleMesh(vertices, faces), "static")
    origins, directions = terrain_rays(rng, 400)
    on_field, on_mesh = (world.ray_cast(origins, directions, world=0) for world in (field, mesh))
    walls = 0
    for f, m, origin, direction in zip(on_field, on_mesh, origins, directions, strict=True):
        t, front = query_oracle.cross_triangles(origin, direction, vertices[faces])
        expected = t[front].min(initial=np.inf)
        assert m["distance"] == pytest.approx(expected, abs=1e-9)
        if f["distance"] == pytest.approx(expected, abs=1e-9) or np.isinf(f["distance"]) == np.isinf(expected):
            continue
        walls += 1  # it came through a wall, or started below
        on_rim = np.abs(f["position"][:2]) / size
        assert f["distance"] == 0.0 or on_rim.max() == pytest.approx(0.5)
    assert 0 < walls < 200


def test_rays_meet_the_smooth_surface_at_its_first_zero():
    rng = np.random.default_rng(5)
    heights, size = rough(rng)
    world = world_of(physics.HeightField(heights, size, surface="smooth"), "static")
    origins, directions = terrain_rays(rng, 200)
    hits = world.ray_cast(origins, directions, max_distance=3.0, world=0)

    def inside(p):
        within = (np.abs(p[:, :2]) <= 0.5 * np.array(size)).all(axis=1)
        z = smooth_oracle.spline_height(heights, size, *np.clip(p[:, :2].T, [[-1.0], [-0.8]], [[1.0], [0.8]]))
        return within & (p[:, 2] <= z)

    for hit, origin, direction in zip(hits, origins, directions, strict=True):
        expected = query_oracle.march(inside, origin, direction, 3.0, 3000)
        if np.isfinite(expected):
            assert hit["distance"] == pytest.approx(expected, abs=1e-9)
        else:
            assert hit["body"] == -1 or inside((origin + (hit["distance"] + 1e-5) * direction)[None])[0]


@pytest.mark.parametrize("surface", ["facets", "smooth", "mesh"])
def test_nearest_points_of_terrain(surface):
    rng = np.random.default_rng(6)
    heights, size = rough(rng)
    vertices, faces = terrain_oracle.grid_mesh(heights, size)
    shape = physics.TriangleMesh(vertices, faces)
    if surface != "mesh":
        shape = physics.HeightField(heights, size, surface=surface)
    world = world_of(shape, "static")
    points = rng.uniform((-1.2, -1.0, -0.2), (1.2, 1.0, 0.8), (60, 3))
    for point, found in zip(points, world.closest_point(points, world=0), strict=True):
        if surface == "smooth":
            expected = smooth_oracle.nearest_distance(heights, size, point, 121)
        else:
            expected = terrain_oracle._point_triangle(point[None, None], vertices[faces]).min()
        if abs(found["normal"][2]) > 0.0:  # the others are nearest to a wall
            assert abs(found["distance"]) == pytest.approx(expected, abs=1e-7)
        else:
            assert surface != "mesh" and abs(found["distance"]) <= expected + 1e-9


def test_closed_mesh():
    solid = trimesh.creation.icosphere(subdivisions=3, radius=0.7)
    world = world_of(physics.TriangleMesh(solid.vertices, solid.faces), "static")
    rng = np.random.default_rng(7)
    origins, directions = rays(rng, 300)
    hits = world.ray_cast(origins, directions, world=0)
    triangles = solid.triangles
    normals, offsets = solid.face_normals, (solid.face_normals * triangles[:, 0]).sum(axis=1)
    held = (origins @ normals.T - offsets).max(axis=1)
    for hit, origin, direction, depth in zip(hits, origins, directions, held, strict=True):
        t, front = query_oracle.cross_triangles(origin, direction, triangles)
        expected = 0.0 if depth <= 0.0 else t[front].min(initial=np.inf)
        assert hit["distance"] == pytest.approx(expected, abs=1e-9)
    found = world.closest_point(origins, world=0)
    expected = terrain_oracle._point_triangle(origins[:, None], triangles).min(axis=1)
    np.testing.assert_allclose(np.abs(found["distance"]), expected, atol=1e-9)
    assert ((found["distance"] < 0.0) == (held < 0.0)).all()

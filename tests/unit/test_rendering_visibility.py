"""The visibility buffer against rays shot through each pixel, and the properties it promises."""

import numpy as np
import pytest

from avalanche_gym.rendering import Camera, Geometry, SceneView, Visual
from avalanche_gym.rendering.visibility import PROJECTED, TRIANGLE, draw_instances

WIDTH, HEIGHT = 48, 36


def draw(view, camera):
    """depth and the instance (height, width) that is seen at each pixel, -1 for none."""
    depth = np.zeros((HEIGHT, WIDTH), np.float32)
    ids = np.full((HEIGHT, WIDTH), -1, np.int32)
    triangles = np.zeros(len(view.faces) * len(view.instances), TRIANGLE)
    box = np.array([WIDTH, HEIGHT, -1, -1])
    draw_instances(
        view.instances,
        view.drawn(),
        camera.projection(WIDTH, HEIGHT),
        view.vertices,
        view.faces,
        np.zeros(view.num_projected, PROJECTED),
        triangles,
        depth,
        ids,
        box,
    )
    seen = np.where(ids >= 0, triangles["instance"][ids], -1)
    return depth, seen, box


def shoot(soups, camera):
    """The same by the intersection of each ray with each triangle (Moeller & Trumbore 1997), fronts only."""
    record = camera.record(WIDTH, HEIGHT)[0]
    i, j = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = (
        record["forward"]
        + ((i - record["center"][0]) * record["pixel"])[..., None] * record["right"]
        + ((j - record["center"][1]) * record["pixel"])[..., None] * record["down"]
    ).reshape(-1, 1, 3)
    nearest = np.full(HEIGHT * WIDTH, np.inf)
    seen = np.full(HEIGHT * WIDTH, -1)
    for number, corners in enumerate(soups):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        normal = np.cross(b - a, c - a)
        slope = rays @ normal.T
        slope = slope[:, 0] if slope.ndim == 3 else slope
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((a - record["eye"]) * normal).sum(axis=1) / slope
        point = record["eye"] + rays * t[..., None]
        inside = (slope < 0.0) & (t >= camera.distance * 1e-3)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= (np.cross(q - p, point - p) * normal).sum(axis=2) >= 0.0
        t = np.where(inside, t, np.inf).min(axis=1)
        seen[t < nearest] = number
        nearest = np.minimum(nearest, t)
    depth = np.where(np.isfinite(nearest), 1.0 / nearest, 0.0)
    return depth.reshape(HEIGHT, WIDTH), seen.reshape(HEIGHT, WIDTH)


def soup(generator, count, spread):
    """Triangles at random; some of them reach behind the eye."""
    middle = generator.uniform(-spread, spread, (count, 1, 3))
    return middle + generator.normal(size=(count, 3, 3))


@pytest.mark.parametrize("seed", range(6))
def test_agrees_with_rays(seed):
    generator = np.random.default_rng(seed)
    soups = [soup(generator, 12, 4.0) for _ in range(3)]
    visuals = [Visual(Geometry.smoothed(s.reshape(-1, 3), np.arange(36).reshape(-1, 3))) for s in soups]
    camera = Camera(eye=generator.normal(size=3) * 3.0, target=generator.normal(size=3), fov=70.0)
    depth, seen, _ = draw(SceneView(visuals), camera)
    expected_depth, expected = shoot(soups, camera)
    # A ray that meets an edge within rounding may fall on either side of it.
    same = seen == expected
    assert same.mean() > 0.995
    np.testing.assert_allclose(depth[same], expected_depth[same], rtol=1e-5)


def test_poses_move_what_is_drawn():
    generator = np.random.default_rng(3)
    corners = soup(generator, 12, 2.0)
    geometry = Geometry.smoothed(corners.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    turn = generator.normal(size=4)
    turn /= np.linalg.norm(turn)
    position = np.array([0.4, -0.2, 0.7])
    view = SceneView([Visual(geometry)])
    view.set_poses([position], [turn])
    w, u = turn[0], turn[1:]
    moved = corners + 2.0 * np.cross(u, np.cross(u, corners) + w * corners) + position
    camera = Camera(eye=(6.0, -3.0, 2.0), target=(0.0, 0.0, 0.0))
    depth, _, _ = draw(view, camera)
    expected, _ = shoot([moved], camera)
    assert (np.isclose(depth, expected, rtol=1e-5)).mean() > 0.995


def test_no_cracks_and_no_dropped_triangles_from_within_a_scene():
    """The eye inside a closed room sees a wall at every pixel, though most of its triangles reach behind the eye."""
    generator = np.random.default_rng(0)
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    from scipy.spatial import ConvexHull

    hull = ConvexHull(np.concatenate([corners, generator.uniform(-1, 1, (30, 3)) * 1.2]))
    faces = hull.simplices.copy()
    a, b, c = (hull.points[faces[:, k]] for k in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) > 0.0
    faces[outward] = faces[outward][:, ::-1]
    view = SceneView([Visual(Geometry.smoothed(hull.points, faces))])
    for _ in range(20):
        eye = generator.uniform(-0.3, 0.3, 3)
        _, seen, box = draw(view, Camera(eye=eye, target=eye + generator.normal(size=3), fov=90.0))
        assert (seen == 0).all()
        assert box.tolist() == [0, 0, WIDTH - 1, HEIGHT - 1]


def test_an_endless_floor_ends_at_the_horizon():
    """A floor whose two triangles run from far ahead to far behind the eye fills all rows below the horizon."""
    far = 1e4
    floor = np.array([(-far, -far, 0.0), (far, -far, 0.0), (far, far, 0.0), (-far, far, 0.0)])
    geometry = Geometry.smoothed(floor, [(0, 1, 2), (0, 2, 3)])
    camera = Camera(eye=(0.0, 0.0, 1.0), target=(0.0, 1.0, 1.0))
    depth, seen, _ = draw(SceneView([Visual(geometry)]), camera)
    below = np.arange(HEIGHT) > 0.5 * (HEIGHT - 1)
    assert ((seen == 0) == below[:, None]).all()
    # A height of 1 m under the eye is seen at depth focal length / (rows below the middle).
    rows = (np.arange(HEIGHT) - 0.5 * (HEIGHT - 1))[below] * camera.record(WIDTH, HEIGHT)["pixel"][0]
    np.testing.assert_allclose(depth[below][:, 0], rows, rtol=1e-5)


def test_backs_are_seen_only_of_sheets():
    triangle = np.array([(-1.0, 0.0, -1.0), (1.0, 0.0, -1.0), (0.0, 0.0, 1.0)])
    for eye, is_front in (((0.0, -4.0, 0.0), True), ((0.0, 4.0, 0.0), False)):
        camera = Camera(eye=eye, target=(0.0, 0.0, 0.0))
        for two_sided in (False, True):
            view = SceneView([Visual(Geometry.smoothed(triangle, [(0, 1, 2)], two_sided=two_sided))])
            _, seen, _ = draw(view, camera)
            assert (seen == 0).any() == (is_front or two_sided)


def test_what_is_not_finite_is_not_drawn():
    triangle = np.array([(-1.0, 0.0, -1.0), (1.0, 0.0, -1.0), (0.0, 0.0, np.nan)])
    geometry = Geometry(triangle, np.array([(0, 1, 2)]), np.zeros((3, 3)))
    view = SceneView([Visual(geometry)])
    _, seen, _ = draw(view, Camera(eye=(0.0, -4.0, 0.0), target=(0.0, 0.0, 0.0)))
    assert (seen == -1).all()

"""The bounds by which terrain contacts pass over what is far off refuse nothing that the exact tests accept."""

import numpy as np
import pytest

from avalanche_gym.physics.model import BOX, CAPSULE
from avalanche_gym.physics.narrow_phase.edge_crossings import crossing, may_cross
from avalanche_gym.physics.narrow_phase.height_field_facets import comes_over_facet, may_come_over_facet, over_facet
from avalanche_gym.physics.narrow_phase.height_field_grid import grid_of, sample, slopes
from avalanche_gym.physics.narrow_phase.pair_query import SCRATCH_ROWS
from avalanche_gym.physics.narrow_phase.terrain_features import TILT, put_edge
from avalanche_gym.physics.narrow_phase.terrain_shape import FIRST_FEATURE_ROW, put_shape
from tests.oracles.terrain_oracle import IDENTITY, ORIGIN, floats, height_field, rotation_matrix

# All sides of all edges of a box, and of the axis of a capsule.
ALL = {BOX: (1 << 12) - 1, CAPSULE: 15 << 8}


def test_facets_that_a_point_is_or_comes_over_are_within_the_bound():
    rng = np.random.default_rng(0)
    over = coming = refused = 0
    for roughness in (0.02, 0.3, 1.0):
        heights = roughness * rng.normal(size=(6, 7))
        field, pool = height_field(heights, (3.0, 2.0))
        grid = grid_of(field[0])
        rows, columns = heights.shape
        for _ in range(400):
            row, column = rng.integers(1, rows - 2), rng.integers(1, columns - 2)
            a = sample(grid, pool, columns, row, column)
            p = floats(np.array(a) + rng.uniform(-0.4, 0.9, 3) * (grid[2], grid[3], 1.0))
            motion = 10.0 ** rng.uniform(-4.0, 0.0)
            r = floats(np.subtract(p, a))
            for upper in range(2):
                steep = slopes(grid, pool, row * columns + column, columns, upper)
                is_over = over_facet(grid, r, *steep, upper)
                comes = comes_over_facet(grid, pool, rows, columns, p, row, column, upper, motion, 0.0)
                near = may_come_over_facet(grid, r, *steep, upper, motion)
                assert near or not (is_over or comes)
                over, coming, refused = over + is_over, coming + comes, refused + (not near)
    assert min(over, coming, refused) > 50  # of each kind there are some


def random_edge(rng):
    """Start, direction, length, both directions into the faces and the outward one of a convex edge; its middle."""
    e, n = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    aside = np.cross(n, e)
    leans = rng.choice([0.3 * TILT, TILT, 0.2, 1.2], size=2)
    left, right = (
        np.cos(lean) * n + side * np.sin(lean) * aside for lean, side in zip(leans, (1.0, -1.0), strict=True)
    )
    m1, m2 = np.cross(left, e), np.cross(e, right)
    if n @ m1 > 0.0:  # a concave one
        left, right = right, left
        m1, m2 = np.cross(left, e), np.cross(e, right)
    start = rng.uniform(-2.0, 2.0, 3)
    length = rng.uniform(0.05, 1.0)
    return start, e, length, m1, m2, np.cross(e, m1) - np.cross(e, m2), n


@pytest.mark.parametrize(("shape", "size"), [(BOX, (0.3, 0.2, 0.1)), (CAPSULE, (0.1, 0.25, 0.0))])
def test_edges_that_cross_are_within_the_bound(shape, size):
    rng = np.random.default_rng(1)
    accepted = passed_over = 0
    for _ in range(4000):
        start, e, length, m1, m2, out, n = random_edge(rng)
        if rng.integers(2):
            # A face lies almost flat on the edge.
            frame = np.column_stack([e, np.cross(n, e), n])
            frame = frame @ np.reshape(rotation_matrix(rng.uniform(-np.pi, np.pi) * np.array([0.0, 0.0, 1.0])), (3, 3))
            frame = np.reshape(rotation_matrix(0.7 * TILT * rng.normal(size=3)), (3, 3)) @ frame
        else:
            frame = np.reshape(rotation_matrix(rng.normal(size=3)), (3, 3))
        if shape == CAPSULE:
            frame = frame[:, [1, 2, 0]]
        middle = start + rng.uniform(-0.2, 1.2) * length * e
        height = np.abs(n @ frame) @ size if shape == BOX else size[0] + size[1] * abs(n @ frame[:, 2])
        position = middle + (height + rng.choice([-0.05, 0.0, 0.02])) * n + rng.uniform(-0.3, 0.3) * np.cross(n, e)
        tables = np.zeros((2, SCRATCH_ROWS, 8))
        counts = []
        for scratch, bounded in zip(tables, (False, True), strict=True):
            place = (floats(position), floats(frame.ravel()), size, ORIGIN, IDENTITY)
            put_shape(shape, *place, 0.03, scratch)
            edge = [floats(x) if np.ndim(x) else float(x) for x in (start, e, length, m1, m2, out)]
            put_edge(scratch, FIRST_FEATURE_ROW, *edge, 7)
            local, along = floats((start - position) @ frame), floats(e @ frame)
            crossed = may_cross(scratch, FIRST_FEATURE_ROW, local, along) if bounded else ALL[shape]
            passed_over += crossed == 0
            counts.append(crossing(scratch, FIRST_FEATURE_ROW, crossed, 0))
        assert counts[0] == counts[1]
        np.testing.assert_array_equal(tables[0, : counts[0]], tables[1, : counts[1]])
        accepted += counts[0] > 0
    assert accepted > 400
    assert passed_over > 400 or shape == CAPSULE

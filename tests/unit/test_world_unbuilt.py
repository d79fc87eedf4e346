"""What the engine cannot do yet is refused, or listed as left out; it is never taken for something else."""

import numpy as np
import pytest

from avalanche_gym import physics


def test_a_smooth_height_field_is_refused_rather_than_taken_for_facets():
    scene = physics.Scene()
    scene.add_body(physics.HeightField(np.zeros((3, 3)), (1.0, 1.0), surface="smooth"), motion="static")
    scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0.0, 0.0, 1.0))
    with pytest.raises(ValueError, match="'smooth'.*surface='facets'"):
        physics.World(scene)


def test_what_the_solver_ignores_is_not_called_modelled():
    scene = physics.Scene()
    rolls = physics.Material(rolling_friction=0.01, torsional_friction=0.01)
    scene.add_body(physics.Plane(), motion="static", material=rolls)
    scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0.0, 0.0, 1.0), material=rolls)
    assert {"rolling friction", "torsional friction"} <= set(physics.World(scene).features.left_out)

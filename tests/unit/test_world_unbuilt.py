"""What the engine cannot do yet is refused, or listed as left out; it is never taken for something else."""

from avalanche_gym import physics


def test_what_the_solver_ignores_is_not_called_modelled():
    scene = physics.Scene()
    rolls = physics.Material(rolling_friction=0.01, torsional_friction=0.01)
    scene.add_body(physics.Plane(), motion="static", material=rolls)
    scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0.0, 0.0, 1.0), material=rolls)
    assert {"rolling friction", "torsional friction"} <= set(physics.World(scene).features.left_out)

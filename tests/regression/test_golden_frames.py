"""Frames as they were when somebody last looked at them and found them good.

The pictures lie in ``golden_frames``. After a change that is meant, write them anew, look at them, and say why they
changed in the changelog:

    python tests/regression/test_golden_frames.py
"""

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from avalanche_gym.physics import shapes
from avalanche_gym.physics.shapes.icosphere import icosphere
from avalanche_gym.rendering import (
    AGENT,
    SNOW,
    SPACE,
    Camera,
    Geometry,
    Lines,
    Points,
    Renderer,
    SceneView,
    Visual,
    as_planet,
    as_terrain,
    geometry_of,
    goal_markers,
    palette_color,
    primitives,
)

FOLDER = Path(__file__).parent / "golden_frames"
WIDTH, HEIGHT = 192, 144
# Bytes by which a colour may differ, and the share of pixels that may differ by more: room for another processor's sine
# and cosine, which can move an edge by a pixel here and there, and for nothing that is seen.
TOLERANCE, EXCEPTIONS = 3, 0.005

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def turned(axis, angle):
    return (np.cos(0.5 * angle), *(np.sin(0.5 * angle) * np.array(axis) / np.linalg.norm(axis)))


def hills(count, extent, height):
    x = np.linspace(-0.5 * extent, 0.5 * extent, count)
    return height * (np.sin(0.9 * x)[:, None] * np.cos(0.7 * x)[None, :] + 0.3 * np.sin(2.3 * x + 1.0)[None, :])


def terrain():
    """Every shape on a meadow, a goal, a path and an arrow."""
    ground = shapes.HeightField(hills(48, 12.0, 0.8), (12.0, 12.0))
    bodies = [
        shapes.Sphere(0.5),
        shapes.Box((0.4, 0.5, 0.3)),
        shapes.Capsule(0.3, 0.4),
        shapes.Cylinder(0.4, 0.4),
        shapes.ConvexHull([(0, 0, 0.7), (0.6, 0, -0.3), (-0.4, 0.5, -0.3), (-0.4, -0.5, -0.3)]),
        shapes.Compound(
            [(shapes.Box((0.6, 0.15, 0.15)), (0, 0, 0), UPRIGHT), (shapes.Sphere(0.3), (0.6, 0, 0), UPRIGHT)]
        ),
    ]
    visuals = [Visual(geometry_of(ground), "#ffffff", static=True, gloss=0.0)]
    visuals += [Visual(geometry_of(shape), palette_color(k)) for k, shape in enumerate(bodies)]
    view = SceneView(visuals)
    places = [
        (0, 0, 0),
        (-2.5, -2, 1.2),
        (-0.5, -2.5, 1.5),
        (1.5, -2, 1.4),
        (-2, 0.5, 1.6),
        (0.5, 0.3, 1.5),
        (2.6, 0.8, 1.6),
    ]
    view.set_poses(places, [UPRIGHT, *(turned((1, 2, 3), 0.8 * k) for k in range(6))])
    path = [(-4.0 + 0.5 * k, -4.0 + 0.1 * k * k, 1.2) for k in range(6)]
    overlays = [
        *goal_markers((3.0, 3.5, 0.3), 0.8),
        Lines.path(path, width=1.5),
        Lines.arrows([(-2.5, -2, 1.2)], [(1, 1, 0.5)]),
    ]
    return Renderer(WIDTH, HEIGHT, supersample=2), view, Camera.orbit((0.0, 0.0, 0.3), 13.0, -65.0, 32.0), overlays


def planet():
    """A bumpy planet in the dark, a lander above it, seen by a camera that stands on its side."""
    points, faces = icosphere(4)
    bumps = (
        1.0 + 0.03 * np.sin(5.0 * points[:, 0] + 1.0) * np.cos(4.0 * points[:, 1]) + 0.02 * np.sin(9.0 * points[:, 2])
    )
    ground = as_planet(Geometry.smoothed(5.0 * points * bumps[:, None], faces))
    visuals = [Visual(ground, "#ffffff", static=True, gloss=0.0), Visual(primitives.cylinder(0.4, 0.3), AGENT)]
    view = SceneView(visuals)
    up = np.array([0.6, -0.5, 0.62])
    view.set_poses([(0, 0, 0), 6.4 * up], [UPRIGHT, turned((1, 1, 0), 0.5)])
    camera = Camera.follow(6.4 * up, (1.0, 0.5, 0.0), 6.0, 2.5, up=up, fov=60.0)
    return Renderer(WIDTH, HEIGHT, lighting=SPACE), view, camera, goal_markers(5.1 * up, 0.5, up=up)


def table():
    """Bodies on a table on an endless floor, some of them at rest and seen through, with their contact points."""
    shape = [shapes.Box((0.3, 0.3, 0.3)), shapes.Sphere(0.3), shapes.Cylinder(0.3, 0.3)]
    visuals = [
        Visual(geometry_of(shapes.Plane()), static=True),
        Visual(primitives.box((2.0, 1.5, 0.1)), "#8c6a4f", static=True),
    ]
    visuals += [Visual(geometry_of(shape[k % 3]), palette_color(k), opacity=0.45 if k % 2 else 1.0) for k in range(6)]
    view = SceneView(visuals)
    places = [(-1.4 + 0.55 * k, 0.6 * (-1.0) ** k, 1.4) for k in range(6)]
    view.set_poses([(0, 0, 0), (0, 0, 1.0), *places], [UPRIGHT] * 8)
    contacts = np.array(places) - (0.0, 0.0, 0.3)
    overlays = [
        Points(contacts, "#ff3030", 4.0, hidden_opacity=0.5),
        Lines.box((-2, -1.5, 0.9), (2, 1.5, 2.0), color="#ffffff", width=1.0),
    ]
    return Renderer(WIDTH, HEIGHT), view, Camera.orbit((0.0, 0.0, 1.0), 7.5, -30.0, 12.0), overlays


def carpet():
    """A sheet that waves, seen from within: its near end reaches behind the eye."""
    x = np.linspace(-8.0, 8.0, 48)
    cloth = primitives.height_field(np.zeros((48, 48)), (16.0, 16.0), cell=1.0, skirt=0.0).with_options(contrast=0.2)
    view = SceneView([Visual(cloth, "#b03a52"), Visual(primitives.sphere(0.6), AGENT)])
    view.set_heights(0, 0.6 * np.sin(0.8 * x)[None, :] * np.cos(0.5 * x)[:, None])
    view.set_poses([(0, 0, 0), (0.0, 0.0, 0.7)], [UPRIGHT, turned((1, 1, 1), 1.0)])
    return Renderer(WIDTH, HEIGHT), view, Camera.follow((0.0, 0.0, 0.7), (1.0, 0.4, 0.0), 5.0, 1.6, fov=60.0), []


def slope():
    """Rocks on snow, lit from behind, in a scene so large that the shadow map covers only what lies near."""
    x = np.linspace(-60.0, 60.0, 64)
    heights = 0.35 * (x[:, None] + 60.0) + np.sin(0.5 * x)[:, None] * np.cos(0.4 * x)[None, :]
    rock = geometry_of(
        shapes.ConvexHull([(0.9, 0.1, 0), (-0.7, 0.2, 0.1), (0, 0.8, 0.2), (0.1, -0.8, 0), (0, 0, 0.9), (0.1, 0, -0.6)])
    )
    visuals = [
        Visual(as_terrain(primitives.height_field(heights, (120.0, 120.0)), SNOW), "#ffffff", static=True, gloss=0.0)
    ]
    visuals += [Visual(rock, "#7b7f86") for _ in range(12)]
    view = SceneView(visuals)
    angles = 2.4 * np.arange(12)
    across, up = (2.0 + angles / 4.0) * np.cos(angles), (2.0 + angles / 4.0) * np.sin(angles)
    ground = 0.35 * (up + 60.0) + np.sin(0.5 * up) * np.cos(0.4 * across)
    view.set_poses(
        [(0, 0, 0), *np.stack([across, up, ground + 0.5], axis=1)], [UPRIGHT, *(turned((3, 1, 2), a) for a in angles)]
    )
    return Renderer(WIDTH, HEIGHT), view, Camera.orbit((0.0, 0.0, 21.0), 20.0, -80.0, 30.0), []


SCENES = {scene.__name__: scene for scene in (terrain, planet, table, carpet, slope)}


def frame_of(name):
    renderer, view, camera, overlays = SCENES[name]()
    return renderer.render(view, camera, overlays)


@pytest.mark.parametrize("name", SCENES)
def test_frame_is_as_it_was(name):
    golden = imageio.imread(FOLDER / f"{name}.png")
    difference = np.abs(frame_of(name).astype(int) - golden).max(axis=2)
    assert (difference > TOLERANCE).mean() <= EXCEPTIONS, f"{(difference > TOLERANCE).sum()} pixels of {name} changed"


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for scene_name in SCENES:
        imageio.imwrite(FOLDER / f"{scene_name}.png", frame_of(scene_name))

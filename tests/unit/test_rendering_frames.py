"""Colours, shadows, transparency and overlays of whole frames, against what they must be."""

import hashlib
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from avalanche_gym.rendering import (
    DAY,
    GOAL,
    SPACE,
    Camera,
    Geometry,
    Lighting,
    Lines,
    Marker,
    Points,
    Renderer,
    SceneView,
    Visual,
    as_terrain,
    goal_markers,
    palette_color,
    primitives,
    tile,
)
from avalanche_gym.rendering.color import linear_color, to_linear, to_srgb
from avalanche_gym.rendering.development import STEPS, response

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
PLAIN = Lighting(haze=float("inf"), glow=0.0)


def ground(half_extent=10.0, **options):
    e = half_extent
    corners = np.array([(-e, -e, 0.0), (e, -e, 0.0), (e, e, 0.0), (-e, e, 0.0)])
    return Geometry.smoothed(corners, [(0, 1, 2), (0, 2, 3)], **options)


def sample_view():
    x = np.linspace(-4.0, 4.0, 24)
    heights = 0.4 * np.sin(x)[:, None] * np.cos(0.8 * x)[None, :]
    visuals = [
        Visual(as_terrain(primitives.height_field(heights, (8.0, 8.0))), "#ffffff", static=True, gloss=0.0),
        Visual(primitives.sphere(0.5), palette_color(0)),
        Visual(primitives.box((0.3, 0.5, 0.4)), palette_color(1)),
        Visual(primitives.capsule(0.3, 0.4), palette_color(2), opacity=0.5),
        Visual(primitives.cylinder(0.4, 0.3), palette_color(3)),
    ]
    view = SceneView(visuals)
    places = [(0.0, 0.0, 0.0), (1.0, 1.0, 0.9), (-1.2, 0.5, 0.9), (0.4, -1.4, 1.0), (-1.0, -1.6, 0.9)]
    half = np.sqrt(0.5)
    turns = [UPRIGHT, UPRIGHT, (half, half, 0.0, 0.0), (half, 0.0, half, 0.0), (0.5, 0.5, 0.5, 0.5)]
    view.set_poses(places, turns)
    return view


def sample_frame(renderer=None):
    renderer = renderer or Renderer(96, 72)
    overlays = [
        *goal_markers((2.0, -1.0, 0.0), 0.6),
        Lines.arrows([(0.0, 0.0, 1.0)], [(1.0, 0.0, 0.5)], width=2.0),
        Points([(1.0, 1.0, 1.5)], color="#ff0000"),
    ]
    return renderer.render(sample_view(), Camera.orbit((0.0, 0.0, 0.3), 9.0, -50.0, 30.0), overlays)


# --- Colours ----------------------------------------------------------------------------------------------------------


def test_srgb_round_trip():
    values = np.linspace(0.0, 1.0, 256)
    np.testing.assert_allclose(to_srgb(to_linear(values)), values, atol=1e-12)


def test_every_byte_that_is_not_near_white_survives():
    """Below the shoulder the picture shows exactly the colour that light and surface give."""
    curve = response()
    assert (np.diff(curve.astype(int)) >= 0).all()
    bytes_below = np.arange(0, 230)
    steps = np.round(to_linear(bytes_below / 255.0) * STEPS).astype(int)
    assert np.abs(curve[steps].astype(int) - bytes_below).max() <= 1


@pytest.mark.parametrize("color", ["#12345", "blue", (0.1, 0.2), (0.0, 0.0, 1.5), (0.0, 0.0, float("nan"))])
def test_wrong_colors_are_refused(color):
    with pytest.raises(ValueError, match="#rrggbb"):
        linear_color(color)


def test_level_ground_in_the_sun_has_the_colour_of_the_formula():
    view = SceneView([Visual(ground(), "#808080", gloss=0.0)])
    frame = Renderer(9, 9, lighting=PLAIN).render(view, Camera.orbit((0.0, 0.0, 0.0), 5.0, 0.0, 60.0))
    sun = np.array(PLAIN.sun) / np.linalg.norm(PLAIN.sun)
    light = np.array(linear_color(PLAIN.above)) * PLAIN.ambient_strength
    light = light + sun[2] * PLAIN.sun_strength * np.array(linear_color(PLAIN.sun_color))
    expected = 255.0 * to_srgb(light * np.array(linear_color("#808080")))
    assert np.abs(frame.astype(float) - expected).max() <= 1.0


def test_what_is_unlit_keeps_its_colour():
    view = SceneView([Visual(ground(), "#335577", lit=False)])
    frame = Renderer(5, 5, lighting=PLAIN).render(view, Camera.orbit((0.0, 0.0, 0.0), 5.0, 0.0, 60.0))
    assert np.abs(frame.astype(int) - np.array([0x33, 0x55, 0x77])).max() <= 1


def test_far_surfaces_fade_into_the_horizon():
    view = SceneView([Visual(ground(1e4), "#202020", lit=False)])
    renderer = Renderer(8, 64, lighting=Lighting(haze=5e-4, glow=0.0))
    frame = renderer.render(view, Camera(eye=(0.0, 0.0, 2.0), target=(0.0, 10.0, 1.9)))
    horizon = 255.0 * np.array([int(DAY.horizon[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    column = np.abs(frame[32:, 4].astype(float) - horizon).max(axis=1)
    assert column[2] < 8.0 < column[-1]
    assert (np.diff(column[1:]) >= -1.0).all()


# --- Shadows ----------------------------------------------------------------------------------------------------------


def test_the_shadow_lies_where_the_sun_puts_it():
    sun = np.array([0.6, 0.0, 0.8])
    lighting = Lighting(sun=tuple(sun), haze=float("inf"))
    visuals = [Visual(ground(4.0), "#a0a0a0", static=True, gloss=0.0), Visual(primitives.box((0.5, 0.5, 0.05)))]
    view = SceneView(visuals)
    height = 2.0
    view.set_poses([(0.0, 0.0, 0.0), (1.2, 0.0, height)], [UPRIGHT, UPRIGHT])
    # Straight from above: x runs to the right.
    camera = Camera(eye=(0.0, 0.0, 50.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fov=9.2)
    frame = Renderer(161, 161, lighting=lighting).render(view, camera).astype(int)
    metres = 100.0 * np.tan(np.radians(4.6)) / 161
    places = (np.arange(161) - 80) * metres
    row = frame[80, :, 0]
    shift = height * sun[0] / sun[2]
    middle = np.abs(places - (1.2 - shift))
    dark, light = row[middle < 0.4], row[(middle > 0.6) & (places < 0.5)]
    assert dark.max() < light.min() - 40
    np.testing.assert_array_equal(light, light[0])


@pytest.mark.parametrize("elevation", [8.0, 25.0, 60.0, 85.0])
def test_lit_surfaces_do_not_shade_themselves(elevation):
    """Without a margin that follows the slope, stripes appear on ground that the sun only grazes."""
    azimuth = 0.7
    e = np.radians(elevation)
    sun = (np.cos(e) * np.cos(azimuth), np.cos(e) * np.sin(azimuth), np.sin(e))
    lighting = Lighting(sun=sun, haze=float("inf"), glow=0.0)
    view = SceneView([Visual(ground(6.0), "#a0a0a0", static=True, gloss=0.0)])
    camera = Camera.orbit((0.0, 0.0, 0.0), 8.0, 20.0, 50.0)
    with_shadows = Renderer(80, 60, lighting=lighting).render(view, camera)
    without = Renderer(80, 60, lighting=lighting, shadows=False).render(view, camera)
    np.testing.assert_array_equal(with_shadows, without)


def test_a_body_on_the_ground_has_a_shadow_that_touches_it():
    lighting = Lighting(sun=(1.0, 0.0, 1.0), haze=float("inf"))
    view = SceneView([Visual(ground(4.0), "#a0a0a0", static=True), Visual(primitives.box((0.5, 0.5, 0.5)))])
    view.set_poses([(0.0, 0.0, 0.0), (0.0, 0.0, 0.5)], [UPRIGHT, UPRIGHT])
    camera = Camera(eye=(-8.0, 0.0, 6.0), target=(-0.5, 0.0, 0.0), fov=14.0)
    frame = Renderer(121, 121, lighting=lighting).render(view, camera).astype(int)
    # Ground just beside the box on its dark side, and ground beyond the tip of the shadow.
    beside, beyond = frame[62, 60, 1], frame[-2, 60, 1]
    assert beside < beyond - 40


def test_static_shadows_follow_what_static_things_do():
    """The map of static shadows is kept between frames; every change must reach it."""
    visuals = [Visual(ground(4.0), static=True), Visual(primitives.box((0.5, 0.5, 0.5)), static=True)]
    camera = Camera.orbit((0.0, 0.0, 0.0), 9.0, 30.0, 40.0)
    renderer, view = Renderer(64, 48), SceneView(visuals)
    for step in range(3):
        poses = [(0.0, 0.0, 0.0), (0.8 * step - 1.0, 0.0, 1.0)], [UPRIGHT, UPRIGHT]
        view.set_poses(*poses)
        fresh = SceneView(visuals)
        fresh.set_poses(*poses)
        fresh.center, fresh.size = view.center, view.size
        np.testing.assert_array_equal(renderer.render(view, camera), Renderer(64, 48).render(fresh, camera))
    view.set_visible(False, 1)
    hidden = renderer.render(view, camera)
    assert (hidden != renderer.render(SceneView(visuals), camera)).any()


# --- Transparency and overlays ----------------------------------------------------------------------------------------


def test_a_translucent_body_is_the_mean_of_itself_and_what_lies_behind():
    camera = Camera.orbit((0.0, 0.0, 0.5), 5.0, 0.0, 20.0)
    frames = []
    for opacity in (0.0, 0.4, 1.0):
        visuals = [Visual(ground(), "#404040", casts_shadow=False), Visual(primitives.sphere(0.8), "#b04020")]
        view = SceneView(visuals)
        view.set_poses([(0.0, 0.0, 0.0), (0.0, 0.0, 0.8)], [UPRIGHT, UPRIGHT])
        view.set_opacity(opacity, 1)
        frames.append(to_linear(Renderer(64, 48, shadows=False).render(view, camera) / 255.0))
    # Away from white, where light is compressed.
    dull = frames[2].max(axis=2) < 0.7
    expected = 0.6 * frames[0] + 0.4 * frames[2]
    assert np.abs(frames[1] - expected)[dull].max() < 0.006


def test_the_nearer_of_two_translucent_bodies_comes_on_top():
    boxes = [Visual(primitives.box((0.5, 0.5, 0.5)), color, opacity=0.5, lit=False) for color in ("#ff0000", "#0000ff")]
    view = SceneView(boxes)
    camera = Camera(eye=(10.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), fov=5.0)
    renderer = Renderer(9, 9, lighting=PLAIN)
    for red, blue in ((1.0, -1.0), (-1.0, 1.0)):
        view.set_poses([(red, 0.0, 0.0), (blue, 0.0, 0.0)], [UPRIGHT, UPRIGHT])
        middle = renderer.render(view, camera)[4, 4].astype(int)
        assert (middle[0] > middle[2]) == (red > blue)


def test_lines_hide_behind_surfaces_unless_told_otherwise():
    view = SceneView([Visual(primitives.box((1.0, 1.0, 1.0)), "#000000", lit=False)])
    camera = Camera(eye=(10.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), fov=30.0)
    renderer = Renderer(41, 41, lighting=PLAIN)
    bare = renderer.render(view, camera)
    for place, hidden_opacity, is_seen in ((-2.0, 0.0, False), (-2.0, 1.0, True), (2.0, 0.0, True)):
        line = Lines([[(place, -0.5, 0.0), (place, 0.5, 0.0)]], "#ff00ff", 3.0, hidden_opacity=hidden_opacity)
        frame = renderer.render(view, camera, [line])
        assert (np.abs(frame[20, 20].astype(int) - [255, 0, 255]) < 8).all() == is_seen
        assert (frame != bare).any() == is_seen


def test_a_line_through_the_eye_plane_is_cut_and_not_turned_round():
    view = SceneView([])
    camera = Camera(eye=(0.0, 0.0, 0.0), target=(0.0, 1.0, 0.0), fov=60.0)
    renderer = Renderer(41, 41, lighting=PLAIN)
    line = Lines([[(0.3, -5.0, -0.4), (0.3, 5.0, -0.4)]], "#ff0000")
    changed = (renderer.render(view, camera, [line]) != renderer.render(view, camera)).any(axis=2)
    rows, columns = np.nonzero(changed)
    # Below and to the right of the point it runs to.
    assert rows.min() >= 20
    assert columns.min() >= 19
    assert rows.max() == 40


def test_points_are_round_and_as_large_as_told():
    frame = Renderer(41, 41, lighting=PLAIN).render(
        SceneView([]), Camera(eye=(4.0, 0.0, 0.0), target=(0.0, 0.0, 0.0)), [Points([(0.0, 0.0, 0.0)], "#ff0000", 11.0)]
    )
    red = (frame[:, :, 0] > 245) & (frame[:, :, 2] < 5)
    j, i = np.nonzero(red)
    assert np.hypot(i - 20, j - 20).max() <= 5.5
    assert red.sum() == pytest.approx(np.pi * 5.0**2, rel=0.15)


def test_markers_are_seen_through():
    view = SceneView([Visual(ground(), "#404040")])
    camera = Camera.orbit((0.0, 0.0, 0.0), 6.0, 0.0, 40.0)
    renderer = Renderer(64, 48)
    bare = renderer.render(view, camera)
    marked = renderer.render(view, camera, [Marker(primitives.disc(1.0), (0.0, 0.0, 0.01), color=GOAL, opacity=0.5)])
    change = (marked.astype(int) - bare)[24, 32]
    assert change[1] > 30
    assert change[2] > change[0]
    assert (marked[0] == bare[0]).all()


# --- Poses, heights, sizes --------------------------------------------------------------------------------------------


def test_removed_bodies_are_not_drawn():
    view = sample_view()
    camera = Camera.orbit((0.0, 0.0, 0.3), 9.0, -50.0, 30.0)
    positions, orientations = view.instances["position"].copy(), view.instances["orientation"].copy()
    positions[1] = np.nan
    view.set_poses(positions, orientations)
    gone = Renderer(64, 48).render(view, camera)
    hidden = sample_view()
    hidden.set_visible(False, 1)
    np.testing.assert_array_equal(gone, Renderer(64, 48).render(hidden, camera))


@pytest.mark.parametrize("skirt", [None, 0.0])
def test_changed_heights_look_like_a_new_height_field(skirt):
    generator = np.random.default_rng(1)
    first, second = generator.uniform(-0.4, 0.4, (2, 9, 7))
    second = np.maximum(second, first.min())
    camera = Camera.orbit((0.0, 0.0, 0.0), 9.0, 30.0, 35.0)
    first_geometry, second_geometry = (primitives.height_field(z, (6.0, 4.0), skirt=skirt) for z in (first, second))
    changed = SceneView([Visual(first_geometry)])
    renderer = Renderer(64, 48)
    renderer.render(changed, camera)
    changed.set_heights(0, second)
    fresh = SceneView([Visual(second_geometry)])
    changed.center, changed.size = fresh.center, fresh.size
    if skirt is None:
        # Sides keep their lower edge, so that it does not move with the ground.
        fresh.vertices["position"][63:, 2] = changed.vertices["position"][63:, 2]
        fresh.instances["center"], fresh.instances["radius"] = changed.instances["center"], changed.instances["radius"]
    np.testing.assert_array_equal(renderer.render(changed, camera), Renderer(64, 48).render(fresh, camera))
    with pytest.raises(ValueError, match="same shape"):
        changed.set_heights(0, first[:3])


def test_wrong_poses_are_refused():
    with pytest.raises(ValueError, match=r"positions of shape \(9, 3\)"):
        sample_view().set_poses(np.zeros((9, 3)), np.zeros((9, 4)))


@pytest.mark.parametrize(("width", "height", "supersample"), [(0, 8, 1), (8, 8, 0), (8000, 8, 2), (8.5, 8, 1)])
def test_wrong_sizes_are_refused(width, height, supersample):
    with pytest.raises(ValueError, match="8192"):
        Renderer(width, height, supersample)


def test_supersampling_averages_a_larger_frame():
    view, camera = sample_view(), Camera.orbit((0.0, 0.0, 0.3), 9.0, -50.0, 30.0)
    large = to_linear(Renderer(192, 144).render(view, camera) / 255.0)
    blocks = large.reshape(72, 2, 96, 2, 3)
    dull = blocks.max(axis=(1, 3, 4)) < 0.8
    smooth = to_linear(Renderer(96, 72, supersample=2).render(view, camera) / 255.0)
    assert dull.mean() > 0.9
    assert np.abs(smooth - blocks.mean(axis=(1, 3)))[dull].max() < 0.01


def test_a_scene_in_millimetres_looks_like_one_in_metres():
    frames = []
    for scale in (1e-3, 1.0, 1e6):
        visuals = [
            Visual(ground(2.0 * scale), static=True),
            Visual(primitives.box((0.3 * scale, 0.3 * scale, 0.3 * scale)), position=(0.0, 0.0, 0.5 * scale)),
        ]
        camera = Camera.orbit((0.0, 0.0, 0.3 * scale), 5.0 * scale, 30.0, 30.0)
        frames.append(Renderer(64, 48).render(SceneView(visuals), camera).astype(int))
    for frame in (frames[0], frames[2]):
        assert (np.abs(frame - frames[1]).max(axis=2) > 2).mean() < 0.002


def test_an_empty_view_shows_the_sky():
    for lighting in (DAY, SPACE):
        frame = Renderer(64, 48, lighting=lighting).render(SceneView([]), Camera.orbit((0.0, 0.0, 0.0), 1.0, 0.0, 0.0))
        assert frame.std() > 0.5


# --- The same bytes everywhere ----------------------------------------------------------------------------------------


def test_frames_do_not_depend_on_what_was_drawn_before():
    used = Renderer(96, 72)
    for azimuth in (0.0, 77.0, 200.0):
        used.render(sample_view(), Camera.orbit((0.0, 0.0, 0.3), 4.0, azimuth, 50.0), goal_markers((0, 0, 0), 1.0))
    np.testing.assert_array_equal(sample_frame(used), sample_frame())


def test_threads_draw_the_same_bytes():
    expected = sample_frame()
    with ThreadPoolExecutor(4) as pool:
        for frame in pool.map(lambda _: sample_frame(), range(8)):
            np.testing.assert_array_equal(frame, expected)


def test_processes_draw_the_same_bytes():
    program = (
        f"import sys; sys.path.insert(0, {str(__file__).rsplit('/', 1)[0]!r})\n"
        "import hashlib, test_rendering_frames as t\n"
        "print(hashlib.sha256(t.sample_frame().tobytes()).hexdigest())"
    )
    hashes = {
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    }
    hashes.add(hashlib.sha256(sample_frame().tobytes()).hexdigest() + "\n")
    assert len(hashes) == 1


# --- Tiles ------------------------------------------------------------------------------------------------------------


def test_tiles_keep_each_frame_in_its_place():
    frames = [np.full((4, 6, 3), 10 * (k + 1), np.uint8) for k in range(5)]
    picture = tile(frames, gap=1)
    assert picture.shape == (2 * 5 - 1, 3 * 7 - 1, 3)
    for k, frame in enumerate(frames):
        row, column = divmod(k, 3)
        np.testing.assert_array_equal(picture[5 * row : 5 * row + 4, 7 * column : 7 * column + 6], frame)
    assert tile(frames[:1]).shape == (4, 6, 3)
    assert tile(frames, columns=5, gap=0).shape == (4, 30, 3)


def test_frames_that_do_not_fit_together_are_refused():
    with pytest.raises(ValueError, match="at least one"):
        tile([])
    with pytest.raises(ValueError, match="same size"):
        tile([np.zeros((2, 2, 3), np.uint8), np.zeros((3, 2, 3), np.uint8)])

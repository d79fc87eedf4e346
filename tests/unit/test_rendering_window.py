"""The window shows exactly the frame, closes, and says what is missing."""

import subprocess
import sys

import numpy as np
import pygame
import pytest

from avalanche_gym.rendering import Window


@pytest.fixture
def dummy_display(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    pygame.display.quit()


def random_frame(height=24, width=32, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


def shown():
    return pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)


@pytest.mark.usefixtures("dummy_display")
def test_its_pixels_are_the_frame():
    with Window("test") as window:
        assert not window.is_open
        for frame in (random_frame(), random_frame(seed=1), random_frame(48, 40)):
            assert window.show(frame)
            assert window.is_open
            np.testing.assert_array_equal(shown(), frame)
        assert pygame.display.get_caption()[0] == "test"
    assert not window.is_open


@pytest.mark.usefixtures("dummy_display")
@pytest.mark.parametrize("event", [{"type": pygame.QUIT}, {"type": pygame.KEYDOWN, "key": pygame.K_ESCAPE}])
def test_the_user_can_close_it(event):
    window = Window()
    window.show(random_frame())
    pygame.event.post(pygame.event.Event(event.pop("type"), event))
    assert not window.show(random_frame())
    assert not window.is_open
    assert not pygame.display.get_init()
    # Frames that come later are ignored, and it does not open again.
    assert not window.show(random_frame())
    window.close()
    window.close()


@pytest.mark.usefixtures("dummy_display")
def test_it_keeps_to_the_rate():
    import time

    with Window(fps=50.0) as window:
        window.show(random_frame())
        start = time.perf_counter()
        for _ in range(5):
            window.show(random_frame())
        assert time.perf_counter() - start > 0.08


def test_a_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(ImportError, match=r"avalanche-gym\[render\]"):
        Window()


def test_a_missing_display_is_named():
    program = (
        "import os\n"
        "for name in ('SDL_VIDEODRIVER', 'DISPLAY', 'WAYLAND_DISPLAY'): os.environ.pop(name, None)\n"
        "import numpy as np\n"
        "from avalanche_gym.rendering import Window\n"
        "try: Window().show(np.zeros((4, 4, 3), np.uint8))\n"
        "except RuntimeError as error: print(error)\n"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "SDL_VIDEODRIVER=dummy" in result.stdout
    assert "rgb_array" in result.stdout

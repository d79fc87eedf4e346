"""Settings that every test shares."""

import os

from hypothesis import settings

# Windows are drawn into memory: tests run without a display.
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
# The tests run in several processes; a second thread in each would only wait for the first.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The first example of a test may compile kernels, which no deadline allows for; the same examples in every run, so that
# a failure is the fault of the change that shows it.
settings.register_profile("suite", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("suite")

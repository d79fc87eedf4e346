"""The hard cases run through the engine: what holds today must hold tomorrow, at errors that the truth allows."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES
from avalanche_gym.physics.scenes.recording import record

# Cases whose scenes compile nothing that other tests do not, and what they survive at the default step.
SURVIVED = (
    "throw", "rotation_dzhanibekov", "bounce_e08", "slide", "stick_critical", "slip_critical", "slide_to_roll",
    "rolling_load_oblique", "flat_drop", "table", "crossed_beams", "bullet_wall", "far_1e6", "units_large",
    "dirty_needle", "impulse_1e12", "grain_and_boulder", "internal_edges_box", "swing_sticks",
)  # fmt: skip


def run(name, **options):
    case = HARD_CASES[name]
    recording, others, report = record(case, physics.Options(**options))
    return case, recording, case.errors(recording, *others), report


@pytest.mark.parametrize("name", SURVIVED)
def test_a_hard_case_is_survived_with_the_default_options(name):
    case, _, errors, _ = run(name)
    assert errors[case.error] <= case.passes_at


def test_a_recording_holds_the_start_and_the_end():
    case, recording, _, report = run("slide", time_step=1 / 60)
    assert recording.time[0] == 0.0
    assert recording.time[-1] == pytest.approx(case.duration)
    assert len(recording.time) == round(case.duration / case.sampling) + 1
    assert report.steps[0] == round(case.duration * 60)
    # Contact forces of the last step bear the weight.
    np.testing.assert_allclose(recording.contact_force[1], [0, 0, 3.0 * 9.81], atol=1e-6)
    np.testing.assert_allclose(recording.contact_force.sum(axis=0), 0.0, atol=1e-12)

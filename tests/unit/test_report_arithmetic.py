"""Orders, fronts, thresholds, profiles and the table of the report of speed against error."""

import math

import numpy as np
import pytest

from avalanche_gym.physics.scenes import HARD_CASES
from benchmarks.csv_rows import read_rows, write_rows
from benchmarks.report.analysis import cost_to_reach, error_split, fitted_order, pareto_front, performance_profile
from benchmarks.report.standing import standing
from benchmarks.report.table import FAILED, OK, Row, append, read
from benchmarks.residuals import Residuals


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_an_order_is_found_above_round_off(order):
    steps = [1 / 30, 1 / 60, 1 / 120, 1 / 240, 1 / 1e6]
    errors = [3e-3 * h**order for h in steps[:-1]] + [1e-16]
    assert fitted_order(steps, errors) == pytest.approx(order, abs=1e-9)


def test_an_order_needs_three_errors_that_say_something():
    assert math.isnan(fitted_order([0.1, 0.05, 0.025], [1e-3, 1e-14, 0.0]))
    assert math.isnan(fitted_order([0.1, 0.05, 0.025], [math.inf, 1e-3, 1e-4]))


def test_the_front_holds_what_nothing_beats():
    points = [(1.0, 1e-2), (2.0, 1e-3), (2.5, 5e-3), (3.0, 1e-3), (4.0, 1e-6), (5.0, math.inf)]
    assert pareto_front(points) == [(1.0, 1e-2), (2.0, 1e-3), (4.0, 1e-6)]


def test_a_coarse_step_that_is_right_by_luck_does_not_count():
    points = [(1.0, 1e-9), (2.0, 1e-2), (4.0, 1e-4), (8.0, 1e-5)]
    assert cost_to_reach(points, 1e-3) == 4.0
    assert cost_to_reach(points, 1e-1) == 1.0
    assert math.isinf(cost_to_reach(points, 1e-6))


def test_profile_of_dolan_and_more():
    costs = {"a": [1.0, 2.0, math.inf, math.inf], "b": [2.0, 1.0, 3.0, math.inf]}
    shares = performance_profile(costs, [1.0, 2.0])
    # The fourth problem is solved by nobody and left out.
    assert shares["a"] == pytest.approx([1 / 3, 2 / 3])
    assert shares["b"] == pytest.approx([2 / 3, 1.0])


def test_parts_of_an_error():
    parts = error_split(1.0e-3, 0.9e-3, 0.1e-3)
    assert parts["solver"] == pytest.approx(1e-4)
    assert parts["time stepping"] == pytest.approx(8e-4)
    assert parts["remains"] == pytest.approx(1e-4)


def test_rows_survive_the_file_and_later_ones_replace_earlier(tmp_path):
    path = tmp_path / "data.csv"
    row = Row(
        "slide", "avalanche", "0", 240, "", "ok", 3.8e-6, 2.5, 2.4, 2.6, 100, 3, 1e-13, {"path": 4e-6}, 'a "b", c'
    )
    append(path, Row("slide", "avalanche", "0", 240, "", FAILED))
    append(path, row)
    found = read(path)
    assert list(found.values()) == [row]
    assert row.cost == pytest.approx(2.5e-6 * 240)


def test_verdicts():
    from benchmarks.report.markdown import number, verdict

    case = HARD_CASES["slide"]
    good = Row("slide", "x", "", 240, "", "ok", error=case.passes_at)
    assert verdict(case, good).startswith("pass")
    assert "fail" in verdict(case, Row("slide", "x", "", 240, "", "ok", error=math.inf))
    assert verdict(case, None) == "not run"
    assert verdict(HARD_CASES["input_zero_mass"], Row("", "", "", 240, "", "refused")) == "pass (refused)"
    assert "fail" in verdict(HARD_CASES["input_zero_mass"], Row("", "", "", 240, "", "ok", error=0.0))
    assert number(math.nan) == "-"
    assert number(0.0) == "0"
    assert number(1.234e-5) == "1.2e-05"


def test_a_rotated_attitude_is_that_far_away():
    from avalanche_gym.physics.scenes.case import about, angle_between

    for angle in (1e-12, 1e-3, 3.0):
        first, second = np.array(about((0, 0, 1), 0.3)), np.array(about((0, 0, 1), 0.3 + angle))
        assert angle_between(first, -second) == pytest.approx(angle, rel=1e-3)


def test_the_gate_names_what_got_worse():
    from benchmarks.gate import Measured, complaints

    case = HARD_CASES["slide"]
    before = Measured({"60": 3.6e-5, "120": 1e-5, "240": 3e-6}, 2.0, True, 100.0)
    same = Measured({"60": 4e-5, "120": 1e-5, "240": 3e-6}, 1.9, True, 110.0)
    assert complaints(case, same, before, True) == []
    worse = Measured({"60": 3.6e-5, "120": 3e-5, "240": 3e-3}, 1.0, False, 120.0)
    found = complaints(case, worse, before, True)
    assert [text.split()[0] for text in found] == ["no", "error", "error", "order", "a"]
    assert len(complaints(case, worse, before, False)) == 4
    # Round-off may do what it likes.
    tiny = Measured({"60": 1e-15, "120": 1e-15, "240": 1e-15}, math.nan, True, 100.0)
    assert complaints(case, Measured({"60": 9e-13, "120": 1e-12, "240": 0.0}, math.nan, True, 90.0), tiny, True) == []


def test_an_adapter_records_what_the_world_does():
    """Ours goes the way of the peers: built, stepped, read and timed through the same interface."""
    from avalanche_gym import physics
    from avalanche_gym.physics.scenes.recording import record as directly
    from benchmarks.peers import our_engine
    from benchmarks.peers.recording import record, time_steps

    case = HARD_CASES["swing_sticks"]
    errors, report, whole = record(case, our_engine(), 1 / 60)
    recording, others, expected = directly(case, physics.Options(time_step=1 / 60))
    assert errors == case.errors(recording, *others)
    assert report["residual"] == expected.residual[0]
    assert whole.steps == round(case.duration * 60) and whole.seconds[0] > 0.0
    cost = time_steps(case, our_engine(1e-6), 1 / 60, 0.1, 2)
    median, low, high = cost.per_step()
    assert cost.steps <= round(case.duration * 60) and len(cost.seconds) == 2
    assert low <= median <= high
    again = time_steps(case, our_engine(), 1 / 60, 1e-4, 2, steps=7)
    assert again.steps == 7


def row_of(engine, rate, error, cost):
    return Row("slide", engine, "", rate, "", OK, error=error, us_per_step=cost / rate * 1e6)


def test_standing_compares_at_equal_cost_and_at_equal_error():
    ours = [row_of("ours", 60, 1e-3, 1.0), row_of("ours", 240, 1e-5, 4.0)]
    peer = [row_of("peer", 60, 1e-2, 2.0), row_of("peer", 240, 1e-4, 8.0), row_of("peer", 960, 1e-6, 32.0)]
    found = standing(ours, {"peer": peer}, 240)
    assert found.rival.rate == 60 and found.affordable
    assert found.error_ratio == pytest.approx(1e3) and found.cost_ratio == pytest.approx(8.0)
    assert found.better and not found.cheaper
    exact = standing([row_of("ours", 240, 1e-15, 4.0)], {"peer": [row_of("peer", 240, 1e-14, 3.0)]}, 240)
    assert exact.error_ratio == 1.0 and exact.better and exact.cost_ratio == pytest.approx(0.75)


def test_rows_of_a_file_come_back(tmp_path):
    rows = [Residuals("stack", 240, True, steps=3, worst=1e-13), Residuals("slide", 60, False, note="a, b")]
    write_rows(tmp_path / "rows.csv", rows)
    assert read_rows(Residuals, tmp_path / "rows.csv") == rows
    assert read_rows(Residuals, tmp_path / "none.csv") == []

"""One scenario, every planner, one table: in Python and on the command line."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from knotwork.curves.interpolation import PLANNER_SPECS, PLANNERS
from knotwork.errors import InputError
from knotwork.planning.comparison import Comparison, Refusal, best, compare
from plans import planned
from seams import ON, task
from shipped import SCENARIO_FILES
from sweeps import mostly_exhaustive


@pytest.fixture(scope="module")
def paper() -> Comparison:
    return compare("paper_case")


@pytest.mark.parametrize("name", mostly_exhaustive(SCENARIO_FILES, "planar2_closed_form"))
def test_every_planner_has_row_on_every_scenario(name: str) -> None:
    comparison = compare(name)
    rows = [row.planner for row in comparison.rows]
    assert [row for row in rows if ":" not in row] == list(PLANNERS)
    refused = [row for row in comparison.rows if isinstance(row, Refusal)]
    assert not refused
    assert list(comparison.trajectories) == rows


def test_rows_show_guarantees_of_planners(paper: Comparison) -> None:
    for row in paper.scores:
        record = PLANNER_SPECS[row.planner.split(":")[0]]
        meets = record.guarantees
        assert (row.acceleration_jump < 1e-9) == (record.continuity >= 2)
        assert (row.position_miss < 1e-9) == (
            "positions at all" in meets or ("positions" in meets and "all waypoints" in meets)
        )
        assert (row.velocity_miss < 1e-9) == (
            "velocities" in meets
            and "all waypoints" in meets
            and "velocities at both" not in meets
            and "velocities and accelerations at both" not in meets
        )


def test_best_is_least_with_ties_by_rounding(paper: Comparison) -> None:
    winners = best(paper.scores)
    assert "failed" not in winners  # which all that pass would win
    passing = [row for row in paper.scores if row.passed]
    least = min(row.squared_acceleration for row in passing)
    assert winners["squared_acceleration"] == {
        row.planner for row in passing if row.squared_acceleration <= 1.01 * least
    }
    assert {"modified-hermite", "septic", "quintic"} <= winners["velocity_miss"]
    assert not {"bspline", "trapezoidal"} & winners["velocity_miss"]


def test_refusing_planner_keeps_row_with_reason() -> None:
    scenario = {
        "waypoints": [
            {"joints": {"j": 0.0}},
            {"joints": {"j": 1.0}, "velocity": {"j": 0.5}, "after": 1},
            {"joints": {"j": 0.0}, "after": 1},
        ]
    }
    comparison = compare(scenario)
    (refused,) = (row for row in comparison.rows if isinstance(row, Refusal))
    assert refused.planner == "3-5-3"
    assert "three" in refused.reason or "3" in refused.reason
    assert "3-5-3" not in comparison.trajectories
    json.dumps(comparison.to_dict(), allow_nan=False)


def test_rule_after_colon_has_own_row() -> None:
    names = ["modified-hermite:paper", "modified-hermite:balanced", "quintic", "quintic:estimated"]
    rows = {row.planner: row for row in compare("ur5_deburring", names).scores}
    assert list(rows) == names
    balanced = kw.plan("ur5_deburring", planner="modified-hermite:balanced").trajectory
    assert rows["modified-hermite:balanced"].peak_acceleration.value == pytest.approx(
        balanced.extrema(2).peak.max(), rel=1e-12
    )
    assert rows["quintic:estimated"].squared_jerk != rows["quintic"].squared_jerk


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (["quintik"], "did you mean 'quintic'"),
        ([], "no planner is given.*modified-hermite"),
    ],
)
def test_refuses_unknown_planners_first(names: list[str], says: str) -> None:
    with pytest.raises(InputError, match=says):
        compare("no matter", names)


def test_counts_all_failed_requirements(paper: Comparison) -> None:
    for row in paper.scores:
        plan = kw.plan("paper_case", planner=row.planner)
        assert (row.required - row.failed, row.required) == plan.report.counts
        assert row.passed == plan.report.ok


def test_uses_joint_waypoints_of_collision_free_plan() -> None:
    plan = kw.plan("ur5_valve")
    assert plan.report.select(quantity="sequences_tried")
    comparison = compare("ur5_valve", ["modified-hermite"])
    (row,) = comparison.scores
    assert (row.required - row.failed, row.required) == plan.report.counts
    assert row.passed
    polynomial = comparison.trajectories["modified-hermite"].polynomial
    np.testing.assert_array_equal(polynomial.c, plan.trajectory.polynomial.c)


def test_exit_code_tells_whether_any_planner_passes(knotwork: Command, tmp_path: Path) -> None:
    assert knotwork("compare", "paper_case", "--planners", "cubic,septic").code == 0
    assert knotwork("compare", "paper_case", "--planners", "cubic,bspline").code == 1
    ran = knotwork("compare", "paper_case", "--planners", "cubic", "--json", "--out", tmp_path)
    assert json.loads(ran.failed()) == json.loads((tmp_path / "comparison.json").read_text())


def test_csv_and_json_agree(paper: Comparison, tmp_path: Path) -> None:
    paths = paper.save(tmp_path / "out")
    assert [path.name for path in paths] == ["comparison.json", "comparison.csv"]
    data = json.loads(paths[0].read_text())
    rows = list(csv.DictReader(io.StringIO(paths[1].read_text())))
    assert [row["planner"] for row in rows] == [row["planner"] for row in data["planners"]]
    assert "peak_jerk" not in rows[0]
    for line, row in zip(rows, data["planners"], strict=True):
        jerk = row["peak_jerk"]
        assert line["peak_jerk.value"] == ("" if jerk is None else str(jerk["value"]))
        assert line["reason"] == row["reason"]
        assert bool(row["reason"]) == (row["failed"] > 0)
        assert float(line["velocity_fluctuation"]) == row["velocity_fluctuation"]
        assert float(line["peak_velocity.value"]) == row["peak_velocity"]["value"]


def test_preset_accelerations_are_met_in_the_units_of_the_file() -> None:
    given = [{"j": 1}, {"j": -2}, {"j": 0}]
    scenario = {
        "units": {"angle": "deg"},
        "planner": "quintic",
        "planner_options": {"accelerations": given},
        "waypoints": [
            {"joints": {"j": 0}},
            {"joints": {"j": 30}, "velocity": {"j": 6}, "time": 5},
            {"joints": {"j": 70}, "time": 15},
        ],
    }
    found = np.degrees(kw.plan(scenario).trajectory.acceleration([0.0, 5.0, 15.0])[:, 0])
    np.testing.assert_allclose(found, [1, -2, 0], atol=1e-9)


def test_planner_leaves_out_what_it_does_not_support_and_says_so() -> None:
    plan = kw.plan("ur5_deburring", planner="cubic")
    assert plan.unsupported_options == ("end_acceleration",)
    assert planned("ur5_deburring").unsupported_options == ()


def test_motion_chosen_by_planning_is_no_option_of_the_user() -> None:
    lift = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    task = {"limits": {"velocity": 1, "acceleration": 4}, "waypoints": lift}
    assert kw.plan(task, planner="cubic").unsupported_options == ()
    frozen = kw.plan(task).scenario.task
    assert kw.plan(frozen, planner="cubic").unsupported_options == ("chosen",)


def test_table_has_a_line_for_each_planner_and_each_reason(knotwork: Command) -> None:
    lines = knotwork("compare", "paper_case").done().splitlines()
    for planner in PLANNERS:
        line, *reasons = (line for line in lines if line.startswith(f"{planner} "))
        assert "…" not in line
        fails = [reason.startswith(f"{planner} fails: ") for reason in reasons]
        assert fails == [True] * (" fail " in line)
    assert any(re.search(r"^cubic .* inf *$", line) for line in lines)


def test_planners_lists_each_with_what_it_gives_up(knotwork: Command) -> None:
    rows = {row["name"]: row for row in json.loads(knotwork("planners", "--json").out)}
    assert set(rows) == set(PLANNERS)
    assert all(row["limitations"] and row["guarantees"] for row in rows.values())
    assert "quintic" in knotwork("planners").out


@pytest.fixture(scope="module")
def along_a_path() -> Comparison:
    line = {"along": "line", "speed": 60, "pose": {"position": [450, 50, 60]}}
    return compare(task(ON, {"name": "off", "stop": True, **line}))


def test_path_figures_equal_motion_of_tool(along_a_path: Comparison) -> None:
    robot = kw.load_robot("ur5")
    for row in along_a_path.scores:
        motion = along_a_path.trajectories[row.planner]
        time = np.linspace(2.0, motion.end_time, 4001)
        poses = [robot.forward(q).translation for q in motion.position(time)]
        away = np.linalg.norm((np.array(poses) - [0.45, 0, 0.06]) * [1, 0, 1], axis=1)
        beyond = np.maximum(np.array(poses)[:, 1] - 0.05, 0) + np.maximum(
            -0.1 - np.array(poses)[:, 1], 0
        )
        off = float(np.hypot(away, beyond).max())
        assert row.tool_path_deviation == pytest.approx(off, rel=0.02, abs=2e-8)
        constant = time[time < motion.end_time - 0.2]
        states = zip(motion.position(constant), motion.velocity(constant), strict=True)
        speeds = np.array([np.linalg.norm(robot.twist(q, v).linear) for q, v in states])
        error = float(np.abs(speeds / 0.06 - 1).max())
        assert row.tool_path_speed_error >= 0.99 * error - 1e-9

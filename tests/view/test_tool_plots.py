"""Pictures of the tool and of its path, against forward kinematics."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from figures import collections, data, label, lines, notes, outside, overlaps, waypoint_names

import knotwork as kw
from knotwork import Plan
from knotwork.errors import InputError
from knotwork.view import plot_joints, plot_tool
from plans import planned
from seams import ON, task


def test_tool_speed_meets_the_given_speeds(deburring_by_waypoints: Plan) -> None:
    deburring = deburring_by_waypoints
    figure = plot_tool(deburring)
    labels = [label(axis) for axis in figure.axes]
    assert labels == ["tool speed [mm/s]", "turning speed [deg/s]"]
    time, speed = data(lines(figure.axes[0], "curve")[0])
    robot = deburring.joints.robot
    for i in range(0, len(time), 97):
        near = [
            robot.forward(deburring.trajectory(time[i] + dt)).translation
            for dt in (-1e-5, 1e-5)
            if deburring.trajectory.start_time <= time[i] + dt <= deburring.trajectory.end_time
        ]
        if len(near) == 2:
            by_differences = 1e3 * float(np.linalg.norm(near[1] - near[0])) / 2e-5
            assert speed[i] == pytest.approx(by_differences, abs=0.01)
    asked_time, given = data(lines(figure.axes[0], "given")[0])
    np.testing.assert_allclose(given, [0, *[50] * 7, 0], atol=1e-9)
    np.testing.assert_array_equal(asked_time, deburring.scenario.times[1:])


def test_a_velocity_that_planning_chose_is_not_marked_as_given() -> None:
    down = [np.pi, 0, 0]
    ends = [{"position": [0.45, y, 0.3], "rpy": down} for y in (-0.2, 0.0, 0.2)]
    start = {"name": "start", "time": 0.0, "stop": True, "pose": ends[0]}
    over = {"name": "over", "time": 2.0, "velocity": "free", "pose": ends[1]}
    end = {"name": "end", "time": 4.0, "stop": True, "pose": ends[2]}
    plan = kw.plan({"robot": "ur5", "waypoints": [start, over, end]})
    for axis in plot_tool(plan).axes[:2]:
        np.testing.assert_array_equal(data(lines(axis, "given")[0])[0], [0, 4])
    position, velocity, *_ = plot_joints(plan).axes
    for line in lines(position, "given"):
        np.testing.assert_array_equal(data(line)[0], [0, 2, 4])
    for line in lines(velocity, "given"):
        np.testing.assert_array_equal(data(line)[0], [0, 4])


def test_an_object_in_the_hand_from_the_start_does_not_touch_its_fingers() -> None:
    plan = planned("panda_pick_place")
    *_, panel = plot_tool(plan).axes
    (curve,) = lines(panel, "curve")
    found = [f for f in plan.report.select(quantity="clearance") if f.involves_scene]
    assert 0.002 <= min(data(curve)[1]) <= min(f.value for f in found if f.value) + 1e-9


def test_numbers_beside_low_panels_are_apart(deburring: Plan) -> None:
    figure = plot_tool(deburring, size="slide")
    assert len(figure.axes) >= 5
    figure.draw_without_rendering()
    for axis in figure.axes:
        low, high = axis.get_ylim()
        boxes = [
            label.get_window_extent()
            for label, at in zip(axis.get_yticklabels(), axis.get_yticks(), strict=True)
            if low <= at <= high
        ]
        assert boxes
        gaps = [above.y0 - below.y1 for below, above in pairwise(boxes)]
        assert all(gap > 0.3 * boxes[0].height for gap in gaps)


def test_a_trajectory_needs_its_scenario(deburring_by_waypoints: Plan, paper_case: Plan) -> None:
    deburring = deburring_by_waypoints
    figure = plot_tool(deburring.trajectory, scenario=deburring.scenario)
    assert len(figure.axes) == 2
    with pytest.raises(InputError, match="without a robot"):
        plot_tool(deburring.trajectory)
    with pytest.raises(InputError, match="without a robot"):
        plot_tool(paper_case)


SEAM = task(
    ON,
    {
        "name": "corner",
        "along": "line",
        "speed": 60,
        "blend": 10,
        "pose": {"position": [450, 50, 60]},
    },
    {"name": "turn", "along": "line", "speed": 60, "pose": {"position": [530, 50, 60]}},
    {
        "name": "off",
        "along": {"arc": {"through": [560, 80, 60]}},
        "speed": 40,
        "pose": {"position": [530, 110, 60]},
    },
    {"name": "up", "after": 2, "stop": True, "pose": {**ON["pose"], "position": [450, 50, 200]}},
)
NAMES = ["start", "on", "corner", "turn", "off", "up"]


@pytest.fixture(scope="module")
def seam() -> Plan:
    return kw.plan(SEAM)


@pytest.fixture(scope="module")
def loose() -> Plan:
    return kw.plan(SEAM, planner="bspline")


def panel(figure: Any, title: str) -> Any:
    (axis, *_) = (one for one in figure.axes if label(one).startswith(title))
    return axis


def test_deviation_is_that_of_the_check_and_lies_below_its_tolerance(seam: Plan) -> None:
    figure = plot_tool(seam, degrees=True)
    for title, quantity, factor in (
        ("off tool path", "path_deviation", 1e3),
        ("turned off path", "path_orientation", np.degrees(1.0)),
        ("speed error", "path_speed", 100 / 0.06),
    ):
        axis = panel(figure, title)
        time, value = data(lines(axis, "curve")[0])
        findings = seam.report.select(quantity=quantity)
        assert len(findings) == 3
        for one in findings[:2]:  # both at 60 mm/s
            start, end = one.interval
            shown = np.abs(value[(time >= start) & (time <= end)])
            most = factor * (one.value + one.proof_gap)
            assert np.nanmax(shown) <= most * (1 + 1e-6) + 1e-9
            assert np.nanmax(shown) == pytest.approx(factor * one.value, rel=0.05, abs=1e-6)
        level = data(lines(axis, "tolerance")[-1])
        limit = 1.0 if quantity == "path_speed" else factor * findings[0].limit
        assert np.nanmax(level[1]) == pytest.approx(limit)
        assert np.nanmin(level[0]) == pytest.approx(seam.scenario.waypoints[1].time)
        assert np.nanmax(level[0]) == pytest.approx(seam.scenario.waypoints[4].time)
        assert not lines(axis, "beyond")


def test_what_is_beyond_a_tolerance_is_marked_and_named(seam: Plan, loose: Plan) -> None:
    figure = plot_tool([seam, loose])
    axis = panel(figure, "off tool path")
    (beyond,) = lines(axis, "beyond")
    assert "bspline" in str(beyond.get_gid())
    drawn = data(beyond)[1]
    assert np.nanmin(drawn) > 0.1
    worst = max(finding.value for finding in loose.report.select(quantity="path_deviation"))
    assert np.nanmax(drawn) == pytest.approx(1e3 * worst, rel=0.02)
    assert any(
        note.startswith("bspline: ") and "tolerance 0.1 mm" in note for note in notes(figure)
    )


def test_the_required_speed_is_a_band(seam: Plan) -> None:
    bands = collections(panel(plot_tool(seam), "tool speed"), "band")
    heights = [one.get_paths()[0].get_extents().extents for one in bands]
    assert [tuple(np.round(box[[1, 3]], 9)) for box in heights] == [
        (59.4, 60.6),
        (59.4, 60.6),
        (39.6, 40.4),
    ]


@pytest.mark.parametrize("draw", [plot_tool, plot_joints])
def test_names_only_waypoints_of_scenario_without_overlaps(seam: Plan, draw: Any) -> None:
    figure = draw(seam)
    assert [text.get_text() for text in waypoint_names(figure.axes[0])] == NAMES
    assert len(seam.joint_waypoints.time) > len(NAMES)
    assert not overlaps(figure)
    assert not outside(figure)

"""Pictures of the tool, against forward kinematics."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from figures import data, label, lines

import knotwork as kw
from knotwork import Plan
from knotwork.errors import InputError
from knotwork.view import plot_joints, plot_tool
from plans import arm


def test_speed_is_that_of_the_tool_and_meets_what_is_asked(deburring_by_waypoints: Plan) -> None:
    deburring = deburring_by_waypoints
    figure = plot_tool(deburring)
    labels = [label(axis) for axis in figure.axes]
    assert labels == ["tool speed [mm/s]", "turning speed [deg/s]"]
    time, speed = data(lines(figure.axes[0], "curve")[0])
    robot = arm(deburring)
    for i in range(0, len(time), 97):
        near = [
            robot.forward(deburring.trajectory(time[i] + dt)).translation
            for dt in (-1e-5, 1e-5)
            if deburring.trajectory.start_time <= time[i] + dt <= deburring.trajectory.end_time
        ]
        if len(near) == 2:
            by_differences = 1e3 * float(np.linalg.norm(near[1] - near[0])) / 2e-5
            assert speed[i] == pytest.approx(by_differences, abs=0.01)
    asked_time, asked = data(lines(figure.axes[0], "given")[0])
    np.testing.assert_allclose(asked, [0, *[50] * 7, 0], atol=1e-9)
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

"""`speed:` along the smooth path, against circles and parabolas."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from knotwork.task.scenario import load_scenario
from knotwork.waypoints import CartesianWaypoint
from sweeps import examples

Array = NDArray[np.float64]
SPEED = 0.25
POINTS = st.lists(st.floats(-1, 1), min_size=3, max_size=3)


def poses_to_file(positions: Any, rotations: Any = None) -> list[dict[str, Any]]:
    poses = []
    for i, position in enumerate(positions):
        rotation = Rotation.identity() if rotations is None else rotations[i]
        poses.append(
            {
                "position": [float(x) for x in position],
                "quaternion_xyzw": rotation.as_quat().tolist(),
            }
        )
    return poses


def passing(positions: Any, index: int, rotations: Any = None, **rest: Any) -> CartesianWaypoint:
    """Waypoint `index`, passed at SPEED; the others stop."""
    waypoints = [
        {"pose": pose, "time": i, **({"speed": SPEED} if i == index else {"stop": True})}
        for i, pose in enumerate(poses_to_file(positions, rotations))
    ]
    scenario = load_scenario({"robot": "ur5", "waypoints": waypoints, **rest})
    return scenario.waypoints[index]


@examples()
@given(POINTS, POINTS, st.floats(0.1, 2.8), st.floats(0.1, 2.8))
def test_tool_that_follows_circle_turns_with_it(
    axis: list[float], towards: list[float], before: float, after: float
) -> None:
    """The three waypoints are on a circle of 0.3 m, at angles [rad] before and after the second."""
    along, arm = np.array(axis), np.cross(axis, towards)
    assume(min(np.linalg.norm(along), np.linalg.norm(arm)) > 0.05)
    along, arm = along / np.linalg.norm(along), 0.3 * arm / np.linalg.norm(arm)
    start = Rotation.from_euler("xyz", [0.3, 0.2, 0.1])
    turns = [Rotation.from_rotvec(angle * along) for angle in (-before, 0.0, after)]
    points = [turn.apply(arm) + np.array([0.4, 0.1, 0.3]) for turn in turns]
    waypoint = passing(points, 1, [turn * start for turn in turns])
    np.testing.assert_allclose(waypoint.angular, SPEED / 0.3 * along, atol=1e-9)
    np.testing.assert_allclose(waypoint.linear, np.cross(waypoint.angular, arm), atol=1e-9)
    still = passing(points, 1)
    np.testing.assert_allclose(still.linear, waypoint.linear, atol=1e-9)
    np.testing.assert_array_equal(still.angular, 0)


def test_an_uneven_rate_of_turning_is_that_of_the_parabola_through_three_angles() -> None:
    s, angles = np.array([0.0, 0.1, 0.4]), np.array([0.2, 0.5, 0.1])
    rotations = [Rotation.from_rotvec([0, angle, 0]) for angle in angles]
    slope = np.polyval(np.polyder(np.polyfit(s, angles, 2)), s[1])
    waypoint = passing([[x, 0, 0] for x in s], 1, rotations)
    np.testing.assert_allclose(waypoint.angular, [0, slope * SPEED, 0], atol=1e-12)


def test_speed_in_any_frame_and_unit_is_the_same_motion() -> None:
    points = np.array([[0, 0, 0], [0.1, 0.05, 0], [0.2, 0, 0.1]])
    frame = Rotation.from_euler("xyz", [0.3, -0.8, 2.0])
    plain = passing(points, 1)
    framed = passing(
        points,
        1,
        frames={"f": {"position": [0.5, 0, 0], "quaternion_xyzw": frame.as_quat().tolist()}},
        frame="f",
    )
    np.testing.assert_allclose(framed.linear, frame.apply(np.array(plain.linear)), atol=1e-14)
    waypoints = [
        {"pose": pose, "time": i, **({"speed": 1000 * SPEED} if i == 1 else {})}
        for i, pose in enumerate(poses_to_file(1000 * points))
    ]
    scenario = load_scenario({"robot": "ur5", "units": {"length": "mm"}, "waypoints": waypoints})
    waypoint = scenario.waypoints[1]
    np.testing.assert_allclose(waypoint.linear, plain.linear, atol=1e-14)

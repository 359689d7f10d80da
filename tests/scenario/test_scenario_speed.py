"""`speed:` along the smooth path, against circles fitted and differentiated in the test."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from knotwork.errors import InputError
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
    waypoint = scenario.waypoints[index]
    assert isinstance(waypoint, CartesianWaypoint)
    return waypoint


def circle(a: Array, b: Array, c: Array) -> tuple[Callable[[float], Array], list[float], Array]:
    """Arc-length path of the circle through three points, the arc lengths of them, its axis."""
    # The centre is equally far from all three and in their plane: three linear equations.
    axis = np.cross(b - a, c - b)
    axis /= np.linalg.norm(axis)
    rows = np.array([b - a, c - b, axis])
    values = [(b @ b - a @ a) / 2, (c @ c - b @ b) / 2, axis @ a]
    centre = np.linalg.solve(rows, values)
    radius = float(np.linalg.norm(a - centre))
    first = (a - centre) / radius
    second = np.cross(axis, first)

    def angle(point: Array) -> float:
        return float(np.arctan2((point - centre) @ second, (point - centre) @ first) % (2 * np.pi))

    def path(s: float) -> Array:
        turn = s / radius
        return centre + radius * (np.cos(turn) * first + np.sin(turn) * second)

    return path, [0.0, radius * angle(b), radius * angle(c)], axis / radius


@examples()
@given(POINTS, POINTS, POINTS)
def test_direction_is_tangent_of_circle(a: list[float], b: list[float], c: list[float]) -> None:
    points = np.array([a, b, c])
    u, v = points[1] - points[0], points[2] - points[1]
    sizes = np.linalg.norm(u), np.linalg.norm(v)
    assume(min(sizes) > 0.05)
    assume(np.linalg.norm(np.cross(u, v)) > 0.05 * sizes[0] * sizes[1])
    path, arcs, _ = circle(*points)
    np.testing.assert_allclose([path(s) for s in arcs], points, atol=1e-9)
    step = 1e-5 * min(sizes)
    tangent = (path(arcs[1] + step) - path(arcs[1] - step)) / (2 * step)
    waypoint = passing(points, 1)
    np.testing.assert_allclose(waypoint.linear, SPEED * tangent, atol=1e-6 * SPEED)
    assert np.linalg.norm(waypoint.linear) == pytest.approx(SPEED, rel=1e-12)
    np.testing.assert_array_equal(waypoint.angular, 0)


@pytest.mark.parametrize("angles", [(0.0, 0.4, 0.7), (0.0, 0.1, 1.9), (1.0, 3.5, 3.8)])
def test_a_tool_that_follows_a_circle_turns_with_it(angles: tuple[float, float, float]) -> None:
    radius, axis = 0.3, np.array([2.0, -1.0, 2.0]) / 3
    start = Rotation.from_euler("xyz", [0.3, 0.2, 0.1])
    arm = np.cross(axis, [0.0, 0.0, 1.0])
    arm *= radius / np.linalg.norm(arm)
    turns = [Rotation.from_rotvec(angle * axis) for angle in angles]
    points = [turn.apply(arm) + np.array([0.4, 0.1, 0.3]) for turn in turns]
    waypoint = passing(points, 1, [turn * start for turn in turns])
    np.testing.assert_allclose(waypoint.angular, SPEED / radius * axis, atol=1e-12)
    velocity = np.cross(SPEED / radius * axis, turns[1].apply(arm))
    np.testing.assert_allclose(waypoint.linear, velocity, atol=1e-12)


@pytest.mark.parametrize("index", [0, 2])
def test_speed_at_an_end_of_the_motion_needs_a_direction(index: int) -> None:
    with pytest.raises(
        InputError, match=r"speed: the path's direction is undefined, .* or there is none"
    ):
        passing([[0, 0, 0], [0.1, 0.05, 0], [0.2, 0, 0.1]], index)


def test_an_uneven_rate_of_turning_is_that_of_the_parabola_through_three_angles() -> None:
    s, angles = np.array([0.0, 0.1, 0.4]), np.array([0.2, 0.5, 0.1])
    rotations = [Rotation.from_rotvec([0, angle, 0]) for angle in angles]
    slope = np.polyval(np.polyder(np.polyfit(s, angles, 2)), s[1])
    waypoint = passing([[x, 0, 0] for x in s], 1, rotations)
    np.testing.assert_allclose(waypoint.angular, [0, slope * SPEED, 0], atol=1e-12)


def test_speed_is_the_same_motion_in_whatever_frame_and_unit_it_is_said() -> None:
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
    assert isinstance(waypoint, CartesianWaypoint)
    np.testing.assert_allclose(waypoint.linear, plain.linear, atol=1e-14)

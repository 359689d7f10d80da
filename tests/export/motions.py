"""Motions that the exports are tried with, and what controllers make of them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from knotwork.curves.interpolation import PlannerOptions, get_planner
from knotwork.curves.trajectory import JointTrajectory
from knotwork.waypoints import JointWaypoints


@cache
def motion(planner: str = "modified-hermite") -> JointTrajectory:
    """Two revolute joints and a prismatic one, from 1 s on, at times that are no whole ns."""
    time = np.array([1.0, 1 + 1 / 3, 2.7182818284590451, 3.3, np.pi + 1.5])
    q = np.array([[0, 1, 0.2], [0.5, -1, 0.25], [1.5, 0.3, 0.1], [-0.4, 0.1, 0], [0, 0, 0.3]])
    v = np.array([[0, 0, 0], [1, 0.2, 0.1], [-0.5, 1, -0.2], [0.3, -0.7, 0.1], [0, 0, 0]])
    waypoints = JointWaypoints(("a", "b", "slide"), time, q, v, joint_units=("rad", "rad", "m"))
    return get_planner(planner)(waypoints, PlannerOptions())


@st.composite
def hermite_data(draw: st.DrawFn) -> JointTrajectory:
    """Any C1 motion of cubics."""
    count = draw(st.integers(2, 6))
    joints = draw(st.integers(1, 3))
    steps = draw(st.lists(st.floats(0.05, 3.0), min_size=count - 1, max_size=count - 1))
    start = draw(st.floats(-5.0, 5.0))
    number = st.floats(-10.0, 10.0, allow_subnormal=False)
    rows = st.lists(
        st.lists(number, min_size=joints, max_size=joints), min_size=count, max_size=count
    )
    time = start + np.concatenate(([0.0], np.cumsum(steps)))
    names = [f"joint_{i + 1}" for i in range(joints)]
    return JointTrajectory.from_knots(names, time, draw(rows), draw(rows))


NANOSECONDS = 1_000_000_000


def nanoseconds(duration: Mapping[str, int]) -> int:
    assert 0 <= duration["nanosec"] < NANOSECONDS
    return duration["sec"] * NANOSECONDS + duration["nanosec"]


def controller(message: Mapping[str, Any], ticks: np.ndarray) -> np.ndarray:
    """Positions that joint_trajectory_controller commands at times after the start [ns].

    Its documented rule: linear for positions, cubic for positions and velocities, quintic for
    accelerations too; after the last point that point is held.
    """
    points = message["points"]
    at = np.array([nanoseconds(point["time_from_start"]) for point in points]) / NANOSECONDS
    keys = [key for key in ("positions", "velocities", "accelerations") if key in points[0]]
    ends = [[np.array(point[key]) for key in keys] for point in points]
    return np.asarray(BPoly.from_derivatives(at, ends)(np.minimum(ticks / NANOSECONDS, at[-1])))


def ppval(pp: Mapping[str, Any], at: np.ndarray) -> np.ndarray:
    """What MATLAB's ppval gives: d by number of times, from its documented layout of coefs.

    Row (piece - 1)·d + i of coefs is component i in that piece, highest power first.
    """
    breaks, coefs, d = np.ravel(pp["breaks"]), pp["coefs"], int(pp["d"])
    out = np.empty((d, at.size))
    for column, t in enumerate(at):
        piece = int(np.clip(np.searchsorted(breaks, t, side="right"), 1, breaks.size - 1))
        for i in range(1, d + 1):
            row = coefs[(piece - 1) * d + i - 1]
            out[i - 1, column] = np.polyval(row, t - breaks[piece - 1])
    return out

"""Motions that the exports are tried with."""

from __future__ import annotations

from functools import cache

import numpy as np
from hypothesis import strategies as st

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

"""SciPy: the `PPoly` itself, and its arrays as a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from knotwork.export.samples import npz_bytes
from knotwork.trajectory import JointTrajectory

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


def to_scipy(trajectory: JointTrajectory) -> PPoly:
    """Give the motion as `scipy.interpolate.PPoly`, exactly, of whatever degree.

    Calling it gives positions [rad or m] of trailing shape (d,); it does not extrapolate.
    """
    return trajectory.polynomial.to_ppoly()


def to_scipy_npz(trajectory: JointTrajectory) -> bytes:
    """Write the arrays of the `PPoly` as NumPy's npz, without pickles.

    Back in Python:

        f = numpy.load("motion.npz")
        curve = scipy.interpolate.PPoly(f["c"], f["x"], extrapolate=False)
    """
    return npz_bytes(
        {
            "c": trajectory.polynomial.c,
            "x": trajectory.breaks,
            "joint_names": np.array(trajectory.joint_names),
            "joint_units": np.array(trajectory.joint_units),
            "planner": np.array(trajectory.planner),
        }
    )

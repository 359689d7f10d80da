"""The polynomials of a motion, exactly and of any degree, for SciPy, MATLAB and Drake."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.curves.trajectory import JointTrajectory
from knotwork.files.export.packages import import_package
from knotwork.files.export.samples import npz_bytes

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

HEADER = b"MATLAB 5.0 MAT-file, written by Knotwork"
HEADER_SIZE = 116
"""Bytes of text at the start of a MAT-file; SciPy writes the date there."""


def to_scipy(trajectory: JointTrajectory) -> PPoly:
    """Return the motion as `scipy.interpolate.PPoly`, exactly, of any degree.

    Calling it gives positions [rad or m] of trailing shape (d,); it does not extrapolate.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> curve = to_scipy(lift)
    >>> curve(0.5), curve.derivative()(0.5)
    (array([0.5]), array([1.5]))
    """
    return trajectory.polynomial.to_ppoly()


def to_scipy_npz(trajectory: JointTrajectory) -> bytes:
    """Write the arrays of the `PPoly` as NumPy's npz, without pickles.

    Back in Python:

        f = numpy.load("motion.npz")
        curve = scipy.interpolate.PPoly(f["c"], f["x"], extrapolate=False)

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> import io
    >>> np.load(io.BytesIO(to_scipy_npz(lift)))["c"].shape
    (4, 1, 1)
    """
    return npz_bytes(
        {
            "c": trajectory.polynomial.c,
            "x": trajectory.breaks,
            "joint_names": np.array(trajectory.joint_names),
            "joint_units": np.array(trajectory.joint_units),
            "planner": np.array(trajectory.origin),
        }
    )


def to_mat(trajectory: JointTrajectory) -> bytes:
    """Write a MAT-file with the motion as a piecewise polynomial.

    In MATLAB or Octave:

        s = load('motion.mat');
        pp = mkpp(s.breaks, s.coefs, s.d);
        q = ppval(pp, linspace(s.breaks(1), s.breaks(end), 1000));  % d x 1000 [rad or m]

    The file has `breaks` [s], 1 by m; `coefs`, (m - 1)·d by k + 1, highest power first, the d
    joints of a piece below one another; `d`; `joint_names` and `joint_units`, cells; and `pp`, the
    result of `mkpp`.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> import io, scipy.io
    >>> scipy.io.loadmat(io.BytesIO(to_mat(lift)))["coefs"]
    array([[-2.,  3.,  0.,  0.]])
    """
    from scipy.io import savemat

    c = trajectory.polynomial.c
    size, pieces, joints = c.shape
    coefficients = np.ascontiguousarray(c.transpose(1, 2, 0)).reshape(pieces * joints, size)
    breaks = trajectory.breaks[None, :]
    content = {
        "breaks": breaks,
        "coefs": coefficients,
        "d": float(joints),
        "joint_names": np.array(trajectory.joint_names, dtype=object)[None, :],
        "joint_units": np.array(trajectory.joint_units, dtype=object)[None, :],
        "planner": trajectory.origin,
        "pp": {
            "form": "pp",
            "breaks": breaks,
            "coefs": coefficients,
            "pieces": float(pieces),
            "order": float(size),
            "dim": float(joints),
        },
    }
    file = io.BytesIO()
    savemat(file, content)
    # with a date, two files of the same motion would differ
    return HEADER.ljust(HEADER_SIZE) + file.getvalue()[HEADER_SIZE:]


def to_drake(trajectory: JointTrajectory) -> Any:
    """Return the motion as Drake's `PiecewisePolynomial`, d rows and one column (needs `pydrake`).

    The coefficients are those of the motion.

    Raises:
        InputError: Drake can't be imported.
    """
    how = "install it with pip install drake"
    curves = import_package("pydrake.trajectories", "a Drake trajectory", how)
    polynomials = import_package("pydrake.polynomial", "a Drake trajectory", how)
    c = trajectory.polynomial.c[::-1]  # Drake has the lowest power first
    pieces = []
    for piece in range(c.shape[1]):
        rows = np.empty((c.shape[2], 1), dtype=object)
        for joint in range(c.shape[2]):
            rows[joint, 0] = polynomials.Polynomial(np.array(c[:, piece, joint]))
        pieces.append(rows)
    return curves.PiecewisePolynomial(pieces, trajectory.breaks.tolist())

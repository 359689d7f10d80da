"""MATLAB: a piecewise polynomial for `ppval`, exactly, of whatever degree."""

from __future__ import annotations

import io

import numpy as np

from knotwork.trajectory import JointTrajectory

HEADER = b"MATLAB 5.0 MAT-file, written by Knotwork"
HEADER_SIZE = 116
"""Bytes of text at the start of a MAT-file; SciPy writes the date there."""


def to_mat(trajectory: JointTrajectory) -> bytes:
    """Write a MAT-file with the motion as a piecewise polynomial.

    In MATLAB or Octave:

        s = load('motion.mat');
        pp = mkpp(s.breaks, s.coefs, s.d);
        q = ppval(pp, linspace(s.breaks(1), s.breaks(end), 1000));  % d x 1000 [rad or m]

    The file holds `breaks` [s], 1 by m; `coefs`, (m - 1)·d by k + 1, highest power first, the d
    joints of a piece below one another; `d`; `joint_names` and `joint_units`, cells; and `pp`,
    what `mkpp` makes of it.
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
        "planner": trajectory.planner,
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
    # the date would make two files of one motion differ
    return HEADER.ljust(HEADER_SIZE) + file.getvalue()[HEADER_SIZE:]

"""Drake, SciPy and MATLAB: their own evaluation gives our motion."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given
from motions import hermite_data, motion
from replay import ppval
from scipy.interpolate import PPoly
from scipy.io import loadmat

from knotwork.curves.interpolation import PLANNERS
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files.export import to_scipy_npz
from sweeps import examples


def times(trajectory: JointTrajectory, count: int = 400) -> np.ndarray:
    """Times all over the motion, apart from breaks, where derivatives may jump."""
    regular = np.linspace(trajectory.start_time, trajectory.end_time, count)
    return regular[np.abs(regular[:, None] - trajectory.breaks).min(axis=1) > 1e-9]


def same_in_drake(trajectory: JointTrajectory) -> None:
    pytest.importorskip("pydrake.trajectories", reason="drake has no wheel for this platform")
    curve = trajectory.to_drake()
    assert (curve.rows(), curve.cols()) == (len(trajectory.joint_names), 1)
    assert list(curve.get_segment_times()) == trajectory.breaks.tolist()
    at = times(trajectory)
    for nu in range(3):
        own = trajectory(at, nu)
        theirs = np.array([curve.EvalDerivative(t, nu)[:, 0] for t in at])
        scale = max(1.0, float(np.abs(own).max()))
        assert np.abs(theirs - own).max() <= 1e-12 * scale


@pytest.mark.parametrize("planner", sorted(PLANNERS))
def test_drake(planner: str) -> None:
    same_in_drake(motion(planner))


def test_without_drake(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pydrake.trajectories", None)
    with pytest.raises(InputError, match="pip install drake"):
        motion().to_drake()


@pytest.mark.parametrize("planner", sorted(PLANNERS))
def test_scipy(planner: str) -> None:
    trajectory = motion(planner)
    curve = trajectory.to_scipy()
    file = np.load(io.BytesIO(to_scipy_npz(trajectory)), allow_pickle=False)
    again = PPoly(file["c"], file["x"], extrapolate=False)
    at = times(trajectory)
    for nu in range(4):
        own = trajectory(at, nu)
        assert curve(at, nu) == pytest.approx(own, rel=1e-12, abs=1e-12 * np.abs(own).max())
        assert (again(at, nu) == curve(at, nu)).all()
    assert np.isnan(curve(trajectory.end_time + 1)).all()


@given(hermite_data())
@examples()
def test_matlab(trajectory: JointTrajectory) -> None:
    file = loadmat(io.BytesIO(trajectory.to_mat()), simplify_cells=True)
    at = np.linspace(trajectory.start_time, trajectory.end_time, 60)
    pp = {"breaks": file["breaks"], "coefs": np.atleast_2d(file["coefs"]), "d": file["d"]}
    assert ppval(pp, at) == pytest.approx(trajectory(at).T, abs=1e-10)
    names = np.atleast_1d(file["joint_names"])
    assert tuple(names) == trajectory.joint_names


@pytest.mark.parametrize("planner", ["quintic", "nonic", "trapezoidal"])
def test_matlab_of_any_degree(planner: str) -> None:
    trajectory = motion(planner)
    file = loadmat(io.BytesIO(trajectory.to_mat()), simplify_cells=True)
    at = times(trajectory, 100)
    assert ppval(file, at) == pytest.approx(trajectory(at).T, abs=1e-11)
    pp = file["pp"]
    assert pp["form"] == "pp"
    assert (pp["coefs"] == file["coefs"]).all()
    size = len(trajectory.polynomial.c)
    assert (pp["pieces"], pp["order"], pp["dim"]) == (trajectory.breaks.size - 1, size, 3)
    assert tuple(file["joint_units"]) == ("rad", "rad", "m")

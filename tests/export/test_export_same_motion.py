"""Drake, SciPy and MATLAB make our motion of what defines it, whatever joints are named."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from motions import hermite_data, motion, ppval
from scipy.interpolate import PPoly
from scipy.io import loadmat

import knotwork as kw
from knotwork.curves.interpolation import PLANNERS
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError, InputError
from knotwork.files import export
from knotwork.files.export import motion_points, to_scipy_npz
from knotwork.files.foreign import read_trajectory
from sweeps import examples
from texts import written


def times(trajectory: JointTrajectory, count: int = 400) -> np.ndarray:
    """Times all over the motion, apart from breaks, where derivatives may jump."""
    regular = np.linspace(trajectory.start_time, trajectory.end_time, count)
    return regular[np.abs(regular[:, None] - trajectory.breaks).min(axis=1) > 1e-9]


@pytest.mark.parametrize("planner", sorted(PLANNERS))
def test_drake(planner: str) -> None:
    pytest.importorskip("pydrake.trajectories", reason="drake has no wheel for this platform")
    trajectory = motion(planner)
    curve = trajectory.to_drake()
    assert (curve.rows(), curve.cols()) == (len(trajectory.joint_names), 1)
    assert list(curve.get_segment_times()) == trajectory.breaks.tolist()
    at = times(trajectory)
    for nu in range(3):
        own = trajectory(at, nu)
        theirs = np.array([curve.EvalDerivative(t, nu)[:, 0] for t in at])
        scale = max(1.0, float(np.abs(own).max()))
        assert np.abs(theirs - own).max() <= 1e-12 * scale


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


CUBIC = [
    "modified-hermite",
    "cubic",
    "bspline",
    "bspline-velocity",
    "parabolic-blend",
    "trapezoidal",
]


@pytest.mark.parametrize("planner", CUBIC)
def test_knots_define_cubics(planner: str) -> None:
    points = motion_points(motion(planner))
    assert points.exact
    assert points.inserted == 0
    assert points.trajectory is motion(planner)
    assert points.error < 1e-14
    assert "define the whole motion exactly" in points.describe()


@pytest.mark.parametrize("planner", sorted(set(PLANNERS) - set(CUBIC)))
def test_knots_do_not_define_more(planner: str) -> None:
    with pytest.raises(ExportError, match="tolerance"):
        motion_points(motion(planner))


@pytest.mark.parametrize("planner", sorted(set(PLANNERS) - set(CUBIC)))
@pytest.mark.parametrize("accelerations", [False, True])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-7])
def test_a_fit_meets_its_tolerance(planner: str, accelerations: bool, tolerance: float) -> None:
    trajectory = motion(planner)
    points = motion_points(trajectory, accelerations=accelerations, tolerance=tolerance)
    dense = np.linspace(trajectory.start_time, trajectory.end_time, 30001)
    off = np.abs(points.trajectory(dense) - trajectory(dense)).max()
    slow = np.abs(points.trajectory(dense, 1) - trajectory(dense, 1)).max()
    assert off <= points.error + 1e-13
    assert slow <= points.velocity_error + 1e-11
    assert points.error <= tolerance
    inside = dense[~np.isin(dense, points.trajectory.breaks)]
    accelerations_off = np.abs(points.trajectory(inside, 2) - trajectory(inside, 2)).max()
    assert accelerations_off <= points.acceleration_error + 1e-9
    assert points.acceleration_error <= 1.2 * accelerations_off + 1e-9
    ending = "C2" if accelerations else "C1: the acceleration jumps"
    assert points.exact or points.describe().endswith(ending)
    if off > 1e-10:
        assert points.error <= 1.01 * off
    assert points.count == trajectory.breaks.size + points.inserted
    assert points.trajectory.continuity.order >= (2 if accelerations else 1)


def test_a_fit_takes_few_points() -> None:
    """The error falls with the fourth power: a hundredfold tolerance, about 3.2 times fewer."""
    counts = [
        motion_points(motion("quintic"), tolerance=tolerance).count
        for tolerance in (1e-4, 1e-6, 1e-8)
    ]
    assert 2.0 < counts[1] / counts[0] < 5.0
    assert 2.0 < counts[2] / counts[1] < 5.0


@given(hermite_data(), st.floats(1e-9, 1e-1))
@examples()
def test_fit_of_exact_motion_inserts_nothing(trajectory: JointTrajectory, tolerance: float) -> None:
    points = motion_points(trajectory, tolerance=tolerance)
    assert points.exact
    assert points.inserted == 0


@pytest.mark.parametrize(
    "tolerance",
    [0.0, -1e-3, float("nan"), float("inf"), "wide", "1e-3", True, 10**400, 1j, [1e-3], 1e-30],
)
def test_tolerances_that_can_not_be(tolerance: float) -> None:
    with pytest.raises(InputError):
        motion_points(motion("quintic"), tolerance=tolerance)


def test_a_tolerance_that_takes_too_many_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("knotwork.files.export.lossless.MAX_EXPORTED_POINTS", 50)
    with pytest.raises(InputError, match="more than 50 points"):
        motion_points(motion("quintic"), tolerance=1e-9)


@pytest.mark.parametrize("order", [0, 1])
def test_a_jump_is_no_point(order: int) -> None:
    c = np.zeros((4, 2, 1))
    c[3 - order, 1, 0] = 1.0
    trajectory = JointTrajectory(("a",), PiecewisePolynomial(c, [0.0, 1.0, 2.0]))
    unit = ("rad", "rad/s")[order]
    for tolerance in (None, 1e-3):
        with pytest.raises(ExportError, match=f"'a' jumps by 1 {unit} at 1 s") as got:
            motion_points(trajectory, tolerance=tolerance)
        assert (got.value.joint, got.value.error, got.value.time) == ("a", 1.0, 1.0)


NAMES = [
    *("time", "time_step_s", "position", "tool.position_x", "j.position_rad", "nan", "null"),
    *("a\nb", "a\r\nb", " x ", "a,b", 'a"b', "#a", "- a", "a: b", "{a}"),
    *("\u2028x", "\ufeffz", "x\x85y", "\x1b[0m", "😀", "=1+1", "'"),
]
TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1)
FORMATS = {
    "samples.csv": lambda motion: export.content(export.motion_table(motion, rate=50), "csv"),
    "knots.csv": lambda motion: export.content(export.motion_table(motion, knots_only=True), "csv"),
    "samples.json": lambda motion: export.content(export.motion_table(motion, rate=50), "json"),
    "pvt.csv": lambda motion: export.content(motion, "pvt"),
    "steps.csv": lambda motion: export.content(motion, "pvt", incremental=True, degrees=True),
    "ros2.yaml": lambda motion: motion.to_ros2(),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("names")


def there_and_back(names: list[str], folder: Path) -> None:
    stops = [
        {
            "joints": {name: 0.1 * i + start for i, name in enumerate(names)},
            "after": 1,
            "stop": True,
        }
        for start in (0.0, 0.7)
    ]
    del stops[0]["after"]
    stops.append({"joints": dict.fromkeys(names, 1.1), "after": 1.5, "stop": True})
    task = {"joint_units": dict.fromkeys(names, "rad"), "waypoints": stops}
    motion = kw.plan(task).trajectory
    times = np.linspace(0, 2.5, 40)
    for name, write in FORMATS.items():
        content = write(motion)
        path = written(folder / name, content if isinstance(content, bytes) else content.encode())
        back, faults = read_trajectory(path, motion.joint_names, motion.joint_units)
        assert back.joint_names == tuple(names)
        assert not faults
        atol = 1e-4 if "samples" in name else 1e-8
        np.testing.assert_allclose(back.position(times), motion.position(times), atol=atol)


@pytest.mark.parametrize("name", NAMES)
def test_names_that_have_a_meaning_elsewhere(name: str, folder: Path) -> None:
    there_and_back([name], folder)
    there_and_back(["other", name, f"{name}2"], folder)


@examples(5, 30)
@given(st.lists(TEXT, min_size=1, max_size=3, unique=True))
@example(["a", "a "])
@example(["time", "s", "position"])
def test_any_names(folder: Path, names: list[str]) -> None:
    if len({name.replace("\r\n", "\n").replace("\r", "\n") for name in names}) == len(names):
        there_and_back(names, folder)

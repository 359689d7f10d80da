"""Pictures of joints and their curves, against the plan and the trajectory."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from figures import (
    QUANTITIES,
    collections,
    data,
    heading,
    label,
    legend_words,
    lines,
    notes,
    waypoint_names,
)
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
from knotwork import Plan
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import InputError
from knotwork.view import plot_joints
from knotwork.view.curves import strokes
from plans import planned
from sweeps import examples, mostly_exhaustive

FAILING = Path(__file__).parents[1] / "failing"


@pytest.fixture(scope="module")
def cubic() -> Plan:
    return planned("paper_case", planner="cubic")


@pytest.fixture(scope="module")
def broken() -> Plan:
    return kw.plan(FAILING / "velocity_limit_broken.yaml")


def test_a_row_a_quantity_with_every_joint(deburring: Plan) -> None:
    figure = plot_joints(deburring)
    assert len(figure.axes) == 4
    units = ("deg", "deg/s", "deg/s²", "deg/s³")
    for axis, quantity, unit in zip(figure.axes, QUANTITIES, units, strict=True):
        assert label(axis) == f"{quantity} [{unit}]"
        drawn = [str(line.get_gid()).split(":")[2] for line in lines(axis, "curve")]
        assert drawn == list(deburring.trajectory.joint_names)
        assert len({str(line.get_color()) for line in lines(axis, "curve")}) == 6
        styles = {str(line._unscaled_dash_pattern) for line in lines(axis, "curve")}  # type: ignore[attr-defined]
        assert len(styles) == 6  # distinguishable without colour, too
    assert figure.axes[-1].get_xlabel() == "time [s]"
    assert set(deburring.trajectory.joint_names) <= set(legend_words(figure))
    assert {"waypoint", "given", "knot"} <= set(legend_words(figure))
    assert heading(figure) == "ur5_deburring · modified-hermite"


@pytest.mark.parametrize("degrees", mostly_exhaustive([False, True], True))
def test_curves_are_the_trajectory(deburring: Plan, degrees: bool) -> None:
    factor = math.degrees(1) if degrees else 1.0
    figure = plot_joints(deburring, degrees=degrees, size="slide")
    assert figure.get_size_inches() == pytest.approx([13.333, 7.5])
    for joint in range(6):
        for order in range(3):
            line = lines(figure.axes[order], "curve")[joint]
            time, value = data(line)
            assert np.isfinite(value).all()  # C2: nothing jumps
            expected = factor * deburring.trajectory(time, order)[:, joint]
            np.testing.assert_allclose(value, expected, rtol=1e-9, atol=1e-9 * factor)
            assert time[0] == deburring.trajectory.start_time
            assert time[-1] == deburring.trajectory.end_time
    assert ("[deg/s]" if degrees else "[rad/s]") in label(figure.axes[1])


def test_jumps_of_acceleration_are_drawn_at_both_values(cubic: Plan) -> None:
    (axis,) = plot_joints(cubic, quantities=["acceleration"], degrees=True).axes
    time, value = data(lines(axis, "curve")[0])
    gaps = np.flatnonzero(np.isnan(value))
    np.testing.assert_array_equal(time[gaps], [5.0, 15.0])
    # By hand, Eq. (6): at B -0.8 and -1.2, at C 1.2 and 2.2 deg/s².
    np.testing.assert_allclose(value[gaps - 1], [-0.8, 1.2], atol=1e-9)
    np.testing.assert_allclose(value[gaps + 1], [-1.2, 2.2], atol=1e-9)
    jump_time, jump = data(lines(axis, "jump")[0])
    np.testing.assert_array_equal(jump_time[[0, 1, 3, 4]], [5, 5, 15, 15])
    np.testing.assert_allclose(jump[[0, 1, 3, 4]], [-0.8, -1.2, 1.2, 2.2], atol=1e-9)
    figure = plot_joints(cubic)
    assert "jump" in legend_words(figure)
    assert not any(lines(axis, "jump") for axis in figure.axes[:2])
    smooth = plot_joints(planned("paper_case"))
    assert not any(lines(axis, "jump") for axis in smooth.axes)
    assert "jump" not in legend_words(smooth)


def test_waypoints_and_knots_are_marked(paper_case: Plan) -> None:
    figure = plot_joints(paper_case, degrees=True)
    for axis in figure.axes:
        (uprights,) = collections(axis, "waypoint")
        assert [segment[0][0] for segment in uprights.get_segments()] == [0, 5, 15, 25]
        (ticks,) = collections(axis, "knots")
        assert [segment[0][0] for segment in ticks.get_segments()] == [0, 3, 8, 13, 19, 25]
    assert [text.get_text() for text in waypoint_names(figure.axes[0])] == list("ABCD")
    assert not waypoint_names(figure.axes[1])
    for axis, expected in zip(figure.axes, ([0, 30, 90, 180], [0, 8, 8, 0]), strict=False):
        time, value = data(lines(axis, "given")[0])
        np.testing.assert_array_equal(time, [0, 5, 15, 25])
        np.testing.assert_allclose(value, expected, atol=1e-12)
    assert not lines(figure.axes[2], "given")


def test_a_broken_limit_stands_out_where_it_is_broken_and_nowhere_else(broken: Plan) -> None:
    figure = plot_joints(broken)
    for axis, quantity in zip(figure.axes, QUANTITIES, strict=True):
        found = [str(line.get_gid()) for line in lines(axis, "exceeded")]
        only = "exceeded:modified-hermite:shoulder_pan_joint:velocity"
        assert found == ([only] if quantity == "velocity" else [])
    line = lines(figure.axes[1], "exceeded")[0]
    time, value = data(line)
    time, value = time[np.isfinite(value)], value[np.isfinite(value)]
    # Rest to rest over pi in T = 0.9 s: v = 6 pi/T (s - s^2), s = t/T; it is 3.15 at two times.
    roots = np.sort(np.roots([-6 * np.pi / 0.9**3, 6 * np.pi / 0.9**2, -3.15]))
    np.testing.assert_allclose(time[[0, -1]], roots, atol=0.005)
    assert (value >= 3.15).all()
    assert float(line.get_linewidth()) >= 2 * float(
        lines(figure.axes[1], "curve")[0].get_linewidth()
    )
    curves = [one for axis in figure.axes for one in lines(axis, "curve")]
    assert line.get_color() not in {curve.get_color() for curve in curves}
    assert value.max() == pytest.approx(np.pi / 0.6)
    assert {"limit exceeded", "limit"} <= set(legend_words(figure))
    assert heading(figure).endswith("check FAILED")
    note = notes(figure)[1]  # and of the others, which stand still
    assert note.startswith("shoulder_pan_joint: 5.24 at 0.45 s, limit ±3.15 rad/s")


KINDS, PARTS = ("acceleration", "jerk", "velocity"), (0.999, 1.0, 1.001)


@pytest.mark.parametrize(
    ("kind", "part"),
    mostly_exhaustive(itertools.product(KINDS, PARTS), *zip(KINDS, PARTS, strict=True)),
)
def test_highlights_agree_with_the_check(kind: str, part: float) -> None:
    """Limits just below, at and above the exact peak: drawn as broken if the check says so."""
    task: dict[str, Any] = {
        "waypoints": [
            {"joints": {"a": 0.0, "b": 0.0}},
            {"joints": {"a": 1.0, "b": 0.2}, "velocity": {"a": 2.0}, "after": 1},
            {"joints": {"a": 2.0, "b": -0.2}, "after": 1.5},
        ]
    }
    peak = float(kw.plan(task).trajectory.extrema(kind).peak[0])
    plan = kw.plan({**task, "limits": {kind: {"a": peak * part}}})
    (axis,) = plot_joints(plan, quantities=[kind], joints=["a"]).axes
    assert plan.report.ok == (part >= 1.0)
    assert bool(lines(axis, "exceeded")) == (part < 1.0)
    shown = {float(data(line)[1][0]) for line in lines(axis, "limit")}
    assert peak * part in shown or -peak * part in shown


def test_overlaid_planners_differ_without_colour(paper_case: Plan, cubic: Plan) -> None:
    quintic = planned("paper_case", planner="quintic")
    figure = plot_joints([paper_case, cubic, quintic], quantities=["acceleration"])
    (axis,) = figure.axes
    curves = lines(axis, "curve")
    assert [str(line.get_gid()).split(":")[1] for line in curves] == [
        "modified-hermite",
        "cubic",
        "quintic",
    ]
    styles = {str(line._unscaled_dash_pattern) for line in curves}  # type: ignore[attr-defined]
    assert len(styles) == 3
    (why,) = (word for word in legend_words(figure) if word.startswith("cubic"))
    worst = cubic.report.failures[0]
    assert re.match(rf"cubic: {worst.name} {worst.quantity_text} .* at [\d.]+ s", why)
    assert "quintic" in legend_words(figure)  # it passes
    assert len(collections(axis, "knots")) == 3
    assert "check of cubic FAILED" in heading(figure)


def test_a_trajectory_with_its_scenario_has_limits_and_names(deburring: Plan) -> None:
    figure = plot_joints(deburring.trajectory, scenario=deburring.scenario)
    assert "edge start" in [text.get_text() for text in waypoint_names(figure.axes[0])]
    assert re.search(r"shoulder_pan_joint: .* at [\d.]+ s, limit ±180 deg/s", str(notes(figure)))
    # of the poses it is not known which solution was meant; the start is given by joint values
    assert [len(data(line)[0]) for line in lines(figure.axes[0], "given")] == [1] * 6


def test_a_joint_that_stands_still_shows_no_noise(deburring: Plan) -> None:
    plan = kw.plan({"waypoints": [{"joints": {"a": 1.2}}, {"joints": {"a": 1.2}, "after": 2}]})
    for axis, level in zip(plot_joints(plan).axes, (1.2, 0, 0, 0), strict=True):
        low, high = axis.get_ylim()
        assert low < level < high
        assert high - low > 0.1


def test_the_users_own_settings_are_left_alone(deburring: Plan) -> None:
    with mpl.rc_context({"font.size": 33, "lines.linewidth": 9, "axes.facecolor": "black"}):
        before = dict(mpl.rcParams)
        figure = plot_joints(deburring)
        assert dict(mpl.rcParams) == before
    assert figure.axes[0].yaxis.label.get_fontsize() < 15
    assert figure.axes[0].get_facecolor() == (1.0, 1.0, 1.0, 1.0)


def test_refuses_motions_of_different_joints(deburring: Plan, paper_case: Plan) -> None:
    for motions, options, says in (
        ([deburring, paper_case], {}, "the joints of the first motion of the picture are"),
        ([], {}, "at least one"),
        ({"a": 1}, {}, "can't draw dict"),
        (paper_case.trajectory, {"scenario": deburring.scenario}, "the joints of the scenario are"),
    ):
        with pytest.raises(InputError, match=says):
            plot_joints(motions, **options)  # type: ignore[arg-type]


seeds = st.integers(0, 2**32 - 1)


def random_curve(
    seed: int, degree: int = 3, pieces: int = 5, joints: int = 2
) -> PiecewisePolynomial:
    """A curve that jumps at every break in every derivative."""
    rng = np.random.default_rng(seed)
    breaks = np.cumsum(rng.uniform(0.1, 2.0, pieces + 1))
    return PiecewisePolynomial(rng.normal(size=(degree + 1, pieces, joints)), breaks)


def left_value(curve: PiecewisePolynomial, piece: int, order: int, joint: int) -> float:
    """Value at the end of a piece, from the piece before the break, by NumPy."""
    polynomial = np.poly1d(curve.c[:, piece, joint]).deriv(order)
    return float(polynomial(curve.x[piece + 1] - curve.x[piece]))


@examples()
@given(seeds, st.integers(0, 3), st.integers(1, 9))
def test_points_lie_on_curve_on_both_sides_of_breaks(seed: int, order: int, degree: int) -> None:
    curve = random_curve(seed, degree)
    drawn = strokes(curve, 1, order, 2.5)
    assert (np.diff(drawn.time, axis=1) >= 0).all()
    inner = drawn.time < curve.x[1:, None]
    np.testing.assert_allclose(
        drawn.value[inner], 2.5 * curve(drawn.time[inner], order)[:, 1], rtol=1e-9, atol=1e-9
    )
    np.testing.assert_array_equal(drawn.time[:, 0], curve.x[:-1])
    np.testing.assert_array_equal(drawn.time[:, -1], curve.x[1:])
    for piece in range(len(curve.x) - 1):
        expected = 2.5 * left_value(curve, piece, order, 1)
        assert drawn.value[piece, -1] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@examples()
@given(seeds, st.integers(0, 3), st.integers(1, 7))
def test_the_exact_extrema_are_among_the_points(seed: int, order: int, degree: int) -> None:
    curve = random_curve(seed, degree)
    drawn = strokes(curve, 0, order, 1.0)
    extrema = curve.extrema(order)
    scale = max(1.0, float(extrema.peak[0]))
    assert float(drawn.value.max()) == pytest.approx(float(extrema.maximum[0]), abs=1e-9 * scale)
    assert float(drawn.value.min()) == pytest.approx(float(extrema.minimum[0]), abs=1e-9 * scale)


@examples()
@given(seeds, st.integers(0, 2), st.floats(0.05, 0.95))
def test_marks_where_curve_is_beyond_limit(seed: int, order: int, part: float) -> None:
    curve = random_curve(seed, 4)
    extrema = curve.extrema(order)
    low, high = float(extrema.minimum[0]), float(extrema.maximum[0])
    upper = low + part * (high - low)
    drawn = strokes(curve, 0, order, 1.0)
    time, value = drawn.beyond(-np.inf, upper)
    shown = np.isfinite(value)
    assert shown.any()
    inner = ~np.isclose(time[:, None], curve.x, rtol=0, atol=1e-9).any(axis=1)
    own = curve(time[inner], order)[:, 0]
    clear = np.abs(own - upper) > 1e-6 * max(abs(low), abs(high), 1.0)
    np.testing.assert_array_equal(shown[inner][clear], (own > upper)[clear])

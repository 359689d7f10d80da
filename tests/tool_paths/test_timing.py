from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import knotwork as kw
from knotwork.errors import InputError, PathError, RampError
from sweeps import examples

tp = kw.tool_paths

speeds = st.floats(0.005, 0.5)


def profile(lengths, speeds, acceleration=1.0, **more):
    return tp.speed_profile(lengths, speeds, acceleration=acceleration, **more)


def attempt(lengths, speeds, acceleration, options):
    """The timing, or the error."""
    try:
        return profile(lengths, speeds, acceleration, **options), None
    except RampError as error:
        return None, error


def check_advice(error, lengths, wanted, acceleration, options):
    """What an error advises leaves the stretch long enough, for other stretches or not."""
    assert error.needed > error.length == lengths[error.stretch]
    more = error.lowest_acceleration * (1 + 1e-9)
    assert more > acceleration
    _, other = attempt(lengths, wanted, more, options)
    assert other is None or other.stretch > error.stretch
    if error.highest_speed is not None:
        assert error.highest_speed < wanted[error.stretch]
        slower = list(wanted)
        slower[error.stretch] = error.highest_speed
        _, other = attempt(lengths, slower, acceleration, options)
        assert other is None or other.stretch != error.stretch


@examples()
@given(
    st.lists(st.tuples(st.floats(0.01, 2.0), speeds), min_size=1, max_size=5),
    st.floats(0.1, 5.0),
    st.floats(0, 0.3),
    st.floats(0, 0.3),
    st.sets(st.integers(0, 3)),
)
def test_profile_holds_or_gives_feasible_values(parts, acceleration, v0, v1, stops):
    lengths, wanted = (list(column) for column in zip(*parts, strict=True))
    options = {"start_speed": v0, "end_speed": v1, "stops": stops}
    timing, error = attempt(lengths, wanted, acceleration, options)
    if timing is None:
        check_advice(error, lengths, wanted, acceleration, options)
        return
    s = timing.arc_length
    ends = np.concatenate(([0.0], np.cumsum(lengths)))
    assert s.x[0] == 0.0
    assert s.x[-1] == timing.duration == timing.times[-1]
    np.testing.assert_allclose(s(timing.times), ends, rtol=1e-9)
    for nu, scale in ((0, ends[-1]), (1, 1.0), (2, 10 * acceleration)):
        assert np.abs(s.jumps(nu)).max(initial=0.0) < 1e-8 * scale
    assert float(s.derivative(2).extrema().peak) <= acceleration * (1 + 1e-6)
    assert float(s.derivative().extrema().minimum) >= -1e-12
    assert timing(np.zeros(1), 1)[0] == pytest.approx(v0, abs=1e-12)
    assert timing(s.x[-1:], 1, side="left")[0] == pytest.approx(v1, abs=1e-9)
    for i, (start, end) in enumerate(timing.full_speed):
        assert timing.times[i] <= start <= end <= timing.times[i + 1]
        if end > start:
            np.testing.assert_allclose(
                timing(np.linspace(start, end, 7)[1:-1], 1), wanted[i], rtol=1e-9
            )
        if i in stops and i + 1 < len(parts):
            assert timing(timing.times[[i + 1]], 1)[0] == pytest.approx(0.0, abs=1e-9)
        elif i + 1 < len(parts):
            lower = min(wanted[i], wanted[i + 1])
            assert timing(timing.times[[i + 1]], 1)[0] == pytest.approx(lower, rel=1e-6)


def test_time_of_inverts_arc_length():
    timing = profile([0.1, 0.2], [0.05, 0.1], start_speed=0.0, end_speed=0.0, stops={0})
    t = np.linspace(0.01, timing.duration - 0.01, 50)
    np.testing.assert_allclose(timing.time_of(timing(t)), t, atol=1e-9)
    np.testing.assert_array_equal(timing.time_of([0.0, 0.1, 0.3]), timing.times)


def test_short_stretch_reports_feasible_values():
    with pytest.raises(RampError, match=r"the path is 0\.01 m long") as raised:
        profile([0.01], [0.1], start_speed=0.0, end_speed=0.0)
    error = raised.value
    assert isinstance(error, InputError)
    assert error.needed == pytest.approx(1.5 * 0.1**2)
    assert error.highest_speed == pytest.approx(math.sqrt(0.01 / 1.5))
    assert error.lowest_acceleration == pytest.approx(1.5)
    assert "0.081649" in str(error)


@examples()
@given(
    st.floats(0.01, 1.0),
    speeds,
    st.floats(0.05, 5.0),
    st.none() | st.floats(0, 0.4),
    st.none() | st.floats(0, 0.4),
)
def test_speed_for_duration_takes_it(length, speed, acceleration, v0, v1):
    ends = {"start_speed": v0, "end_speed": v1}
    try:
        duration = profile([length], [speed], acceleration, **ends).duration
    except RampError:
        assume(False)
    found = tp.speed_for_duration(length, duration, acceleration=acceleration, **ends)
    again = profile([length], [found], acceleration, **ends).duration
    assert again == pytest.approx(duration, rel=1e-8)


def test_short_duration_reports_minimum():
    with pytest.raises(PathError, match=r"at least 0\.489898 s") as raised:
        tp.speed_for_duration(0.04, 0.3, acceleration=1.0, start_speed=0.0, end_speed=0.0)
    least = math.sqrt(0.04 / 1.5) * 1.5 * 2
    assert f"{least:.6g}" in str(raised.value)
    tp.speed_for_duration(0.04, least, acceleration=1.0, start_speed=0.0, end_speed=0.0)


def test_long_duration_reports_maximum():
    with pytest.raises(PathError, match=r"and at most"):
        tp.speed_for_duration(0.01, 9, acceleration=1.0, start_speed=0.5, end_speed=0.5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: profile([0.1, 0.0], [1, 1]), "length of stretch 1 is 0 m"),
        (lambda: profile([0.1], [-1]), "speed of stretch 0 is -1 m/s"),
        (lambda: profile([0.1], [1], acceleration=0.0), r"acceleration is 0\.0"),
        (lambda: profile([0.1], [1], start_speed=-1.0), r"start_speed is -1\.0"),
        (lambda: profile([], []), "no stretches"),
        (lambda: tp.speed_for_duration(0.1, 0.0, acceleration=1), r"duration is 0\.0 s"),
        (
            lambda: tp.speed_for_duration(0.01, 1, acceleration=1, start_speed=0.5, end_speed=0.0),
            r"takes 0\.1875 m",
        ),
    ],
)
def test_refuses_invalid_timing(make, message):
    with pytest.raises(PathError, match=message):
        make()

"""The commands, where times are free."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NoReturn

import pytest

import knotwork as kw
from command_line import Command

SWING = """\
# two joints
times: fastest # as fast as may be
limits: {velocity: 2, acceleration: 4, jerk: 40}
waypoints:
  - {name: A, joints: {a: 0, b: 0}}
  - {name: via, joints: {a: 1, b: -0.5}, velocity: free} # passed
  - {name: B, joints: {a: 2, b: 0}}
"""


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    path = tmp_path / "swing.yaml"
    path.write_text(SWING)
    return path


def test_plan_says_what_it_chose_and_freezes_it(
    swing: Path, knotwork: Command, tmp_path: Path
) -> None:
    frozen = tmp_path / "frozen.yaml"
    ran = knotwork(
        "plan", swing, "--freeze", frozen, "--budget", "3600s", "--out", tmp_path / "out"
    )
    assert (ran.code, ran.err) == (0, "")
    assert "above the lower bound" in ran.out
    assert "A to via: bound by a acceleration" in ran.out
    assert f"wrote {frozen}" in ran.out
    assert "# passed" in frozen.read_text()
    again = knotwork("plan", frozen, "--json")
    assert again.code == 0
    stored = json.loads((tmp_path / "out" / "trajectory.json").read_text())
    assert json.loads(again.out)["plans"][0]["trajectory"] == stored
    for scenario in (frozen, tmp_path / "out" / "scenario.yaml"):
        assert knotwork("check", tmp_path / "out", "-s", scenario).code == 0
    free = knotwork("check", tmp_path / "out", "-s", swing)
    assert free.code == 2
    assert "scenario.yaml" in free.err


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("10", 10), ("10s", 10), ("500ms", 0.5), ("5m", 300), ("2min", 120), ("1h", 3600)],
)
def test_a_time_is_read_with_its_unit(
    text: str, seconds: float, swing: Path, knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, budget: float, **__: object) -> NoReturn:
        raise kw.InputError(f"{budget} s")

    monkeypatch.setattr("knotwork.planning.plan", refused)
    ran = knotwork("plan", swing, "--budget", text)
    assert ran.err == f"error: {float(seconds)} s\n"

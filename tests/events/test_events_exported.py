"""Events in files, each read as who takes it over would read it."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from welding import do, weld

import knotwork as kw
from command_line import Command
from knotwork.errors import ExportError
from plans import planned
from texts import written
from urscript_controller import Controller

TASK = weld(
    approach=do({"output": 17, "value": "on", "before": 0.5}),
    seam=do({"output": 9, "value": True}, {"wait": 0.3}, {"arc": "on"}),
    end=do({"arc": "off", "at": -20}),
    retract=do({"output": 9, "value": "off"}),
)
OUTPUTS = [
    ("tool", 1, True),
    ("configurable", 1, True),
    ("standard", 3, True),
    ("standard", 3, False),
    ("configurable", 1, False),
]
TASK["waypoints"][1].pop("stop")


@pytest.fixture(scope="module")
def plan() -> kw.Plan:
    return kw.plan(TASK)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return written(tmp_path / "weld.yaml", TASK)


def test_outputs_are_switched_within_a_step_before(plan: kw.Plan) -> None:
    motion = plan.trajectory
    text = motion.to_urscript()
    for rate in (125.0, 500.0):
        controller = Controller(motion.position(motion.start_time), rate)
        controller.run(text)
        found = [(kind, number, value) for _, kind, number, value in controller.switched]
        assert found == OUTPUTS
        early = [
            event.time - time
            for event, (time, *_) in zip(plan.events, controller.switched, strict=True)
        ]
        assert -1e-9 <= min(early) <= max(early) <= 1.0 / rate + 1e-9
        time = np.clip(controller.time, motion.start_time, motion.end_time)
        off = np.abs(controller.position - motion.position(time)).max()
        plain = Controller(motion.position(motion.start_time), rate)
        plain.run(replace(motion, events=()).to_urscript())
        without = np.abs(plain.position - motion.position(np.clip(plain.time, 0, motion.end_time)))
        assert off <= 1.01 * without.max()  # pieces in two parts are the same motion


def test_a_program_names_its_segments(plan: kw.Plan) -> None:
    text = plan.trajectory.to_urscript()
    named = re.findall(r"^  # (.*): (?:[a-z ]+, )?(\d+\.\d+) s to", text, re.MULTILINE)
    assert named == [(segment.name, f"{segment.start:.3f}") for segment in plan.segments]


def test_events_close_together_leave_the_motion_as_it_is() -> None:
    near = do({"arc": "on", "at": 20}, {"gas": "on", "at": 20 + 1e-7}, {"arc": "off", "at": 20.05})
    motion = kw.plan(weld(seam=near) | {"outputs": {"arc": 3, "gas": 4}}).trajectory
    controller = Controller(motion.position(motion.start_time), 125.0)
    controller.run(motion.to_urscript())
    assert [value for *_, value in controller.switched] == [True, True, False]
    time = np.clip(controller.time, motion.start_time, motion.end_time)
    assert np.abs(controller.position - motion.position(time)).max() < 1e-4


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (
            {"gripper": "close"},
            r"close at 3\.000 s, waypoint 'seam': .* given by outputs: {gripper: n}",
        ),
        ({"output": 18, "value": True}, r"output 18 on .*accepted: .*16 or 17 \(at the tool\)"),
    ],
)
def test_what_is_no_output_of_the_controller_is_refused(action: Any, message: str) -> None:
    motion = kw.plan(weld(seam=do(action))).trajectory
    with pytest.raises(ExportError, match=message):
        motion.to_urscript()
    assert "digital_out" not in replace(motion, events=()).to_urscript()


def test_tables_have_them_row_by_row(plan: kw.Plan, knotwork: Command, file: Path) -> None:
    out = file.with_suffix(".csv")
    assert knotwork("export", file, "-f", "csv", "--rate", 50, "-o", out).code == 0
    rows = list(csv.DictReader(out.read_text().splitlines()))
    switched = [(float(row["time_s"]), row["event"]) for row in rows if row["event"]]
    assert [text for _, text in switched] == [one.text for one in plan.events]
    for event, (time, _) in zip(plan.events, switched, strict=True):
        assert -1e-9 <= time - event.time < 0.02
    for row in rows:
        own = next(segment for segment in plan.segments if segment.name == row["segment"])
        assert own.start - 1e-9 <= float(row["time_s"]) <= own.end + 1e-9
    knots = file.with_name("knots.csv")
    exact = ("--knots-only", "--accelerations", "-o", knots)
    assert knotwork("export", file, "-f", "csv", *exact).code == 0
    assert "wait at seam,output 9 on" in knots.read_text()
    assert knotwork("check", knots, "--scenario", file).code == 0
    samples = json.loads(plan.trajectory.to_json())
    assert samples["events"] == [one.to_dict() for one in plan.events]
    assert "event" not in planned("paper_case").trajectory.to_csv()
    assert "B to C" in planned("paper_case").trajectory.to_csv(labels=True)


@pytest.mark.parametrize("name", ["ros2", "pvt", "mat", "scipy"])
def test_file_of_events_beside(plan: kw.Plan, knotwork: Command, file: Path, name: str) -> None:
    plan.save(file.parent / "stored")
    source = file.parent / "stored"
    out = file.with_name("motion.out")
    ran = knotwork("export", source, "-f", name, "-o", out)
    beside = file.with_name("motion.events.json")
    assert (ran.code, f"wrote {out} and {beside}" in ran.out) == (0, True)
    data = json.loads(beside.read_text())
    assert [one["time_from_start"] for one in data["events"]] == [one.time for one in plan.events]
    assert [one["name"] for one in data["segments"]] == [segment.name for segment in plan.segments]
    other = file.with_name("motion.other")
    assert knotwork("export", source, "-f", name, "-o", other).code == 0  # of the same motion
    other.unlink()
    beside.write_text("{}", encoding="utf-8")
    again = knotwork("export", source, "-f", name, "-o", other)
    assert (again.code, f"{beside} exists" in again.err) == (2, True)
    alone = knotwork("export", source, "-f", name, "-o", out, "--force", "--without-events")
    assert (alone.code, "events.json" in alone.out) == (0, False)


def test_the_check_knows_where_the_tool_is(plan: kw.Plan) -> None:
    (position,) = plan.report.select(subject="event", quantity="event_position")
    assert position.ok
    assert position.value == pytest.approx(0.0, abs=1e-5)
    assert "arc off at" in position.message
    assert "20 mm before 'end'" in position.message
    late = replace(plan.trajectory, polynomial=later(plan.trajectory))
    found = kw.check(late, plan.scenario)
    (moved,) = found.select(subject="event", quantity="event_position")
    assert not moved.ok
    assert moved.value == pytest.approx(0.08 * 0.01, rel=1e-2)  # 80 mm/s for 10 ms
    messages = [finding.message for finding in plan.report.select(group="Segments")]
    assert messages == [segment.text for segment in plan.segments]
    assert any("output 17 on" in line for line in plan.report.brief())


def test_stored_events_are_those_of_the_scenario(plan: kw.Plan) -> None:
    first, second, *rest = plan.events
    moved = replace(second, time=second.time + 1e-3)
    motion = replace(plan.trajectory, events=(first, moved, *rest[:-1]))
    failures = [finding.message for finding in kw.check(motion, plan.scenario).failures]
    assert failures == [
        "output 9 on at 3.001 s: the motion has it, but the scenario does not request it",
        "output 9 on at 3.000 s: the scenario requests it, but the motion does not have it",
        f"{rest[-1].text} at {rest[-1].time:.3f} s: the scenario requests it, but the motion does "
        "not have it",
    ]
    none = kw.check(replace(motion, events=()), plan.scenario)
    assert len(none.failures) == len(plan.events)
    foreign = kw.check(replace(motion, events=(), segments=()), plan.scenario)
    assert foreign.ok
    (warned,) = foreign.select(group="Events", verdict="warning")
    assert "switching of signals is not checked" in warned.message
    curve = motion.polynomial
    for kept in (slice(None, -9), slice(np.searchsorted(curve.x, 5.0), None)):
        cut = kw.PiecewisePolynomial(curve.c[:, kept], curve.x[kept])
        part = kw.check(kw.JointTrajectory(motion.joint_names, cut), plan.scenario)
        assert [one.name for one in part.failures if "but the motion" in one.message]


def later(motion: kw.JointTrajectory) -> kw.PiecewisePolynomial:
    """The same motion 10 ms later, the arm at rest before."""
    times = np.concatenate(([motion.start_time], motion.breaks + 0.01))[:-1]
    still = motion.polynomial.c[:, :1] * (np.arange(4) == 3)[:, None, None]
    c = np.concatenate((still, motion.polynomial.c), axis=1)
    return kw.PiecewisePolynomial(c, np.append(times, motion.end_time))

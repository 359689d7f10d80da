"""Programs and streams for controllers of other makers, read as these would read them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import knotwork as kw
from knotwork.curves.trajectory import Event, JointTrajectory
from knotwork.errors import ExportError, InputError
from knotwork.files import export
from plans import planned

NUMBER = r"(-?\d+\.\d+)"


@pytest.fixture(scope="module")
def motion() -> JointTrajectory:
    return planned("ur5_deburring").trajectory


def numbers(pattern: str, text: str) -> np.ndarray:
    return np.array(re.findall(pattern, text), dtype=float)


@dataclass
class Run:
    """A program that is run: where the axes are at times, and which outputs are switched when.

    Attributes:
        now: Time since the start [s].
        times: Of the points [s].
        axes: Of the points [deg or mm].
        switched: Time [s], output and value.
    """

    now: float = 0.0
    times: list[float] = field(default_factory=list)
    axes: list[Any] = field(default_factory=list)
    switched: list[tuple[float, str, bool]] = field(default_factory=list)

    def move(self, seconds: float, axes: Any) -> None:
        self.now += seconds
        self.times.append(self.now)
        self.axes.append(axes)

    def wait(self, seconds: float) -> None:
        self.move(seconds, self.axes[-1])

    def switch(self, output: str, value: bool) -> None:
        self.switched.append((self.now, output, value))

    def deviation(self, motion: JointTrajectory) -> float:
        """How far straight lines between the points are off a motion, at most [rad]."""
        dense = np.linspace(0.0, motion.duration, 40_001)
        columns = np.radians(np.array(self.axes).T)
        lines = np.stack([np.interp(dense, self.times, column) for column in columns], axis=1)
        return float(np.abs(lines - motion.position(motion.start_time + dense)).max())


def read_krl(text: str) -> Run:
    """Blocks of a spline take their time in parts; a trigger is for the point after it."""
    run, waiting, inside = Run(), list[tuple[str, bool]](), False
    point = r"(S?PTP) \{" + ", ".join(f"A{i} {NUMBER}" for i in range(1, 7)) + r"\}"
    for line in map(str.strip, text.splitlines()):
        if line == "PTP_SPLINE":
            inside, begin = True, run.now
        elif line == "ENDSPLINE":
            inside = False
        elif found := re.fullmatch(point, line):
            assert inside == (found[1] == "SPTP")
            axes = [float(value) for value in found.groups()[1:]]
            if not inside:
                run.move(0.0, axes)
        elif found := re.fullmatch(rf"TIME_BLOCK PART = {NUMBER}", line):
            run.move(float(found[1]), axes)
            while waiting:
                run.switch(*waiting.pop(0))
        elif found := re.fullmatch(rf"TIME_BLOCK END = {NUMBER}", line):
            assert float(found[1]) == pytest.approx(run.now - begin, abs=1e-9)
        elif found := re.fullmatch(rf"WAIT SEC {NUMBER}", line):
            assert not inside
            run.wait(float(found[1]))
        elif found := re.fullmatch(
            r"(TRIGGER WHEN PATH=0 DELAY=0 DO )?\$OUT\[(\d+)\]=(TRUE|FALSE)", line
        ):
            assert inside == bool(found[1])
            waiting.append((found[2], found[3] == "TRUE"))
            if not inside:
                run.switch(*waiting.pop())
    return run


def read_rapid(text: str) -> Run:
    targets = numbers(r"\[\[" + ",".join([NUMBER] * 6) + r"\],\[9E9,", text)
    triggers = {
        name: (signal, on == "1")
        for name, signal, on in re.findall(r"TriggIO (\w+), 0\\Time\\DOp:=(\w+), (\d);", text)
    }
    run, indices = Run(), []
    for line in map(str.strip, text.partition("PROC")[2].splitlines()):
        if found := re.fullmatch(
            r"(MoveAbsJ|TriggAbsJ) kw_q\{(\d+)\}\\NoEOffs, v\d+(?:\\T:=([\d.]+))?, (.*)tool0;", line
        ):
            indices.append(int(found[2]))
            run.move(float(found[3] or 0.0), targets[indices[-1] - 1])
            names = re.findall(r"kw_t\d+", found[4])
            assert bool(names) == (found[1] == "TriggAbsJ")
            fine = "fine" in found[4]
            assert fine or "z0" in found[4]
            assert not (fine and names)
            for name in names:
                run.switch(*triggers[name])
        elif found := re.fullmatch(rf"WaitTime\\InPos, {NUMBER};", line):
            assert fine
            run.wait(float(found[1]))
        elif found := re.fullmatch(r"SetDO (\w+), (\d);", line):
            assert fine
            run.switch(found[1], found[2] == "1")
    assert sorted(indices) == indices
    return run


def read_ls(text: str) -> Run:
    points = numbers(", ".join(f"J{i} = {NUMBER} deg" for i in range(1, 7)), text)
    points[:, 2] += points[:, 1]  # J3 counts from the horizontal
    run, fine = Run(), True
    lines = text.partition("/MN\n")[2].partition("/POS")[0].splitlines()
    for number, line in enumerate(lines, 1):
        head, _, rest = line.partition(":")
        assert int(head) == number
        if found := re.fullmatch(
            r"J P\[(\d+)\] (\d+)(msec|%) (FINE|CNT100)(?: TB \.00sec,DO\[(\d+)\]=(ON|OFF))? ;", rest
        ):
            seconds = float(found[2]) / 1e3 if found[3] == "msec" else 0.0
            run.move(seconds, points[int(found[1]) - 1])
            fine = found[4] == "FINE"
            if found[5]:
                run.switch(found[5], found[6] == "ON")
        elif found := re.fullmatch(r"  WAIT ([\d.]+)\(sec\) ;", rest):
            assert fine
            run.wait(float(found[1]))
        elif found := re.fullmatch(r"  DO\[(\d+)\]=(ON|OFF) ;", rest):
            run.switch(found[1], found[2] == "ON")
        else:
            assert re.fullmatch(r"  !.{1,32} ;", rest), rest
    return run


def read_stream(text: str) -> tuple[np.ndarray, np.ndarray]:
    rows = [line for line in text.splitlines() if not line.startswith("#")]
    table = np.array([row.split(",") for row in rows[1:]], dtype=float)
    return table[:, 0], table[:, 1:]


def run_stream(text: str) -> Run:
    time, axes = read_stream(text)
    return Run(time[-1], time.tolist(), axes.tolist())


READERS = {
    "krl": (read_krl, 1e-6),
    "rapid": (read_rapid, 1e-6),
    "ls": (read_ls, 1e-4),
    "rsi": (run_stream, 0.0),
    "egm": (run_stream, 0.0),
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("tolerance", [None, 1e-4])
def test_lines_are_off_as_stated(motion: JointTrajectory, name: str, tolerance: Any) -> None:
    read, digit = READERS[name]
    streamed = "cycle" in export.STRAIGHT[name]
    if streamed and tolerance is not None:
        with pytest.raises(InputError, match="takes no option 'tolerance'"):
            export.content(motion, name, tolerance=tolerance)
        return
    text = export.content(motion, name, **({} if tolerance is None else {"tolerance": tolerance}))
    run = read(text)
    points = export.straight_points(motion, **export.STRAIGHT[name], tolerance=tolerance)
    assert name == "ls" or points.describe() in text
    assert points.error <= (tolerance or 1e-3)
    assert run.now == pytest.approx(motion.duration, abs=1e-3)
    stated = float(re.search(r"(?:at most|lines) ([\d.e-]+)", text)[1])  # type: ignore[index]
    assert 0.95 * stated - np.radians(digit) < run.deviation(motion) <= stated


def test_stream_motion_counts_the_third_axis_from_the_horizontal(motion: JointTrajectory) -> None:
    time, axes = read_stream(export.to_j519(motion))
    q = np.degrees(motion.position(np.minimum(time, motion.end_time)))
    np.testing.assert_allclose(axes[:, 2], q[:, 2] - q[:, 1], atol=1e-9)
    np.testing.assert_allclose(np.diff(time), 0.008)


def test_what_slides_is_an_external_axis(motion: JointTrajectory) -> None:
    names, units = ("rail", *motion.joint_names), ("m",) + ("rad",) * 6
    position = np.zeros((2, 7))
    position[1, 0] = 0.5
    rail = JointTrajectory.from_knots(names, [0, 2], position, 0 * position, joint_units=units)
    assert "A6 0.000000, E1 0.000000}" in export.to_krl(rail)
    assert "[500.000000,9E9,9E9,9E9,9E9,9E9]]" in export.to_rapid(rail)
    assert "E1 = 500.0000 mm" in export.to_ls(rail)


def test_what_turns_beside_the_arm_is_an_external_axis_too() -> None:
    """In degrees, and axes of the arm are counted without it."""
    plan = planned("ur5_turntable_rim")
    motion, robot = plan.trajectory, plan.joints.robot
    assert motion.joint_names[0] == "table"
    points = export.straight_points(motion, **export.STRAIGHT["ls"])
    table, *arm = np.degrees(points.position[-1])
    assert table < -180
    *_, krl = re.findall(
        rf"A1 {NUMBER}.* A6 {NUMBER}, E1 {NUMBER}\}}", export.to_krl(motion, robot=robot)
    )
    assert "External axes: table [deg]" in export.to_rapid(motion, robot=robot)
    assert [float(one) for one in krl] == pytest.approx([arm[0], arm[5], table], abs=1e-6)
    rapid = export.to_rapid(motion, robot=robot)
    *_, own = re.findall(rf",{NUMBER}\],\[{NUMBER},9E9,9E9,9E9,9E9,9E9\]", rapid)
    assert [float(one) for one in own] == pytest.approx([arm[5], table], abs=1e-6)
    ls = re.findall(rf"J3 = {NUMBER} deg.* E1 = {NUMBER} deg", export.to_ls(motion, robot=robot))
    assert [float(one) for one in ls[-1]] == pytest.approx([arm[2] - arm[1], table], abs=1e-4)
    _, axes = read_stream(export.to_j519(motion, robot=robot))
    assert axes[-1, [0, 3]] == pytest.approx([table, arm[2] - arm[1]], abs=1e-6)
    for make in (export.to_krl, export.to_ls, export.to_j519):
        with pytest.raises(ExportError, match=r"7 revolute joints.*; .*`external_axes`"):
            make(motion)


def test_other_arms_and_moving_ends_are_refused(motion: JointTrajectory) -> None:
    panda = planned("panda_pick_place").trajectory
    with pytest.raises(ExportError, match=r"7 revolute joints and 0 external axes; accepted: 6"):
        export.to_krl(panda)
    cut = JointTrajectory.from_knots(["a"], [0, 1], [[0], [1]], [[0], [0.5]])
    with pytest.raises(ExportError, match=r"ends with joint 'a' at 0.5 rad/s.*stop: true after it"):
        export.to_egm(cut)
    with pytest.raises(InputError, match="this tolerance takes more than 1000000 points"):
        export.to_rapid(motion, tolerance=1e-15)
    with pytest.raises(InputError, match="tolerance"):
        export.to_rapid(motion, tolerance=-1.0)


@pytest.mark.parametrize(
    ("name", "gas", "arc"), [("krl", "1", "2"), ("rapid", "gas", "arc"), ("ls", "1", "2")]
)
def test_programs_switch_outputs_and_wait_at_their_places(name: str, gas: str, arc: str) -> None:
    plan = kw.plan(kw.Task.load("ur10_weld").replace(outputs={"gas": 1, "arc": 2}))
    read, _ = READERS[name]
    text = export.content(plan.trajectory, name)
    run = read(text)
    outputs = {"gas": gas, "arc": arc}
    assert [event[1:] for event in run.switched] == [
        (outputs[e.name], e.value) for e in plan.events
    ]
    times = [event[0] for event in run.switched]
    assert times == pytest.approx([event.time for event in plan.events], abs=1e-3)
    assert run.deviation(plan.trajectory) < 1.002e-3
    assert len(re.findall(r"(?:SEC|InPos,|WAIT) [\d.]+", text)) == 2
    for segment in plan.segments:
        assert segment.name in text
    for word in ("a b", "While", "KW_t1"):
        unnamed = replace(plan.events[0], name=word, output=None)
        with pytest.raises(ExportError, match=r"output from 1 on|named by letters"):
            export.content(replace(plan.trajectory, events=(unnamed,)), name)


def test_names_end_no_line_of_a_fanuc_program(motion: JointTrajectory) -> None:
    segments = [replace(segment, name="up; CALL X") for segment in motion.segments]
    assert "!up, CALL X ;" in export.to_ls(replace(motion, segments=segments))


def test_abb_switches_eight_signals_in_a_move(motion: JointTrajectory) -> None:
    time = 0.5 * motion.duration
    events = tuple(Event(time, f"lamp{i}", True, "waypoint 2") for i in range(9))
    assert "\\T8:=kw_t8" in export.to_rapid(replace(motion, events=events[:8]))
    with pytest.raises(ExportError, match=r"9 signals at [\d.]+ s; .* at most 8"):
        export.to_rapid(replace(motion, events=events))


def test_refuses_tolerance_below_milliseconds(motion: JointTrajectory) -> None:
    krl = export.STRAIGHT["krl"]
    assert export.straight_points(motion, **krl, tolerance=1e-5).error <= 1e-5
    with pytest.raises(InputError, match=r"nearer than 1 ms.* accepted: [\d.e-]+ or more") as found:
        export.to_krl(motion, tolerance=1e-8)
    accepted = float(re.search(r"accepted: ([\d.e-]+)", str(found.value))[1])  # type: ignore[index]
    assert export.straight_points(motion, **krl, tolerance=accepted).error <= accepted


def swing(names: tuple[str, ...], at: list[float], joint: int, by: float, time: float) -> kw.Plan:
    """A plan that moves one joint from rest to rest, with limits far above those of the arm."""
    to = [*at]
    to[joint] += by
    ends = [{"joints": dict(zip(names, at, strict=True))}]
    ends += [{"joints": dict(zip(names, to, strict=True)), "after": time}]
    wide = {"velocity": 100, "acceleration": 1e4, "jerk": 1e7, "effort": 1e5}
    task = {"robot": "panda", "limits": wide, "end_acceleration": "zero", "waypoints": ends}
    return kw.plan({**task, "planner": "quintic"})


def test_rows_for_franka_keep_its_limits_or_are_refused(panda_arm: kw.Robot) -> None:
    plan = planned("panda_pick_place")
    text = export.to_franka(plan.trajectory, robot=panda_arm)
    time, q = read_stream(text)
    np.testing.assert_allclose(q, plan.trajectory.position(time), atol=1e-15)
    for n, kind in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        rates = np.abs(np.diff(q, n, axis=0)) / 1e-3**n
        use = (rates / panda_arm.limits[kind]).max()
        share = float(re.search(rf"{kind} ([\d.e-]+) % of its limit", text)[1])  # type: ignore[index]
        assert share == pytest.approx(100 * use, rel=0.05)
    assert "torque rate" in text
    # a start with an acceleration is a step of it for the interface
    home = panda_arm.configuration("home")
    for start, words in (
        (home, r"torque rate of joint .*"),
        (0 * home, r"'panda_joint4' is at 0 rad at 0.000 s; .* accepts -3.0718 to -0.0698 rad"),
    ):
        abrupt = JointTrajectory.from_knots(
            panda_arm.joint_names, [0.0, 0.3], [start, start + 0.1], np.zeros((2, 7))
        )
        with pytest.raises(ExportError, match=words):
            export.to_franka(abrupt, robot=panda_arm)


def test_franka_has_limits_of_its_interface(panda_arm: kw.Robot) -> None:
    home = panda_arm.configuration("home").tolist()
    fast = swing(panda_arm.joint_names, home, 0, 2.4, 1.6)
    assert fast.report.ok
    with pytest.raises(ExportError, match=r"velocity .*'panda_joint1' is 2\.\d+ .* accepts 2.175"):
        export.to_franka(fast.trajectory, robot=fast.joints.robot)
    with pytest.raises(ExportError, match=r"needs the arm.*--scenario"):
        export.to_franka(fast.trajectory)
    weld = planned("ur5_deburring")
    with pytest.raises(ExportError, match=r"seven joints, named panda_joint1"):
        export.to_franka(weld.trajectory, robot=weld.joints.robot)


@pytest.mark.parametrize(("end", "span", "allowed"), [(2.6, 4.0, True), (2.74, 2.0, False)])
def test_fr3_is_slow_near_ends(panda_arm: kw.Robot, end: float, span: float, allowed: bool) -> None:
    """Towards 2.7501 rad joint 1 may move at sqrt(12 (2.7501 - q)) - 0.3 rad/s."""
    home = panda_arm.configuration("home").tolist()
    names = tuple(f"fr3_joint{i}" for i in range(1, 8))
    text = panda_arm.urdf.read_text(encoding="utf-8").replace("panda_joint", "fr3_joint")
    plan = swing(panda_arm.joint_names, home, 0, end, span)
    motion = replace(plan.trajectory, joint_names=names)
    with TemporaryDirectory() as folder:
        (Path(folder) / "fr3.urdf").write_text(text, encoding="utf-8")
        locked = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
        file = {"urdf": f"{folder}/fr3.urdf", "base_frame": "panda_link0", "locked": locked}
        arm = kw.load_robot({**file, "tool_frame": "panda_hand_tcp"})
    time = np.linspace(0.0, plan.trajectory.end_time, 4001)
    q, v = (plan.trajectory(time, nu)[:, 0] for nu in (0, 1))
    kept = (v <= np.minimum(2.62, np.sqrt(12.0 * np.maximum(2.7501 - q, 0.0)) - 0.3)).all()
    assert kept == allowed
    if allowed:
        assert "of FR3, 1 ms" in export.to_franka(motion, robot=arm)
    else:
        with pytest.raises(ExportError, match=r"velocity of joint 'fr3_joint1'"):
            export.to_franka(motion, robot=arm)


@pytest.fixture(scope="module")
def panda_arm() -> kw.Robot:
    return kw.load_robot("panda")


def test_controls_of_mujoco_lead_by_what_its_actuators_lag() -> None:
    motion = planned("planar2_closed_form").trajectory
    keys = ElementTree.fromstring(export.to_mujoco(motion, rate=20, lead=0.03)).iter("key")
    for key in keys:
        q, v, control = (
            np.array(key.get(one, "").split(), float) for one in ("qpos", "qvel", "ctrl")
        )
        np.testing.assert_allclose(q, motion.position(float(key.get("time", ""))), atol=1e-15)
        np.testing.assert_allclose(control, q + 0.03 * v, atol=1e-15)
    with pytest.raises(InputError, match="lead, kv/kp of the actuators, is -1"):
        export.to_mujoco(motion, lead=-1.0)

"""Programs for Universal Robots: run by an emulated controller, their text makes the motion."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError
from plans import planned
from urscript_controller import Controller, PopupError

SCENARIOS = ("ur5_deburring", "ur10_spray", "ur3_lid")
RATES = (125.0, 500.0)
ARM = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)


def run(motion: JointTrajectory, rate: float, text: str | None = None) -> Controller:
    controller = Controller(motion.position(motion.start_time), rate)
    controller.run(motion.to_urscript() if text is None else text)
    return controller


def deviation(motion: JointTrajectory, controller: Controller) -> np.ndarray:
    """How far the targets are off the motion at each step [rad], shape (n, 6)."""
    time = np.clip(controller.time + motion.start_time, motion.start_time, motion.end_time)
    return controller.position - motion.position(time)


def most_by_steps(motion: JointTrajectory, rate: float) -> float:
    """The law of the trapezoidal rule, h² |a(t) - a(0)| / 12, and what feedback adds at most."""
    time = np.linspace(motion.start_time, motion.end_time, 20001)
    change = np.abs(motion.acceleration(time) - motion.acceleration(motion.start_time)).max()
    return float(2.0 * change / (12.0 * rate**2))


def cubic_arm(
    *, names: tuple[str, ...] = ARM, start: float = 0.0, end: float = 0.0
) -> JointTrajectory:
    """A motion of six joints with knots between the steps of any controller."""
    time = np.array([0.5, 0.5 + 1 / 3, 1.7, 2.0**0.5 + 1.0, 3.3217])
    q = np.cumsum(np.sin(np.arange(30.0)).reshape(5, 6) * 0.3, axis=0)
    v = np.cos(np.arange(30.0)).reshape(5, 6) * 0.5
    v[0], v[-1] = start, end
    waypoints = kw.JointWaypoints(names, time, q, v)
    return kw.interpolation.get_planner("modified-hermite")(waypoints)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("scenario", [*SCENARIOS, "knots between steps"])
def test_the_controller_makes_the_motion(scenario: str, rate: float) -> None:
    motion = planned(scenario).trajectory if scenario in SCENARIOS else cubic_arm()
    controller = run(motion, rate)
    off = np.abs(deviation(motion, controller))
    law = most_by_steps(motion, rate)
    stated = re.search(rf"at most .*?([\d.e-]+) rad at {rate:g} Hz", motion.to_urscript())
    assert off.max() <= law <= float(stated[1]) <= 1.1 * law
    assert not controller.velocity[-1].any()
    assert -1e-9 < controller.time[-1] - motion.duration < 2.5 / rate


def test_four_times_the_rate_is_sixteen_times_as_near() -> None:
    slow, fast = (np.abs(deviation(cubic_arm(), run(cubic_arm(), rate))).max() for rate in RATES)
    assert 14.0 < slow / fast < 18.0


def test_the_arm_accelerates_as_planned() -> None:
    """Numbers rounded to six decimals make the acceleration ragged, which larger arms refuse."""
    quintic = planned("ur5_deburring", planner="quintic").trajectory
    text = quintic.to_urscript(tolerance=1e-9)

    def ragged(text: str) -> float:
        controller = run(quintic, 500.0, text)
        sent = np.diff(controller.velocity, axis=0) * 500.0
        inside = controller.time[1:] < quintic.duration
        middle = (controller.time[:-1] + quintic.start_time + 0.001)[inside]
        return float(np.abs(sent[inside] - quintic.acceleration(middle)).max())

    coarse = re.sub(r"\d+\.\d{7,}", lambda number: f"{float(number[0]):.6f}", text)
    exact, rounded = ragged(text), ragged(coarse)
    print(f"off by {exact:.2e} rad/s² with all digits, {rounded:.2e} with six decimals")  # noqa: T201
    assert exact < 1e-3
    assert rounded > 10.0 * exact


def test_joints_of_any_order_and_prefix_are_listed_in_the_controllers_order() -> None:
    motion = cubic_arm(names=tuple(f"left_{name}" for name in ARM))
    order = [3, 0, 5, 2, 1, 4]
    names = [motion.joint_names[i] for i in order]
    shuffled = motion.reordered(names, ["rad"] * 6)
    assert shuffled.joint_names != motion.joint_names
    assert shuffled.to_urscript().splitlines()[5:] == motion.to_urscript().splitlines()[5:]


def test_a_name_is_never_a_part_of_the_program() -> None:
    hostile = "a\n  movej([0, 0, 0, 0, 0, 0])\r\x0b\u2028é "
    named = cubic_arm(names=tuple(f"{hostile}{name}" for name in ARM)).to_urscript()
    plain = cubic_arm(names=ARM).to_urscript()
    assert named.isascii()
    assert named.splitlines()[6:] == plain.splitlines()[6:]
    assert named.splitlines()[5].startswith("# Joints: a\\n  movej(")


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("a", "b", "c", "d", "e", "f"), "a, b, c, d, e, f"),
        ((*ARM[:5], "left_wrist_3_joint"), "same prefix"),
    ],
)
def test_other_arms_are_refused(names: tuple[str, ...], words: str) -> None:
    with pytest.raises(ExportError, match=words) as error:
        cubic_arm(names=names).to_urscript()
    assert "shoulder_pan_joint" in str(error.value)


def test_other_numbers_of_joints_and_units_are_refused() -> None:
    with pytest.raises(ExportError, match="six joints"):
        planned("paper_case").trajectory.to_urscript()
    sliding = dataclasses.replace(cubic_arm(), joint_units=("rad",) * 5 + ("m",))
    with pytest.raises(ExportError, match="'wrist_3_joint' is in m; it must be in rad"):
        sliding.to_urscript()


@pytest.mark.parametrize(("end", "word"), [("start", "starts"), ("end", "ends")])
def test_a_motion_that_is_not_from_rest_to_rest_is_refused(end: str, word: str) -> None:
    with pytest.raises(ExportError, match=f"{word} with joint .* at 0.2 rad/s"):
        cubic_arm(**{end: 0.2}).to_urscript()


def test_quintics_need_a_fit() -> None:
    quintic = planned("ur5_deburring", planner="quintic").trajectory
    with pytest.raises(ExportError, match="--tolerance"):
        quintic.to_urscript()
    with pytest.warns(DeprecationWarning, match="option 'fit' is now 'tolerance'"):
        controller = run(quintic, 500.0, quintic.to_urscript(fit=1e-5))
    assert np.abs(deviation(quintic, controller)).max() < 5e-5


def test_the_arm_does_not_start_elsewhere() -> None:
    motion = cubic_arm()
    controller = Controller(motion.position(0.5) + np.array([0, 0, 0.0011, 0, 0, 0]), 500.0)
    with pytest.raises(PopupError, match="does not stand at the first point"):
        controller.run(motion.to_urscript())


def test_an_arm_pushed_off_its_motion_is_stopped() -> None:
    motion = cubic_arm()
    controller = Controller(motion.position(motion.start_time), 500.0)
    controller.push(1.0, np.array([0, 0, 0, 0.06, 0, 0]))
    with pytest.raises(PopupError, match="off its motion"):
        controller.run(motion.to_urscript())
    assert np.abs(controller.qd).max() < 1e-12


def test_the_command_writes_the_program(knotwork: Command, tmp_path: Path) -> None:
    file = tmp_path / "motion.script"
    knotwork("export", "ur5_deburring", "--format", "urscript", "-o", file).done()
    plan = planned("ur5_deburring")
    assert file.read_text() == plan.trajectory.to_urscript(robot=plan.joints.robot)
    assert "set_tcp(p[0.0, 0.0, 0.18, 0.0, 0.0, 0.0])" in file.read_text()

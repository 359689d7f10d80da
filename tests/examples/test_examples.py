"""The examples run as they say, and what they show is true."""

from __future__ import annotations

import importlib.util
import os
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import knotwork as kw
from command_line import python
from plans import planned

EXAMPLES = Path(__file__).parents[2] / "examples"
SCRIPTS = sorted(path.name for path in EXAMPLES.glob("*.py"))


def run(name: str, folder: Path, *arguments: str) -> str:
    """Run an example in a folder of its own, with warnings as errors; what it prints."""
    under = ("-m", "pytest", "-p", "no:cacheprovider", "-q") if name.startswith("test_") else ()
    environment = {**os.environ, "PYTHONIOENCODING": "utf-8"}
    environment.pop("PYTEST_ADDOPTS", None)
    options = {"cwd": folder, "env": environment, "encoding": "utf-8"}
    ran = python("-W", "error", *under, EXAMPLES / name, *arguments, **options)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert not ran.stderr
    return ran.stdout


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.?\d*", text)]


def test_a_scenario_in_code(tmp_path: Path) -> None:
    output = run("scenario_in_code.py", tmp_path, "out")
    assert "3 s by modified-hermite, 6 knots" in output
    samples = (tmp_path / "out" / "samples.csv").read_text(encoding="utf-8")
    assert len(samples.splitlines()) == 302
    assert (tmp_path / "out" / "trajectory.json").is_file()
    assert (tmp_path / "out" / "report.json").is_file()


def test_a_motion_in_mujoco(tmp_path: Path) -> None:
    output = run("play_in_mujoco.py", tmp_path)
    assert output.startswith("1801 keyframes")
    assert 1e-6 < float(re.search(r"at most (\S+) rad", output)[1]) < 1e-3  # type: ignore[index]


FRANKA = """
class Robot:
    def __init__(self, address):
        self.sent, self.q_d = [], {start}
    start_joint_position_control = lambda self, mode: self
    readOnce = lambda self: (self, self)
    to_sec = lambda self: 0.002 if len(self.sent) == 7 else 0.001
    stop = lambda self: None
    def writeOnce(self, command):
        self.sent.append(command)
        if command.motion_finished:
            print(len(self.sent), *command.q)
class JointPositions:
    def __init__(self, q):
        self.q = q
class ControllerMode:
    JointImpedance = 0
"""


@pytest.mark.parametrize("off", [0.0, 5e-4, 5e-3])
def test_a_motion_on_a_franka(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, off: float) -> None:
    plan = planned("panda_pick_place")
    motion = plan.trajectory
    motion.save_as("franka", tmp_path / "motion.csv", robot=plan.joints.robot)
    start = (motion.position(0.0) + off).tolist()
    (tmp_path / "pylibfranka.py").write_text(FRANKA.format(start=start), encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    if off > 1e-3:
        with pytest.raises(AssertionError, match=r"0.005 rad off the first row"):
            run("run_on_franka.py", tmp_path, "motion.csv", "arm")
        return
    count, *last = numbers(run("run_on_franka.py", tmp_path, "motion.csv", "arm"))
    assert count == 3000  # of 3001 rows one is lost with its cycle
    np.testing.assert_allclose(last, motion.position(motion.end_time) + off, atol=1e-12)


def test_a_test_of_ones_own(tmp_path: Path) -> None:
    assert "4 passed" in run("test_my_task.py", tmp_path)


@pytest.mark.exhaustive
def test_a_placement_study(tmp_path: Path) -> None:
    output = run("placement_study.py", tmp_path, "out", "3", "2")
    counts = [int(number) for number in re.findall(r"^ +(\d+) ", output, re.MULTILINE)]
    passed, total = numbers(output.splitlines()[0])
    assert (total, sum(counts)) == (6, 6 - passed)
    assert passed > 0
    assert kw.plan(tmp_path / "out" / "best.yaml").report.ok
    assert "<svg" in (tmp_path / "out" / "placement.svg").read_text(encoding="utf-8")
    assert run("placement_study.py", tmp_path, "out", "3", "2") == output


@pytest.fixture
def sweep() -> ModuleType:
    """The sweep as a module."""
    spec = importlib.util.spec_from_file_location("sweep", EXAMPLES / "sweep_approach_angle.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_shorter_sweep(
    sweep: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sweep, "ANGLES", np.array([-30.0, -20.0, 0.0, 45.0]))
    sweep.main(tmp_path / "out")
    output = capsys.readouterr().out
    assert re.search(r"^ *-30\.0 deg: .*not in this orientation", output, re.MULTILINE)
    assert "1 of 4 angles can't be done" in output
    assert "<svg" in (tmp_path / "out" / "sweep.svg").read_text(encoding="utf-8")


def test_ones_own_urdf(tmp_path: Path) -> None:
    output = run("own_urdf.py", tmp_path)
    assert "all requirements met" in output
    uses = re.findall(r"(\w+) (velocity|acceleration): (-?[\d.]+) of (-?[\d.]+) rad", output)
    assert len(uses) == 6
    for _, quantity, value, limit in uses:
        assert abs(float(limit)) == {"velocity": 2.5, "acceleration": 8.0}[quantity]
        assert 0 < float(value) / float(limit) < 1


def test_the_spline_alone(tmp_path: Path) -> None:
    output = run("spline_alone.py", tmp_path)
    assert "Pinocchio loaded: False" in output
    assert "SciPy loaded: False" in output
    assert numbers(output.splitlines()[0]) == [0, 3.09, 7.5, 12.5, 18.82, 25]
    jumps = dict(re.findall(r"^(\S+) +acceleration: .*jump ([\d.]+)", output, re.MULTILINE))
    assert float(jumps["cubic"]) > 0.01
    assert float(jumps["modified-hermite"]) == float(jumps["quintic:estimated"]) == 0


def test_planners_compared(tmp_path: Path) -> None:
    output = run("compare_planners.py", tmp_path, "paper_case")
    rows = re.findall(r"^(\S+) +jerk +([\d.]+)", output, re.MULTILINE)
    assert {"modified-hermite", "quintic", "3-5-3"} <= {name for name, _ in rows}
    assert "cubic" not in {name for name, _ in rows}
    assert (jerks := [float(jerk) for _, jerk in rows]) == sorted(jerks)


def test_each_has_its_test_and_says_how_it_is_run() -> None:
    tests = Path(__file__).read_text(encoding="utf-8")
    for name in SCRIPTS:
        assert f'"{name}"' in tests
        text = (EXAMPLES / name).read_text(encoding="utf-8")
        assert f"examples/{name}" in text.split('"""')[1]
        assert len(text.splitlines()) < 80

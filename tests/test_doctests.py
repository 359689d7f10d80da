"""The examples in docstrings (`>>>`) print what they show.

They know the names of their module, `kw` and `np`.
"""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from public_names import documented

SOURCE = Path(kw.__file__).parent
PROMPT = re.compile(r"^\s*>>> ", re.MULTILINE)
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
WITH_EXAMPLES = {
    ".".join(["knotwork", *path.relative_to(SOURCE).with_suffix("").parts]): len(prompts)
    for path in sorted(SOURCE.rglob("*.py"))
    if (prompts := PROMPT.findall(path.read_text(encoding="utf-8")))
}


@pytest.fixture(autouse=True)
def surroundings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An empty folder to work in, and NumPy's default way of printing."""
    monkeypatch.chdir(tmp_path)
    with np.printoptions(precision=8, suppress=False, floatmode="maxprec", linewidth=75):
        yield


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_of_docstrings(module: str) -> None:
    examples = doctest.DocTestFinder(exclude_empty=True).find(
        importlib.import_module(module.removesuffix(".__init__")),
        extraglobs={"np": np, "kw": kw},
    )
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS)
    for example in examples:
        runner.run(example, out=said.append)
    assert not runner.failures, "".join(said)
    # An example where doctest does not look, as below a constant, would never be run.
    assert runner.tries == WITH_EXAMPLES[module], f"not all examples of {module} are found"


# What is obvious without an example of its own, by the reason.
OBVIOUS = {
    "base classes": (
        "KnotworkError",
        "errors.OutOfReachError",
        "errors.PathError",
        "errors.TaskError",
        "tool_paths.Curve",
    ),
    "errors whose message says all": (
        "errors.BranchError",
        "errors.CollisionError",
        "errors.FollowingError",
        "errors.NoWayFoundError",
        "errors.OptionError",
        "errors.OutsideLimitsError",
        "errors.RobotError",
        "errors.SingularityError",
        "errors.TimeRangeError",
        "errors.WaypointDataError",
    ),
    "they need Drake or ROS 2": (
        "export.to_drake",
        "export.to_ros2_message",
    ),
}
# Plain data, by what gives or takes it, which has an example.
PLAIN_DATA = {
    "JointTrajectory": ("Continuity", "Jump", "Knots", "Load", "Samples", "Segment"),
    "compare": ("Refusal", "Score"),
    "metrics.deviation.straight_path_deviation": ("PathDeviation",),
    "errors.DocumentError": ("Problem",),
    "export.export": ("DriveOptions", "MessageOptions", "ScriptOptions", "TableOptions"),
    "export.get_format": ("Format",),
    "export.motion_points": ("Points",),
    "export.motion_table": ("MotionTable",),
    "interpolation.PlannerOptions": ("ChosenRun",),
    "interpolation.get_planner": ("Planner",),
    "scenario.joint_space.joint_space": ("JointSpace", "JointState"),
    "recording.deviation_findings": ("Delay", "LogTolerances"),
    "load_scenario": (
        "AskedEvent",
        "AskedTiming",
        "CollisionRules",
        "FreeWay",
        "HeldObject",
        "JointValues",
        "OtherRobot",
        "ScenarioPath",
        "Scene",
        "SceneObject",
        "SeamTorch",
        "Shape",
        "Stretch",
        "ToolPlacement",
    ),
    "Task": (
        "Action",
        "AlongArc",
        "AlongPoints",
        "Arc",
        "AtMost",
        "Balanced",
        "Branch",
        "ChosenMotion",
        "ClearWay",
        "Collisions",
        "EndAcceleration",
        "Euler",
        "Fastest",
        "FreePose",
        "FreePosition",
        "Frame",
        "FrameMotion",
        "FrameSpeed",
        "Grid",
        "HalfSpace",
        "HeldObject",
        "Inertia",
        "JointWaypoint",
        "Limits",
        "OtherRobot",
        "PathOptions",
        "PathWaypoint",
        "Placement",
        "PlainTask",
        "PlacesFile",
        "PointCloud",
        "Pose",
        "PoseWaypoint",
        "Presets",
        "Repeat",
        "SceneObject",
        "Surroundings",
        "TaskUnits",
        "Tolerances",
        "Tool",
        "ToolShape",
        "Torch",
        "SolidOfRevolution",
        "Velocity",
        "Weave",
        "Weights",
    ),
    "metrics.peak": ("Peak",),
    "plan": ("Carrying", "ChosenTimes", "Load"),
    "recording.aligned": ("Alignment", "LeftOfPlan"),
    "recording.read_log": ("Recording",),
    "recording.smoothed": ("Noise", "Smoothed"),
    "sweep": ("Axis", "StudySpec"),
    "task_to_joint.solve_task": ("Choice", "Infeasibility", "TaskSolution"),
    "timing.solve": ("Binding", "Progress"),
    "view.report_page": ("Page",),
}


def test_public_names_have_examples() -> None:
    shown = {name.removeprefix("knotwork."): shows_use(public(name)) for name in documented()}
    without = {name for name, example in shown.items() if not example}
    obvious = {name for names in OBVIOUS.values() for name in names}
    data = [name for names in PLAIN_DATA.values() for name in names]
    assert obvious <= without
    assert sorted(name.rpartition(".")[2] for name in without - obvious) == sorted(data)
    assert all(shown[name] for name in PLAIN_DATA)


def public(name: str) -> object:
    package, _, own = name.rpartition(".")
    return getattr(importlib.import_module(package), own)


def shows_use(thing: object) -> bool:
    """Whether the docstring of a function or class, or of a method, has an example."""
    if not (inspect.isclass(thing) or inspect.isfunction(thing)):
        return True
    documented = [thing, *(vars(thing).values() if inspect.isclass(thing) else ())]
    return any(PROMPT.search(inspect.getdoc(one) or "") for one in documented)

"""Wrong tool paths through the command line: each is an error with file, line and field."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

import knotwork as kw
from command_line import Command
from knotwork.errors import InputError
from seams import ON
from seams import task as seam

tp = kw.tool_paths

OFF = {"name": "off", "along": "line", "speed": 60, "pose": {"position": [450, 50, 60]}}
UP = {"name": "up", "after": 2, "pose": {"position": [450, 50, 200], "rpy": [180, 0, 0]}}
NO = object()
"""Takes a key away."""


def changed(one: dict[str, Any], **change: Any) -> dict[str, Any]:
    return {key: value for key, value in {**one, **change}.items() if value is not NO}


def task(*waypoints: dict[str, Any], **more: Any) -> dict[str, Any]:
    return changed(seam(*waypoints), **more)


def off(**change: Any) -> dict[str, Any]:
    """A line and what comes after it."""
    return task(ON, changed(OFF, **change), UP)


def arc(**form: Any) -> dict[str, Any]:
    return off(along={"arc": form})


def then(y: float, x: float = 450, **change: Any) -> dict[str, Any]:
    return changed(OFF, name="next", pose={"position": [x, y, 60]}, **change)


HOME = {"joints": "home", "after": 1, "stop": True}
CASES: dict[str, tuple[dict[str, Any], str]] = {
    "first of all": (task(OFF, UP, start=NO), r"waypoints\[0\]\.along: the path has no waypoint"),
    "first after a start": (task(OFF, UP), r"waypoints\[0\]\.along: the path has no waypoint"),
    "after joints": (task(HOME, OFF, UP), r"waypoints\[1\]\.along: .* given by joint values"),
    "without robot": (task(ON, OFF, robot=NO, start=NO), "a pose needs a robot"),
    "blend and wait": (task(ON, changed(OFF, blend=5, wait=1), then(90)), "gives blend and wait"),
    "blend and stop": (task(ON, changed(OFF, blend=5, stop=True), then(90)), "blend and stop"),
    "blend at the end": (task(ON, changed(OFF, blend=5)), "not between two lines"),
    "blend and then no path": (off(blend=5), r"waypoints\[1\]\.blend: .*not between two lines"),
    "blend of next to nothing": (
        task(ON, changed(OFF, blend=1e-7), then(50, 500)),
        r"blend distance is 1e-07 mm; it must be greater than 1e-06 mm",
    ),
    "blend too long": (task(ON, changed(OFF, blend=80), then(100)), r"is 80 mm, .*at most 25 mm\)"),
    "changes of speed too long": (
        off(speed=900, stop=True),
        r"is 150 mm long here, but .* take [\d.]+ mm at \d+ mm/s² \(at most [\d.]+ mm/s, or path",
    ),
    "blend of a turn back": (
        task(ON, changed(OFF, blend=9), then(-50)),
        "turns back at the corner",
    ),
    "corner at speed": (task(ON, OFF, then(50, 500)), r"turns sharply by 90 deg.*blend"),
    "time of a stretch in the middle": (
        task(
            ON,
            changed(OFF, speed=20),
            then(90, after=0.4, speed=NO),
            {**then(130, speed=20), "name": "z"},
            path={"acceleration": 100},
        ),
        r"waypoints\[2\]\.after: leaves 0\.4 s, .* takes at least 1\.\d+ s at 100 mm/s²",
    ),
    "corner into an arc": (
        task(ON, OFF, then(50, 530, along={"arc": {"through": [490, 10, 60]}})),
        r"sharply by 180 deg at 'off' \(stop: true\)",
    ),
    "one point that is short": (off(along={"points": [[460, 0]]}), r"has 2 values, fewer than 3 "),
    "wait of next to no time": (off(wait=1e-9), r"\.wait: 1e-09: must be at least 0\.001"),
    "wait of no time": (off(wait=0), r"waypoints\[1\]\.wait: 0: must be greater"),
    "stop that is none": (off(stop=False), r"waypoints\[1\]\.stop: false: must be true"),
    "velocity": (off(velocity={"linear": [0, 60, 0]}), r"velocity: unknown key"),
    "speed where it begins": (
        task(changed(ON, speed=50), OFF, UP),
        r"\[0\]\.speed: is given where",
    ),
    "speed zero": (off(speed=0), r"speed: 0: must be greater than 0"),
    "speed text": (
        off(speed="fast"),
        r"speed: 'fast': must be a positive number, fastest, or {at_most: a positive number}",
    ),
    "speed infinite": (off(speed=float("inf")), "must be a finite number"),
    "speed beyond all measure": (
        off(speed=1e9),
        r"would have to turn at .*; feasible at .*of the speed",
    ),
    "speed and another time": (off(time=3), r"leaves 1 s, .* takes 2\.5 s"),
    "time too early": (off(time=1, speed=NO), "is not later than 2 s"),
    "neither speed nor time": (off(speed=NO), "has neither speed nor after"),
    "time after a speed": (task(ON, OFF, then(90, time=9, speed=NO)), "does not say how long"),
    "time too short": (off(after=0.01, speed=NO, stop=True), r"takes at least 0\.67\d* s"),
    "no length": (off(pose={"position": [450, -100, 60]}), "has no length"),
    "arc of three points on a line": (
        arc(through=[450, 0, 60]),
        r"\(450, -100, 60\) mm, \(450, 0, 60\) mm and \(450, 50, 60\) mm are on a line",
    ),
    "arc too tight": (
        arc(radius=20, normal=[0, 0, 1]),
        r"radius is 20 mm, .* 150 mm apart; it must be at least 75 mm",
    ),
    "points on a line in a frame": (
        changed(
            arc(through=[450, 0, 60]),
            frame="table",
            frames={"table": {"position": [100, 30, 9], "rpy": [10, 20, 30]}},
        ),
        r"\(450, -100, 60\) mm, \(450, 0, 60\) mm and \(450, 50, 60\) mm are on a line",
    ),
    "arc with its normal along it": (arc(radius=90, normal=[0, 1, 0]), "must be 90 deg"),
    "arc with a normal of zero": (arc(radius=90, normal=[0, 0, 0]), "normal is zero"),
    "arc with its centre aside": (arc(centre=[450, 0, 60]), "both must be the radius"),
    "arc of two forms": (arc(centre=[450, 0, 60], radius=9), "gives centre and radius"),
    "arc of no form": (arc(), "gives no form of arc"),
    "no kind of path": (off(along="spline"), "must be one of line"),
    "two kinds of path": (
        off(along={"arc": {"through": [1, 2, 3]}, "points": "seam.csv"}),
        r"\.along: .*must be one of line",
    ),
    "points that repeat": (
        off(along={"points": [[460, 0, 60]] * 2}),
        "points 1 and 2 are the same",
    ),
    "points that turn back": (
        off(along={"points": [[450, 0, 60], [450, -100, 60]]}),
        "turns back sharply",
    ),
    "points of no file": (off(along={"points": "nowhere.csv"}), "nowhere.csv"),
    "half a turn": (off(pose={"position": [450, 50, 60], "rpy": [0, 0, 0]}), "turns by 180 deg"),
    "another end than the tangent's": (
        off(orientation="tangent", pose={"position": [450, 50, 60], "rpy": [180, 0, 30]}),
        r"\.pose: is turned 30 degrees from where the path takes the tool",
    ),
    "times of knots": (changed(off(), knots=[0, 1, 4.5]), "waypoints are inserted along the path"),
    "path tolerance too small": (changed(off(), tolerances={"path": 1e-7}), "at least 1e-06"),
    "angle tolerance too small": (
        changed(off(), tolerances={"path_orientation": 1e-9}),
        r"at least 5\.7",
    ),
    "speed tolerance too small": (
        changed(off(), tolerances={"path_speed": 1e-12}),
        "at least 1e-09",
    ),
    "tolerance of no such thing": (
        changed(off(), tolerances={"path_deviation": 1}),
        "did you mean 'path_orientation'",
    ),
    "too short for its ramps": (
        changed(task(changed(ON, stop=True), OFF, UP), path={"acceleration": 1}),
        r"acceleration: 18\} or more",
    ),
    "out of reach": (off(pose={"position": [1450, 50, 60]}), "out or singular and can't go on"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_wrong_path_is_an_error_with_its_line(
    case: str, knotwork: Command, tmp_path: Path
) -> None:
    scenario, said = CASES[case]
    file = tmp_path / "bad.yaml"
    file.write_text(yaml.safe_dump(scenario, sort_keys=False))
    ran = knotwork("plan", file)
    assert ran.code == 2, ran.err
    assert re.search(said, " ".join(ran.err.split())), ran.err
    assert re.search(r"bad\.yaml: line \d+: ", ran.err)


FILES = {
    "x,y,zz\n450,-100,60\n450,50,60\n": r"line 1: column 3 .zz.: unknown heading 'zz'",
    "450,-100,60\n450,50,60\n": r"line 1: has no headings",
    "x,y,z\n450,-100,60\n460,a,60\n": r"line 3: column 2 \(y\): 'a' is no number",
    "x,y,z\n450,-100,60\n460,nan,60\n": r"line 3: column 2 \(y\): is nan \(a finite number\)",
    "x,y,z\n450,-100,60\n460,60\n": r"line 3: has 2 values",
    "x,y,z\n450,-100,60\n\n460,0,60\n460,0,60\n": r"line 5: is the same point as line 4",
    "x,y,z\n450,-100,60\n450,0,60\n450,-100,60\n": r"seam\.csv: the curve stops or turns back",
    "x,y,z,qx,qy,qz\n450,-100,60,1,0,0\n": r"line 1: no column is named qw",
    "x,y,z,qx,qy,qz,qw\n450,-100,60,1,0,0,0\n460,0,60,2,0,0,0\n": r"line 3: .*length 2 \(1\)",
    "x,y,z,qx,qy,qz,qw\n450,-100,60,0,0,0,1\n460,0,60,1,0,0,0\n": r"first point .* 180 degrees",
    "x,y,z,qx,qy,qz,qw\n450,-100,60,1,0,0,0\n460,0,60,0,1,0,0\n": r"lengths 0 mm and 101\.\d+ mm",
    "x,y,z,x\n450,-100,60,450\n": "line 1: column 4 .x.: is column 1, too",
    "X,y,z\n450,-100,60\n": "heading 'X' .did you mean 'x'",
    "": "holds no rows",
    "x,y,z\n450,50,60\n": "has one point",
}


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no device that never ends")
def test_points_are_read_from_files_alone(tmp_path: Path, knotwork: Command) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(yaml.safe_dump(off(along={"points": "/dev/zero"}), sort_keys=False))
    ran = knotwork("plan", file)
    assert ran.code == 2
    assert "is no regular file" in ran.err


@pytest.mark.parametrize("text", FILES)
def test_a_wrong_file_of_points_is_named_with_its_line(
    text: str, knotwork: Command, tmp_path: Path
) -> None:
    (tmp_path / "seam.csv").write_text(text)
    file = tmp_path / "bad.yaml"
    file.write_text(yaml.safe_dump(off(along={"points": "seam.csv"}), sort_keys=False))
    ran = knotwork("plan", file)
    assert ran.code == 2, ran.err
    assert re.search(FILES[text], " ".join(ran.err.split())), ran.err
    assert re.search(r"bad\.yaml: line \d+: waypoints\[1\]\.along", ran.err)


def test_the_least_wait_is_one() -> None:
    plan = kw.plan(off(wait=0.001))
    assert plan.report.ok
    end, after = (plan.scenario.waypoints[i].time for i in (2, 3))
    assert after - end == pytest.approx(1e-3)


@pytest.mark.parametrize(
    "make",
    [
        lambda: tp.Arc.of_radius([0, 0, 0], [1, 0, 0], "x", [0, 0, 1]),
        lambda: tp.Arc.about([0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], turns="a"),
        lambda: tp.Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], "x"),
        lambda: tp.Blend([0, 0, 0], [1, 0, 0], [1, 1, 0], distance="x"),
    ],
)
def test_what_is_no_number_is_named(make: Any) -> None:
    with pytest.raises(InputError, match=r"is '(x|a)'; it must be a"):
        make()


def test_orientations_beside_tangent_and_another_end_are_errors(
    knotwork: Command, tmp_path: Path
) -> None:
    rows = ["x,y,z,qx,qy,qz,qw", "450,-100,60,1,0,0,0", "460,0,60,1,0,0,0", "450,50,60,1,0,0,0"]
    (tmp_path / "seam.csv").write_text("\n".join(rows))
    file = tmp_path / "bad.yaml"
    turned = {"position": [450, 50, 60], "rpy": [180, 0, 20]}
    for change, said in (
        (
            {"orientation": "tangent"},
            "orientation: is given together with points that have orientations",
        ),
        ({"pose": turned}, "pose: is turned 20 degrees from where the path takes the tool"),
    ):
        file.write_text(yaml.safe_dump(off(along={"points": "seam.csv"}, **change)))
        ran = knotwork("plan", file)
        assert ran.code == 2
        assert said in " ".join(ran.err.split())


@pytest.mark.parametrize(("speed", "stops"), [(1e-6, True), (1e-9, False)])
def test_a_speed_so_slow_that_times_do_not_resolve_its_ramps_is_named(
    tmp_path: Path, speed: float, stops: bool
) -> None:
    rows: list[dict[str, Any]] = [
        {**ON, "stop": True},
        {"along": "line", "speed": speed, "pose": {"position": [450, 50, 60]}},
        {"after": 2, "pose": {"position": [450, 90, 90], "rpy": [180, 0, 0]}},
    ]
    if stops:
        rows[1]["stop"] = True
    file = tmp_path / "slow.yaml"
    file.write_text(yaml.safe_dump(task(*rows)), encoding="utf-8")
    with pytest.raises(kw.InputError) as error:
        kw.load_scenario(file)
    said = str(error.value)
    assert re.search(r"slow\.yaml: line \d+: waypoints\[1\]\.speed: is so slow that times", said)
    least = float(re.search(r"at least ([0-9.e-]+) mm/s", said)[1])  # type: ignore[index]
    rows[1]["speed"] = 1.001 * least
    kw.load_scenario(task(*rows))

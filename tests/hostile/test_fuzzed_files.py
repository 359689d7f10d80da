"""Files from strangers through every command: it ends with 0, 1 or 2, in little memory.

Scenarios, trajectories, tables, URDFs and meshes are changed at random, the same way every time.
"""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import yaml
from mutations import as_json, changed_bytes, changed_data, changed_xml

from meshes.test_mesh_files import collada
from plans import planned
from shipped import SCENARIO_FILES
from sweeps import first_of

RUNNER = Path(__file__).parent / "runner.py"
KILOBYTES = 2_500_000
"""Of memory that a process may come to need, whatever it is given."""

LINKS = (
    '<link name="{0}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" '
    'izz="1"/></inertial><visual><origin xyz="0 0 0.1" rpy="0 0 0"/><geometry>{1}</geometry>'
    '<material name="m"><color rgba="0.5 0.5 0.5 1"/></material></visual>'
    "<collision><geometry>{1}</geometry></collision></link>"
)
JOINTS = (
    '<joint name="{0}" type="{1}"><origin xyz="0.3 0 0" rpy="0 0 0"/><parent link="{2}"/>'
    '<child link="{3}"/><axis xyz="0 0 1"/>'
    '<limit lower="-2" upper="2" velocity="3" effort="9"/></joint>'
)
URDF = (
    '<robot name="r">'
    + LINKS.format("a", '<box size="0.1 0.1 0.3"/>')
    + LINKS.format("b", '<cylinder radius="0.05" length="0.3"/>')
    + LINKS.format("c", '<mesh filename="part.{0}" scale="1 1 1"/>')
    + LINKS.format("d", '<sphere radius="0.05"/>')
    + JOINTS.format("i", "continuous", "a", "b")
    + JOINTS.format("j", "revolute", "b", "c")
    + JOINTS.format("k", "fixed", "c", "d")
    + "</robot>"
)
TASK = {
    "robot": {"urdf": "arm.urdf", "tool_frame": "d"},
    "waypoints": [
        {"joints": {"i": 0.1, "j": 0.4}, "stop": True},
        {"joints": {"i": 0.6, "j": -0.4}, "stop": True, "after": 2},
    ],
}
# Scenarios that are planned in a moment, and how often each is changed; all others take a second.
LIGHT = ("planar2_closed_form", "paper_case", "paper_case_presets", "ur3_lid", "paper_case_fastest")
TIMES, TIMES_HEAVY = 30, 5


def meshes() -> dict[str, bytes]:
    box = trimesh.creation.box()
    files = {kind: box.export(file_type=kind) for kind in ("stl", "obj", "ply")}
    files["dae"] = collada()
    return {kind: one.encode() if isinstance(one, str) else one for kind, one in files.items()}


class Session:
    """A process that runs commands, made anew when one has ended it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.process: subprocess.Popen[str] | None = None

    def run(self, *arguments: object) -> int:
        """The exit code of a command.

        Raises:
            AssertionError: It ended the process, was no exit code for a verdict or a wrong input,
                or took too much.
        """
        if self.process is None:
            self.process = subprocess.Popen(
                [sys.executable, "-W", "ignore", str(RUNNER)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                cwd=self.folder,
            )
        self.process.stdin.write(json.dumps([str(one) for one in arguments]) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            ended, self.process = self.process.wait(), None
            raise AssertionError(f"the process ended with {ended}")
        result = json.loads(line)
        assert result["code"] in (0, 1, 2), result
        assert not result["fault"], result
        assert "Traceback" not in result["output"], result
        assert "\x1b" not in result["output"], result
        assert result["kilobytes"] < KILOBYTES, result
        return int(result["code"])

    def close(self) -> None:
        if self.process is not None:
            self.process.stdin.close()
            self.process.stdout.close()
            self.process.wait()


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    session = Session(tmp_path_factory.mktemp("hostile"))
    yield session
    session.close()


@pytest.fixture
def session(sessions: Session) -> Session:
    """A process in an empty folder."""
    for path in sessions.folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    return sessions


# How often of a hundred each command is tried: those that draw take longest.
COMMANDS: dict[str, tuple[int, Callable[[str], tuple[str, ...]]]] = {
    "plan": (55, lambda task: ("plan", task, "--out", "out")),
    "json": (15, lambda task: ("plan", task, "--json")),
    "check": (8, lambda task: ("check", "kept", "--scenario", task)),
    "export": (10, lambda task: ("export", task, "-f", "csv", "--allow-failed")),
    "pvt": (4, lambda task: ("export", task, "-f", "pvt", "--allow-failed")),
    "budget": (5, lambda task: ("plan", task, "--budget", "500ms")),
    "compare": (2, lambda task: ("compare", task, "--planners", "cubic,quintic:estimated")),
    "plot": (2, lambda task: ("plot", task, "-o", "a.svg")),
    "view": (2, lambda task: ("view", task, "--html", "a.html")),
    "report": (2, lambda task: ("report", task, "--html", "a.html")),
}


def command(rng: random.Random, task: str) -> tuple[str, ...]:
    (name,) = rng.choices(list(COMMANDS), [share for share, _ in COMMANDS.values()])
    return COMMANDS[name][1](task)


def counts() -> Iterator[Any]:
    """Of `make test` a few of the light ones; of `make test-all` every shipped scenario."""
    yield from ((name, 4) for name in LIGHT)
    for name in SCENARIO_FILES:
        count = TIMES if name in LIGHT else TIMES_HEAVY
        yield pytest.param(name, count, marks=pytest.mark.exhaustive)


@pytest.mark.parametrize(("name", "count"), list(counts()))
def test_changed_scenarios(name: str, count: int, session: Session) -> None:
    rng = random.Random(f"{name} {count}")
    source = SCENARIO_FILES[name].read_text(encoding="utf-8")
    data = yaml.safe_load(source)
    planned("paper_case").save(session.folder / "kept")
    codes = []
    for i in range(count):
        path = session.folder / "task.yaml"
        if i % 4:
            path.write_text(as_json(changed_data(rng, data)), encoding="utf-8", errors="replace")
        else:
            path.write_bytes(changed_bytes(rng, source.encode()))
        codes.append(session.run(*command(rng, "task.yaml")))
    assert 2 in codes


@pytest.mark.parametrize("count", first_of(3, 60))
def test_changed_logs(count: int, session: Session) -> None:
    rng = random.Random(count)
    plan = planned("planar2_closed_form")
    plan.save(session.folder / "kept")
    table = plan.trajectory.to_csv(rate=50)
    noise = np.random.default_rng(count)
    head, *rows = table.splitlines()
    numbers = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    numbers[:, 1:] += noise.normal(0, 1e-4, numbers[:, 1:].shape)
    noisy = [",".join(f"{value:.6f}" for value in row) for row in numbers]
    log = "\n".join([head, *noisy, ""]).encode()
    codes = []
    for i in range(count):
        (session.folder / "log.csv").write_bytes(changed_bytes(rng, log) if i else log)
        against = ("--against", "kept") if i % 2 else ("-s", "planar2_closed_form", "--log")
        codes.append(session.run("check", "log.csv", *against))
    assert set(codes) >= {codes[0], 2}
    assert codes[0] in (0, 1)


@pytest.mark.parametrize("count", first_of(20, 150))
def test_changed_trajectories_and_tables(count: int, session: Session) -> None:
    rng = random.Random(count)
    planned("paper_case").save(session.folder / "out")
    stored = (session.folder / "out" / "trajectory.json").read_text(encoding="utf-8")
    table = (session.folder / "out" / "samples.csv").read_bytes()[:2000]
    ros2 = planned("paper_case").trajectory.to_ros2()
    codes = []
    for i in range(count):
        if i % 3 == 0:
            path = session.folder / "changed.json"
            path.write_text(as_json(changed_data(rng, json.loads(stored))), errors="replace")
        else:
            path = session.folder / ("changed.csv" if i % 3 == 1 else "changed.yaml")
            path.write_bytes(changed_bytes(rng, table if i % 3 == 1 else ros2.encode()))
        run = rng.choices(
            [("check", path, "-s", "paper_case"), ("export", path, "-f", "csv")], [5, 1]
        )
        codes.append(session.run(*run[0]))
    assert 2 in codes


@pytest.mark.parametrize("count", first_of(12, 70))
def test_changed_urdfs(count: int, session: Session) -> None:
    rng = random.Random(count)
    (session.folder / "part.stl").write_bytes(meshes()["stl"])
    (session.folder / "task.json").write_text(json.dumps(TASK))
    text = URDF.format("stl")
    codes = []
    for i in range(count):
        changed = changed_xml(rng, text).encode() if i % 5 else changed_bytes(rng, text.encode())
        (session.folder / "arm.urdf").write_bytes(changed)
        kind = rng.choices(("robots", "plan", "view", "report"), (3, 5, 5, 1))[0]
        if kind == "robots":
            codes.append(session.run("robots", "arm.urdf"))
        elif kind == "plan":
            codes.append(session.run("plan", "task.json"))
        else:
            codes.append(session.run(kind, "task.json", "--html", "a.html"))
    assert set(codes) >= {0, 2}


@pytest.mark.parametrize("kind", sorted(meshes()))
@pytest.mark.parametrize("count", first_of(1, 12))
def test_changed_meshes(count: int, kind: str, session: Session) -> None:
    rng = random.Random(f"{kind} {count}")
    (session.folder / "arm.urdf").write_text(URDF.format(kind))
    (session.folder / "task.json").write_text(json.dumps(TASK))
    content = meshes()[kind]
    (session.folder / f"part.{kind}").write_bytes(content)
    assert session.run("view", "task.json", "--html", "a.html") == 0
    for i in range(count):
        if kind == "dae" and i % 2:
            changed = changed_xml(rng, content.decode()).encode()
        else:
            changed = changed_bytes(rng, content)
        (session.folder / f"part.{kind}").write_bytes(changed)
        shows = "report" if i % 10 == 9 else "view"
        # what is not read whole is refused
        assert session.run(shows, "task.json", "--html", "a.html") in (0, 2)

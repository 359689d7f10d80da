"""What the README says is true: its scenario, its Python, its figures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_the_explained_scenario_plans_and_passes(tmp_path: Path) -> None:
    (text,) = blocks("yaml")
    path = tmp_path / "explained.yaml"
    path.write_text(text, encoding="utf-8")
    plan = kw.plan(path)
    plan.report.raise_if_failed()
    speeds = [
        np.linalg.norm(plan.space.robot.twist(q, v).linear)
        for q, v in zip(  # type: ignore[union-attr]
            plan.joint_waypoints.position, plan.joint_waypoints.velocity, strict=True
        )
    ]
    assert len(speeds) > 6
    np.testing.assert_allclose(speeds[:2] + speeds[-1:], 0, atol=1e-9)
    np.testing.assert_allclose(speeds[2:-2], 0.05, atol=1e-9)  # of the path, with those inserted
    assert speeds[-2] == pytest.approx(np.hypot(0.03, 0.02))


def test_the_python_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks("python"):
        exec(block, names)
    assert (tmp_path / "result" / "trajectory.json").is_file()
    spline = names["spline"]
    assert isinstance(spline, kw.ModifiedHermiteSpline)
    np.testing.assert_allclose(spline([0, 5, 15, 25]), [0, 30, 90, 180], atol=1e-12)


def test_the_commands_exist() -> None:
    from knotwork.cli.main import cli

    said = set(re.findall(r"^    knotwork (\w+)", README, re.MULTILINE))
    assert said >= {"plan", "check", "robots"}
    assert said <= set(cli.commands)


def test_how_near_the_tool_stays_to_edge_and_speed() -> None:
    said = re.search(
        r"within ([\d.]+) mm of the edge and within ([\d.]+) % of the speed",
        re.sub(r"\s+", " ", README),
    )
    assert said is not None
    plan = kw.plan("ur5_deburring")
    robot = plan.space.robot
    assert robot is not None
    time = np.linspace(5, 11, 3001)  # from edge start to edge end
    q, v = plan.trajectory.position(time), plan.trajectory.velocity(time)
    place = np.array([robot.forward(row).translation for row in q])
    speed = np.array([np.linalg.norm(robot.twist(*row).linear) for row in zip(q, v, strict=True)])
    line = (place[-1] - place[0]) / np.linalg.norm(place[-1] - place[0])
    off = np.linalg.norm(np.cross(place - place[0], line), axis=1)
    assert 1e3 * off.max() <= float(said[1])
    assert 100 * np.abs(speed / 0.05 - 1).max() <= float(said[2])
    proved = {one.quantity: one for one in plan.report.findings if one.subject == "path"}
    for quantity, most in (("path_deviation", said[1]), ("path_speed", 0.5 * float(said[2]))):
        found = proved[quantity]
        assert found.proof == "bounded"
        assert 1e3 * (found.value + found.excess) <= float(most)
    inserted = len(plan.joint_waypoints.time) - len(plan.scenario.waypoints)
    assert re.search(r"so that (\w+) do for the 300 mm", README)[1] == ["", "one", "two"][inserted]


@pytest.mark.parametrize("scenario", ["paper_case", "ur5_deburring"])
def test_the_comparison_is_what_the_command_shows(scenario: str) -> None:
    from knotwork.comparison import compare

    part = README.split(f"`knotwork compare {scenario}`", 1)[1]
    table = re.findall(r"^\| `(.+?)` \| (.+) \|$", part.split("\n\n")[1], re.MULTILINE)
    scores = {score.planner: score for score in compare(scenario).scores}
    assert [planner for planner, _ in table] == list(scores)
    for planner, cells in table:
        score = scores[planner]
        figures = (
            score.velocity_miss,
            score.acceleration_jump,
            score.peak_velocity.value,
            score.peak_acceleration.value,
            score.peak_jerk.value if score.peak_jerk is not None else None,
            score.velocity_fluctuation,
        )
        for said, figure in zip(cells.split(" | "), figures, strict=True):
            if figure is None:
                assert said == "unbounded"
            else:
                assert float(said) == pytest.approx(figure, rel=5.1e-3, abs=1e-9)

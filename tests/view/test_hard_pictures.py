"""Pictures with much in them: no words over each other, nothing cut off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from figures import QUANTITIES, legend_words, lines, outside, overlaps, waypoint_names

import knotwork as kw
from knotwork.view import plot_joints, plot_tool
from shipped import SCENARIO_FILES
from sweeps import first_of, mostly_exhaustive

JOINTS = [f"left_manipulator_shoulder_and_wrist_joint_{i}_of_seven" for i in range(7)]


def task(points: int, *, limit: float = 0.75, uneven: bool = True) -> dict[str, Any]:
    """Seven joints with long names through many waypoints with long names."""
    rng = np.random.default_rng(3)
    gaps = rng.uniform(0.4, 1.5, points) if uneven else np.ones(points)
    times = np.cumsum(gaps) - gaps[0]
    size, rate, phase = rng.uniform(0.5, 2.2, 7), rng.uniform(0.1, 0.6, 7), rng.uniform(0, 6, 7)

    def values(amplitude: Any, angle: Any) -> dict[str, float]:
        return dict(zip(JOINTS, (amplitude * angle).tolist(), strict=True))

    return {
        "name": "seven_joints",
        "limits": {
            "velocity": dict.fromkeys(JOINTS, limit),
            "position": {name: [-2.15, 2.5] for name in JOINTS},
            "acceleration": dict.fromkeys(JOINTS, 60.0),
        },
        "waypoints": [
            {
                "name": f"weld seam {i // 9} point {i}",
                "time": float(t),
                "joints": values(size, np.sin(rate * t + phase)),
                "velocity": values(size * rate, np.cos(rate * t + phase)),
            }
            for i, t in enumerate(times)
        ],
    }


def clean(figure: Any) -> None:
    assert overlaps(figure) == []
    assert outside(figure) == []


@pytest.mark.parametrize("points", first_of(50, 300))
def test_seven_joints_and_many_waypoints(points: int) -> None:
    plan = kw.plan(task(points))
    figure = plot_joints(plan)
    clean(figure)
    names = waypoint_names(figure.axes[0])
    assert 10 <= len(names) <= points
    assert names[0].get_position()[0] == 0.0
    assert all(len(name.get_text()) <= 16 for name in names)
    broken = [found for found in plan.report.select(group="Joint limits") if not found.ok]
    for axis, quantity in zip(figure.axes, QUANTITIES, strict=True):
        expected = sum(failure.quantity == quantity for failure in broken)
        assert len(lines(axis, "broken")) == expected
    assert lines(figure.axes[1], "broken")
    joints = [word for word in legend_words(figure) if word.startswith("left")]
    assert len(set(joints)) == 7
    assert all(len(word) <= 26 for word in joints)


@pytest.mark.parametrize(
    "name", mostly_exhaustive(SCENARIO_FILES, "ur5_deburring", "paper_case_presets")
)
def test_shipped_scenarios(name: str) -> None:
    plan = kw.plan(name)
    clean(plot_joints(plan))
    if plan.space.robot is not None:
        clean(plot_tool(plan))


@pytest.mark.parametrize("name", ["_joint", "$q_1$", "a_{", "tab\there", "two\nlines", "%s", "αβ"])
def test_names_are_only_names(name: str) -> None:
    """Names are drawn as they are: no mathematics, no hidden entries, no second line."""
    given = {
        "name": name.strip(),
        "waypoints": [
            {"name": name, "joints": {name: 0.0, "b": 1.0}},
            {"name": "end", "joints": {name: 1.0, "b": 0.0}, "after": 1},
        ],
    }
    figure = plot_joints(kw.plan(given), quantities=["position"])
    clean(figure)
    shown = name.replace("\t", "·").replace("\n", "·")
    assert shown in legend_words(figure)
    assert shown in [text.get_text() for text in waypoint_names(figure.axes[0])]

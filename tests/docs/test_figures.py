"""Pages with measured figures show the saved results, which the benchmarks can write anew."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


def test_the_page_on_planners_shows_the_saved_results() -> None:
    shown = (ROOT / "docs" / "planners.md").read_text(encoding="utf-8")
    assert shown == importlib.import_module("pages").render("planners"), "run: make figures"


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", ["smooth", "near", "arbitrary"])
@pytest.mark.parametrize("ratio", [1, 10, 100])
def test_the_first_tasks_are_no_worse_than_what_is_saved(kind: str, ratio: int) -> None:
    benchmark = importlib.import_module("planners")
    results = importlib.import_module("results").load("planners")["rows"]
    saved = {
        row["planner"]: row["figures"]
        for row in results
        if (row["kind"], row["ratio"]) == (kind, ratio)
    }
    rng = np.random.default_rng([1, benchmark.KINDS.index(kind), ratio])
    seen: list[float] = []
    for _ in range(10):
        waypoints = benchmark.task(rng, kind, ratio)
        width = np.diff(waypoints.time)
        assert width.max() / width.min() == pytest.approx(ratio, rel=1e-9)
        for planner, figures in benchmark.measure(waypoints).items():
            for name, figure in figures.items():
                if saved[planner][name] is None or name.startswith("time"):
                    continue
                worst = saved[planner][name][1]
                rounding = 0.5e5 if worst >= 1e5 else 0.5 if worst >= 100 else 0.0
                assert figure <= worst * 1.005 + 0.005 + rounding
                seen.append(figure)
    assert max(seen) > 0.1


MEETS = ("modified-hermite", "cubic", "quintic", "septic", "nonic", "bspline-velocity", "3-5-3")


def test_who_is_best_and_worst_is_what_the_page_says() -> None:
    cases: dict[tuple[str, int], dict[str, Any]] = {}
    saved = importlib.import_module("results").load("planners")
    for row in saved["rows"]:
        if row["planner"] in saved["first"]:
            continue  # its figures are those of other tasks
        cases.setdefault((row["kind"], row["ratio"]), {})[row["planner"]] = row["figures"]
    for (kind, ratio), table in cases.items():
        fluctuation = {name: row["fluctuation"][0] for name, row in table.items()}
        meeting = {name: f for name, f in fluctuation.items() if name.startswith(MEETS)}
        assert fluctuation["cubic"] == min(meeting.values())
        if kind == "smooth":
            assert fluctuation["trapezoidal"] == max(fluctuation.values())
        if kind != "arbitrary":
            continue
        if ratio > 1:
            assert fluctuation["modified-hermite, paper"] == max(fluctuation.values())
        for name in ("peak accel. / cubic", "peak jerk / paper"):
            medians = {planner: row[name][0] for planner, row in table.items() if row[name]}
            assert set(sorted(medians, key=lambda row: medians[row])[:2]) == {"bspline", "4-3-4"}


def test_the_page_on_ways_counts_what_was_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    def motion(duration: float, collides: bool, acceleration: float) -> dict[str, Any]:
        return {"duration": duration, "collides": collides, "acceleration": acceleration}

    took = {"seconds": 1.5, "first": 0.25, "ok": True, "line": 2.5, "curve": 1.6}
    rows = [
        {"kind": "box", "number": 1, **took}
        | {"knotwork": motion(1.5, False, 1.0), "roboplan": motion(3.0, True, 6.2)},
        {"kind": "box", "number": 2, **took}
        | {"knotwork": motion(2.0, False, 1.0), "roboplan": None},
        {"kind": "cage", "number": 1, "knotwork": None, "roboplan": motion(2.0, False, 1.0)}
        | {"error": "joint 'panda_joint4' stands at 0 rad, outside its limits"},
        {"kind": "cage", "number": 2, "error": "no way", "knotwork": None, "roboplan": None},
    ]
    solved, durations, times, judged = importlib.import_module("ways_tables").tables({"rows": rows})
    assert solved.rows == [
        ["box", "2", "0", "2 of 2"],
        ["cage", "2", "1", "0 of 1"],
        ["all", "4", "1", "2 of 3"],
    ]
    assert durations.rows[-1] == ["all", "1.50", "3.00", "0.50", "0.70 / 0.80", "1.09 / 1.25"]
    assert durations.rows[1] == ["cage", "–", "–", "–", "–", "–"]
    assert times.rows[-1] == ["all", "0.25 / 0.25", "1.50 / 1.50"]
    assert judged.rows == [
        ["Knotwork", "2", "0", "0", "–"],
        ["roboplan", "2", "1", "1", "6.20"],
    ]
    monkeypatch.setattr("results.load", lambda name: {"rows": rows})
    assert "2 of 3 problems are solved" in importlib.import_module("pages").render(
        "ways_benchmarks"
    )


SAVING = ["collision", "ik", "paths", "planners", "speed", "sweep", "timing", "ways"]


@pytest.mark.parametrize("name", SAVING)
def test_a_folder_to_save_to_is_made_before_anything_is_measured(name: str, tmp_path: Path) -> None:
    command = importlib.import_module(name).main
    known = ["success"] if name == "ik" else []
    folder = tmp_path / "not" / "there"
    command.make_context(name, [*known, "--save", str(folder)])
    assert folder.is_dir()
    (tmp_path / "file").write_text("")
    for wrong in ("file", "file/in"):
        done = CliRunner().invoke(command, [*known, "--save", str(tmp_path / wrong)])
        assert done.exit_code == 2, done.output
        assert "--save" in done.output

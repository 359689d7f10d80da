"""Pages with measured figures show the saved results, which the benchmarks can write anew."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


def test_the_page_on_planners_shows_the_saved_results() -> None:
    shown = (ROOT / "docs" / "planners.md").read_text(encoding="utf-8")
    assert shown == importlib.import_module("pages").render("planners"), "run: make figures"


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

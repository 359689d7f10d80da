"""Pages with measured figures show the saved results, which the benchmarks can write anew."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
from click.testing import CliRunner

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


def test_the_page_on_planners_shows_the_saved_results() -> None:
    shown = (ROOT / "docs" / "planners.md").read_text(encoding="utf-8")
    assert shown == importlib.import_module("pages").render("planners"), "run: make figures"


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

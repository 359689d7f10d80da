"""Pages with measured figures show the saved results, which the benchmarks can write anew."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


@pytest.mark.parametrize("page", ["ik_benchmarks"])
def test_pages_show_the_saved_results(page: str) -> None:
    shown = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    assert shown == importlib.import_module("pages").render(page), "run: make figures"


def shape(part: Any) -> Any:
    """What a result is made of: its keys, the shapes that rows have, kinds of values."""
    if isinstance(part, dict):
        return {key: shape(value) for key, value in part.items()}
    if isinstance(part, list):
        return sorted({json.dumps(shape(entry), sort_keys=True) for entry in part})
    return "number" if isinstance(part, int | float) else type(part).__name__


@pytest.mark.parametrize("what", ["success", "branches", "speed"])
def test_inverse_kinematics_is_measured_anew(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def not_there(robot: object) -> None:
        raise ImportError

    for peer in ("ik_speed", "ik_success"):
        importlib.import_module(peer)
    ours = dict(list(importlib.import_module("ik_peers").PEERS.items())[:3])
    peers = {**ours, "another": not_there}
    monkeypatch.setattr("ik_speed.PEERS", peers)
    monkeypatch.setattr("ik_success.ARMS", ("ur5", "panda"))
    command = importlib.import_module("ik").main
    done = CliRunner().invoke(command, [what, "--poses", "2", "--save", str(tmp_path)])
    assert done.exit_code == 0, done.output
    measured = json.loads((tmp_path / f"ik_{what}.json").read_text(encoding="utf-8"))
    saved = importlib.import_module("results").load(f"ik_{what}")
    assert shape(measured) == shape(saved)
    for table in importlib.import_module("ik_tables").tables(f"ik_{what}", measured):
        assert table.title in done.output

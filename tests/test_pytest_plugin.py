"""The fixture `knotwork` in a pytest of its own."""

from __future__ import annotations

import re
from pathlib import Path

import knotwork as kw
from command_line import python

TEST = """
def test_cell(knotwork):
    assert len(knotwork.check("*.yaml")) == 2

def test_motions(knotwork):
    assert knotwork.check("out")[0].ok
    (report,) = knotwork.check("o*t", robot="ur5", limits={"acceleration": 0.1})
    assert not report.ok

def test_shipped(knotwork):
    assert knotwork.check("paper_case")[0].ok

def test_nothing(knotwork):
    knotwork.check("none*.yaml")
"""
GOOD = "{waypoints: [{joints: {a: 0}}, {joints: {a: 1}, after: 2}], limits: {acceleration: 4}}"


def said_by(folder: Path, *arguments: str) -> str:
    ran = python(*arguments, cwd=folder)
    return ran.stdout + ran.stderr


def test_each_group_fails_in_the_words_of_the_report(tmp_path: Path, deburring: kw.Plan) -> None:
    (tmp_path / "good.yaml").write_text(GOOD)
    (tmp_path / "fast.yaml").write_text(GOOD.replace("acceleration: 4", "velocity: 0.1"))
    (tmp_path / "wrong.yaml").write_text("waypoints: 3")
    (tmp_path / "test_cell.py").write_text(TEST)
    deburring.save(tmp_path / "out")
    plugins = ("-p", "knotwork.pytest_plugin", "-p", "no:cacheprovider")
    out = said_by(tmp_path, "-m", "pytest", "-q", *plugins)
    assert "joint 'a': velocity reaches 0.75 rad/s at 1 s, limit 0.1 rad/s" in out
    assert "wrong.yaml: line 1: waypoints: 3: must be a list" in out
    assert "Traceback" not in out
    assert "no file matches 'none*.yaml'" in out
    failed = set(re.findall(r"SUBFAILED\[(.*?)\]", out))
    assert failed == {"fast.yaml: Joint limits", "wrong.yaml", "out: Joint limits"}
    assert "1 passed" in out


def test_it_costs_pytest_next_to_nothing(tmp_path: Path) -> None:
    heavy = ("numpy", "pydantic", "yaml", "click", "knotwork.planning")
    code = f"import sys, knotwork.pytest_plugin; print({set(heavy)} & set(sys.modules))"
    assert said_by(tmp_path, "-c", code).strip() == "set()"

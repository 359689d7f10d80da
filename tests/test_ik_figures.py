"""What docs/ik_benchmarks.md says is what its tables show."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from knotwork.robot import robot_names

PAGE = (Path(__file__).parents[1] / "docs" / "ik_benchmarks.md").read_text(encoding="utf-8")
PROSE = " ".join(PAGE.split("What it shows:")[1].split())


def rows(title: str) -> list[list[str]]:
    """Cells of the table under a title."""
    body = re.search(rf"\*\*{title}.*?\*\*\n\n\|.*\n\|.*\n((?:\|.*\n?)+)", PAGE)
    assert body is not None
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in body[1].splitlines()]


# ratio to the tuned loop and share within 1e-8, by solver and start: of both arms
FOUND: dict[tuple[str, str], list[tuple[float, float]]] = {}
for _, start, solver, _, ratio, _, _, share, _ in rows("One solution"):
    if ratio:
        FOUND.setdefault((solver, start), []).append((float(ratio), float(share.strip("%"))))


def ratios(solvers: tuple[str, ...], start: str) -> tuple[float, float]:
    values = [ratio for solver in solvers for ratio, _ in FOUND[solver, start]]
    return min(values), max(values)


def said(pattern: str) -> tuple[float, ...]:
    found = re.search(pattern, PROSE)
    assert found, f"the page does not say: {pattern}"
    return tuple(float(group) for group in found.groups())


NUMBER = r"([\d.]+)"


@pytest.mark.parametrize(
    ("pattern", "solvers", "start"),
    [
        (rf"Knotwork takes {NUMBER} to {NUMBER} times", ("knotwork, first",), "near"),
        (rf"from anywhere {NUMBER} to {NUMBER} times, with all", ("knotwork, first",), "random"),
        (rf"solutions, takes {NUMBER} to {NUMBER} times", ("knotwork, nearest",), "near"),
        (rf"and {NUMBER} to {NUMBER} times from anywhere\. \*", ("knotwork, nearest",), "random"),
        (rf"\(Pink, mink\) take {NUMBER} to {NUMBER} times", ("pink", "mink"), "near"),
        (rf"From anywhere it is {NUMBER} to {NUMBER} times", ("pink", "mink"), "random"),
        (rf"C\+\+ takes {NUMBER} to {NUMBER} times", ("roboticstoolbox ik_LM",), "near"),
    ],
)
def test_ratios(pattern: str, solvers: tuple[str, ...], start: str) -> None:
    assert said(pattern) == pytest.approx(ratios(solvers, start), abs=0.0501)


def test_single_ratios_and_shares() -> None:
    assert said(rf"and {NUMBER} to {NUMBER} times from anywhere; EAIK") == ratios(
        ("roboticstoolbox ik_LM",), "random"
    )
    near, anywhere = said(rf"have one, {NUMBER} and {NUMBER} times")
    assert ratios(("EAIK",), "near") == (near, near)
    assert ratios(("EAIK",), "random") == (anywhere, anywhere)
    shares = [share for peer in ("pink", "mink") for _, share in FOUND[peer, "random"]]
    least, most = said(rf"for {NUMBER} to {NUMBER} % of the poses")
    assert (least, most) == (round(min(shares)), round(max(shares)))
    batches = [*ratios(("knotwork, solve_many",), "near")]
    batches += ratios(("knotwork, solve_many",), "random")
    assert said(rf"a pose takes {NUMBER} to {NUMBER} times") == (min(batches), max(batches))


def test_every_pose_is_solved() -> None:
    for solver in ("knotwork, first", "knotwork, nearest", "knotwork, solve_many"):
        for start in ("near", "random"):
            assert [share for _, share in FOUND[solver, start]] == [100.0, 100.0]
    table = rows("Solved of 1000")
    arms = {name for name in robot_names() if name != "planar2"} | {"baxter"}
    assert {row[0] for row in table} == arms
    for row in table:
        assert row[1:] == ["1000/1000"] * 3 + ["100/100"]
    *singular, last = rows("At singularities")
    assert all(row[2] == "100/100" for row in singular)
    refused = re.fullmatch(r"refused 100/100, ([\d.]+) to ([\d.]+) µm short", last[2])
    assert refused
    assert all(0.9 < float(short) < 1.1 for short in refused.groups())


def test_all_branches_are_found() -> None:
    table = rows("Branches found")
    found = {row[0]: f"{int(row[3]):,}" for row in table if row[1] == "anywhere"}
    assert set(found) == {"ur5", "spherical"}
    for arm, wrist, wanted, hits, share, *_ in table:
        assert (hits, share) == (wanted, "100.000%"), (arm, wrist)
    assert len([row for row in table if "from straight" in row[1]]) == 6
    page = (Path(__file__).parents[1] / "docs" / "inverse_kinematics.md").read_text(
        encoding="utf-8"
    )
    said = rf"all of the\s+{found['ur5']} branches of a UR5 and all of the {found['spherical']} of"
    assert re.search(said, page)

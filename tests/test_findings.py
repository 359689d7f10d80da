"""A check of one's own shows everywhere; warnings are no failures; nothing is lost."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import knotwork as kw
from command_line import Command
from knotwork.verification import CHECKS, Finding, Motion, Report, Topic
from knotwork.view import report_page

FAST = "the tool whistles at 'three four'"


def whistling(motion: Motion, scenario: kw.Scenario, joints: Any) -> Iterator[Finding]:
    """A made-up check: how loud the tool is at two times."""
    for name, time, value in (("three four", 1.5, 71.5), ("other", 0.5, 12.25)):
        yield Finding(
            group="Whistling",
            subject="tool",
            name=name,
            quantity="loudness",
            verdict="failed" if value > 60 else "met",
            fact=FAST if value > 60 else "the tool is quiet",
            value=value,
            limit=60.0,
            margin=60.0 - value,
            unit="dB",
            time=time,
            proof="sampled",
        )
    yield Finding(
        group="Whistling",
        subject="motion",
        name="",
        quantity="silence",
        verdict="met",
        fact="it is silent long enough",
        value=0.25,
        limit=0.1,
        unit="s",
        interval=(2.125, 2.375),
    )


@pytest.mark.usefixtures("without_plots")
def test_own_check_shows_in_report_json_pages_and_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CHECKS, "whistling", whistling)
    plan = kw.plan("planar2_closed_form")
    assert not plan.report.ok
    assert [str(found) for found in plan.report.failures] == [FAST]
    with pytest.raises(kw.CheckFailedError, match=FAST):
        plan.report.raise_if_failed()
    data = json.loads(json.dumps(plan.report_to_dict(), allow_nan=False))
    assert data["version"] == 2
    assert data["failures"] == [FAST]
    (row,) = [one for one in data["findings"] if one["name"] == "three four" and not one["ok"]]
    assert (row["value"], row["limit"], row["unit"]) == (71.5, 60.0, "dB")
    assert (row["proof"], row["verdict"], row["time"]) == ("sampled", "failed", 1.5)
    page = report_page(plan).html
    for text in ("Whistling", "2.125 to 2.375", "71.5", FAST.replace("'", "&#39;"), "dB", "12.25"):
        assert text in page
    rows = page.partition('id="tightest"')[2].partition("<tbody>")[2]
    rows = rows.partition("</tbody>")[0].split("</tr>")
    assert [row.count('class="wrong"') for row in rows] == [1] + [0] * (len(rows) - 1)
    for text in ("loudness", "three four", "71.5", "width: 100%", "FAIL, 119 %"):
        assert text in rows[0]
    assert "loudness" not in "".join(rows[1:])
    tight = [(found.quantity, found.utilisation) for found in plan.report.tightest]
    assert [use for _, use in tight] == sorted((use for _, use in tight), reverse=True)
    assert "silence" in dict(tight)  # less of it would do: a limit from below is used in part, too
    assert "loudness" not in dict(tight)  # it is met as far as it was sampled
    assert [one.name for one in plan.report.sampled] == ["other"]
    kinds = [(found.subject, found.quantity) for found in plan.report.tightest]
    assert len(set(kinds)) == len(kinds)
    scene = plan.view().html
    assert "three four loudness 71.5 of 60 dB" in scene


def test_terminal_shows_own_check(knotwork: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CHECKS, "whistling", whistling)
    out = knotwork("plan", "planar2_closed_form").failed()
    text = r"FAILED planar2_closed_form: \d+ of \d+ requirements met, 1 failed, 1 sampled only;\s+"
    assert re.match(rf"{text}[\d.]+ s\nFAIL {FAST}\n", out), out
    full = knotwork("plan", "planar2_closed_form", "--full").out
    for text in ("Whistling", "loudness [dB]", "71.5", "2.125 to 2.375", FAST):
        assert text in full


def test_check_without_task_keeps_own_findings_on_waypoints(
    knotwork: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kw.plan("planar2_closed_form").save(tmp_path / "plan")
    loud = Finding("Noise", "waypoint", "end", "loudness", "failed", "it is too loud at the end")
    monkeypatch.setitem(CHECKS, "noise", lambda *_: (loud,))
    ran = knotwork("check", tmp_path / "plan" / "trajectory.json", "--robot", "planar2")
    assert "it is too loud at the end" in ran.failed()


def test_refuses_finding_with_nan() -> None:
    with pytest.raises(kw.InputError, match="on 'play' of joint 'elbow' has the value NaN"):
        Finding("Play", "joint", "elbow", "play", "met", "none", value=float("nan"))


def test_warnings_are_listed_apart_from_failures() -> None:
    joints = kw.load_robot("ur5").joint_names
    ends = [{"joints": dict.fromkeys(joints, angle)} for angle in (0.0, 0.1)]
    task = {
        "robot": "ur5",
        "waypoints": [ends[0], ends[1] | {"after": 3, "do": {"arc": "on"}}],
    }
    report = kw.plan(task).report
    data = report.to_dict()
    assert data["warnings"] == [str(found) for found in report.warnings]
    assert any("the motion ends with it on" in text for text in data["warnings"])
    assert not {str(found) for found in report.failures} & set(data["warnings"])


ODD: dict[str, Any] = {"group": "Odd", "subject": "tool", "name": "", "verdict": "failed"}
LEFT_OUT: list[dict[str, Any]] = [
    {},
    {"value": 5.0},
    {"value": 5.0, "verdict": "information"},
    {"value": 5.0, "limit": 4.0, "name": "left"},
    {"value": 5.0, "interval": (0.5, 1.0)},
    {"value": 5.0, "requested": (1.0, 2.0), "achieved": (1.0, 7.0), "subject": "waypoint"},
    {"verdict": "warning"},
    {"verdict": "information"},
]


@pytest.mark.usefixtures("without_plots")
def test_outputs_show_incomplete_findings(
    knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    findings = [
        Finding(**ODD | {"quantity": f"oddity {i}", "fact": f"it is odd ({i})"} | rest)
        for i, rest in enumerate(LEFT_OUT)
    ]
    monkeypatch.setitem(CHECKS, "odd", lambda motion, scenario, joints: findings)
    plan = kw.plan("planar2_closed_form")
    page = report_page(plan).html
    assert plan.view().html
    printed = knotwork("plan", "planar2_closed_form", "--full").out
    assert str(plan)
    assert repr(plan) == f"<Plan 'planar2_closed_form': {plan.report.counts_text}>"
    for found in findings:
        shown = found.message if found.value is None else found.quantity
        assert shown in printed
        assert shown in page
        assert found.verdict != "failed" or found.message in page
    json.dumps(plan.report.to_dict(), allow_nan=False)
    failed = {found.quantity for found in plan.report.failures}
    assert failed == {found.quantity for found in findings if found.verdict == "failed"}


@pytest.mark.parametrize(("count", "last"), [(4, "odd 3"), (5, "odd 4"), (6, "and 2 more")])
def test_no_line_hides_one_line(count: int, last: str) -> None:
    findings = [
        Finding("Odd", "tool", "", "oddity", "information", "", highlight=f"odd {i}")
        for i in range(count)
    ]
    lines = Report("odd", None, "cubic", 0.0, 1.0, findings=tuple(findings)).brief()
    assert lines[-1].strip() == last


def test_number_of_further_failures_is_not_marked_as_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    findings = [Finding(**ODD, quantity=f"oddity {i}", fact=f"odd ({i})") for i in range(7)]
    monkeypatch.setitem(CHECKS, "odd", lambda motion, scenario, joints: findings)
    lines = kw.plan("planar2_closed_form").report.brief()
    assert lines[5:7] == ["FAIL odd (4)", "     and 2 more"]


@pytest.mark.usefixtures("without_plots")
def test_place_of_failure_is_that_of_its_worst_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    intervals = (0.1, 4.9), (5.1, 14.9)
    found = Finding(**ODD, quantity="oddity", fact="", short_fact="odd", intervals=intervals)
    found = replace(found, interval=intervals[1])
    monkeypatch.setitem(CHECKS, "odd", lambda motion, scenario, joints: (found,))
    page = html.unescape(report_page(kw.plan("paper_case")).html)
    assert "odd from 5.100 to 14.900 s, between 'B' and 'C'" in page


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"verdict": "fail"}, "verdict 'fail'; accepted: met, failed, undecided, warning, inf"),
        ({"verdict": "Met"}, "verdict 'Met'"),
        ({"verdict": None}, "verdict null"),
        ({"proof": "certain"}, "proof 'certain'; accepted: exact, bounded, sampled"),
        ({"subject": "nonsense"}, "subject 'nonsense'; accepted: "),
    ],
)
def test_refuses_unknown_verdicts_and_proofs(wrong: dict[str, Any], message: str) -> None:
    given = {"subject": "motion", "verdict": "met", "proof": "exact", **wrong}
    with pytest.raises(kw.InputError, match=f"'mine' of [a-z]+ '' has the {message}"):
        Finding("Mine", name="", quantity="mine", fact="it is wrong", **given)


def test_only_known_verdicts_pass() -> None:
    finding = Finding("Mine", "motion", "", "mine", "met", "it is right")
    object.__setattr__(finding, "verdict", "fail")
    assert not finding.ok


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ([-3, -0.07], "35 %: a position -0.2 rad, at most -0.07 rad,"),
        ([-99, 0.2], "0 %: a position -0.2 rad, at most 0.2 rad,"),
        ([-0.9, 9], "44 %: a position -0.4 of -0.9 rad"),
    ],
)
def test_utilisation_of_position_limits(limits: list[float], words: str) -> None:
    ends = {"joints": {"a": -0.4}}, {"joints": {"a": -0.2}, "after": 1}
    report = kw.plan({"limits": {"position": {"a": limits}}, "waypoints": ends}).report
    assert words in str(report)
    (finding,) = report.select(quantity="position")
    assert "%" not in finding.message
    least = Topic("Mine").at_least("height", "0.1 m above", 0.1, -0.2, "m")
    assert (least.ok, least.utilisation) == (True, 0.0)

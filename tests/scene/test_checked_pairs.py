"""Which pairs of bodies are checked: links by the joints of the URDF, names by what they mean."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

import knotwork as kw
from knotwork.verification import Finding

Vector = tuple[float, float, float]
NOWHERE: Vector = (0.0, 0.0, 0.0)


def link(name: str, size: Vector | None = None, at: Vector = NOWHERE) -> str:
    """A link of a URDF: a box, or nothing to collide."""
    if size is None:
        return f'<link name="{name}"/>'
    shape = f'<geometry><box size="{size[0]} {size[1]} {size[2]}"/></geometry>'
    origin = f'<origin xyz="{at[0]} {at[1]} {at[2]}"/>'
    return f'<link name="{name}"><collision>{origin}{shape}</collision></link>'


def joint(name: str, parent: str, child: str, at: Vector = NOWHERE, *, moves: bool = True) -> str:
    """A joint of a URDF: fixed, or one that turns about z."""
    kind, more = ("revolute", '<axis xyz="0 0 1"/>') if moves else ("fixed", "")
    limit = '<limit lower="-3.1" upper="3.1" velocity="3" effort="9"/>' if moves else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at[0]} {at[1]} {at[2]}"/>{more}{limit}</joint>'
    )


PEDESTAL = link("base", (0.1, 0.1, 0.05), (0, 0, -0.05))
UPPER = link("upper", (0.4, 0.04, 0.04), (0.2, 0, 0))
FOREARM = link("forearm", (0.3, 0.04, 0.04), (0.15, 0, 0))
ELBOW = joint("elbow", "upper", "forearm", (0.4, 0, 0.1))


def robot(folder: Path, parts: list[str], **more: Any) -> str:
    """Write a URDF and a robot file."""
    (folder / "arm.urdf").write_text(f'<robot name="arm">{"".join(parts)}</robot>')
    (folder / "arm.yaml").write_text(yaml.safe_dump({"urdf": "arm.urdf", **more}))
    return str(folder / "arm.yaml")


def turn(arm: str, start: list[float], end: list[float], **more: Any) -> kw.Report:
    """The report on a motion from joint values to others."""
    names = kw.load_robot(arm).joint_names
    first, last = (dict(zip(names, q, strict=True)) for q in (start, end))
    waypoints = [{"joints": first}, {"joints": last, "after": 4}]
    return kw.plan({"robot": arm, "waypoints": waypoints, **more}).report


def clearances(report: kw.Report) -> dict[str, Finding]:
    return {one.name: one for one in report.findings if one.quantity == "clearance"}


def said(report: kw.Report, quantity: str) -> str:
    return " | ".join(one.message for one in report.select(quantity=quantity))


def post(at: Vector) -> list[str]:
    """A post that a fixed joint holds on the base, by way of a plate."""
    return [
        link("plate"),
        link("post", (0.04, 0.04, 0.4)),
        joint("foot", "base", "plate", at, moves=False),
        joint("stand", "plate", "post", moves=False),
    ]


def test_what_is_fixed_to_the_base_is_checked_against_the_first_moving_link(
    tmp_path: Path,
) -> None:
    parts = [PEDESTAL, UPPER, joint("shoulder", "base", "upper"), *post((0.3, 0, 0))]
    arm = robot(tmp_path, parts, tool_frame="upper")
    report = turn(arm, [0.8], [-0.8])
    assert not report.ok
    assert not clearances(report)["upper, post"].ok
    exempt = said(report, "pairs_not_checked")
    assert "as a joint joins them: base and upper" in exempt
    assert "post" not in exempt
    assert turn(arm, [0.8], [0.3]).ok


def test_links_that_always_touch_are_checked_where_one_moves_deeper_into_the_other(
    tmp_path: Path,
) -> None:
    """A disc that is always 1 mm in a post, and beside it a fin that is swept 39 mm into it."""
    disc = '<collision><geometry><cylinder radius="0.3" length="0.04"/></geometry></collision>'
    fin = (
        '<collision><origin xyz="0.4 0 0.1"/><geometry><box size="0.2 0.04 0.04"/></geometry>'
        "</collision>"
    )
    swept = f'<link name="upper">{disc}{fin}</link>'
    parts = [PEDESTAL, swept, joint("shoulder", "base", "upper"), *post((0.319, 0, 0))]
    report = turn(robot(tmp_path, parts, tool_frame="upper"), [0.8], [-0.8])
    failed = {name for name, one in clearances(report).items() if not one.ok}
    assert {frozenset(name.split(", ")) for name in failed} == {frozenset(("upper", "post"))}


FINGER = link("tool", (0.05, 0.04, 0.04))
HAND = [FINGER, joint("wrist", "forearm", "tool", (0.3, 0, 0), moves=False)]
ARM = [PEDESTAL, UPPER, FOREARM, joint("shoulder", "base", "upper"), ELBOW]
POINTER = {"shape": {"box": [0.02, 0.02, 0.3]}}


@pytest.mark.parametrize("key", ["ignore", "allow"])
def test_a_name_of_a_link_and_of_the_tool_has_to_say_which(key: str, tmp_path: Path) -> None:
    arm = robot(tmp_path, [*ARM, *HAND], tool_frame="tool")

    def task(name: str) -> dict[str, Any]:
        ball = {"sphere": 0.05, "position": [0.1, 0, 0.1]}
        if key == "ignore":
            return {"tool": POINTER, "collisions": {"ignore": [[name, "upper"]]}}
        return {"tool": POINTER, "scene": {"objects": {"ball": {**ball, "allow": [name]}}}}

    with pytest.raises(kw.KnotworkError) as fault:
        turn(arm, [0, 1.5], [0, 3.1], **task("tool"))
    message = str(fault.value)
    assert "'tool'" in message
    assert "'link:tool' or 'scenario:tool'" in message
    assert ("collisions.ignore[0]" if key == "ignore" else "scene.objects.ball.allow") in message
    other = "upper" if key == "ignore" else "ball"
    for name, gone, left in (
        ("scenario:tool", "tool", "link:tool"),
        ("link:tool", "link:tool", "tool"),
    ):
        checked = clearances(turn(arm, [0, 1.5], [0, 3.1], **task(name)))
        assert f"{gone}, {other}" not in checked
        assert f"{left}, {other}" in checked


def test_a_tool_that_is_in_a_link_at_home_but_not_everywhere_is_checked(tmp_path: Path) -> None:
    home = {"home": {"shoulder": 0.0, "elbow": 3.1}}
    flange = [link("tip"), joint("wrist", "forearm", "tip", (0.3, 0, 0), moves=False)]
    arm = robot(tmp_path, [*ARM, *flange], tool_frame="tip", configurations=home)
    report = turn(arm, [0, 1.5], [0, 3.1], tool=POINTER)
    assert not clearances(report)["tool, upper"].ok


def test_a_robot_that_is_not_checked_against_itself_is_named(tmp_path: Path) -> None:
    arm = robot(tmp_path, ARM, tool_frame="forearm")
    ball = {"ball": {"sphere": 0.05, "position": [0, 0, 2]}}
    report = turn(arm, [0, 0.5], [0, 1], scene={"objects": ball}, collisions={"self": False})
    assert "forearm, base" not in clearances(report)
    assert "`self: false`: base and upper; base and forearm" in said(report, "pairs_not_checked")


def test_an_object_of_any_name_has_a_row_of_its_own(tmp_path: Path) -> None:
    arm = robot(tmp_path, ARM, tool_frame="forearm")
    ball = {"itself": {"sphere": 0.05, "position": [0, 0, 2]}}
    report = turn(arm, [0, 0.5], [0, 1], scene={"objects": ball})
    shown = [name for name, one in clearances(report).items() if not one.detail]
    assert "forearm, base" in shown
    assert [name for name in shown if name.endswith(", itself")]

"""Events and segments in pictures and pages: data of the strip, marks on the edge of plots."""

from __future__ import annotations

import numpy as np
import pytest
from welding import do, weld

import drawn as page
import knotwork as kw
from knotwork.view import plot_joints, plot_tool


@pytest.fixture(scope="module")
def plan() -> kw.Plan:
    return kw.plan(
        weld(seam=do({"arc": "on", "at": 20}, {"wait": 0.2}, {"b": "x"}) | {"stop": None})
    )


def test_the_strip_has_them(plan: kw.Plan) -> None:
    strip = page.scene(plan.view())["strip"]
    assert strip["events"] == [[one.time, one.said] for one in plan.events]
    assert [one[:3] for one in strip["segments"]] == [
        [one.start, one.end, one.name] for one in plan.segments
    ]


def test_plots_mark_them_on_their_upper_edge(plan: kw.Plan) -> None:
    times = [one.time for one in plan.events]
    for figure in (plot_joints(plan), plot_tool(plan)):
        drawn = {str(line.get_gid()).split(":")[0]: line for line in figure.axes[0].lines}
        named = figure.legends[-1].get_title().get_text()
        assert named == "events: " + ", ".join(dict.fromkeys(one.said for one in plan.events))
        assert drawn["event"].get_xdata().tolist() == times
        for kind in ("tool path", "wait"):
            spans = [(one.start, one.end) for one in plan.segments if one.kind == kind]
            found = np.reshape(drawn[kind].get_xdata(), (-1, 3))[:, :2]
            assert found.tolist() == [list(span) for span in spans]
        assert "way" not in drawn

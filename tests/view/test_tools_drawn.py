"""Tools of the shipped scenarios are drawn where a hand or a flange carries them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial import cKDTree

import knotwork as kw
from drawn import faces, scene, vertices
from shipped import SCENARIO_FILES
from sweeps import mostly_exhaustive

GAP = 0.01
"""Most between a part and what carries it [m]: surfaces are sampled."""
WITH_TOOL = [name for name in SCENARIO_FILES if kw.load_scenario(name).scene.tool]


def surface(corners: Any, count: int = 60_000) -> Any:
    """Points on triangles of shape (n, 3, 3), a millimetre or two apart."""
    first, *sides = np.moveaxis(corners - corners[:, :1] * [[[0], [1], [1]]], 1, 0)
    area = np.linalg.norm(np.cross(*sides), axis=1)
    chance = np.random.default_rng(0)
    which = chance.choice(len(corners), count, p=area / area.sum())
    u, v = chance.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    return first[which] + u * sides[0][which] + v * sides[1][which]


@pytest.mark.parametrize("name", mostly_exhaustive(WITH_TOOL, "ur10_weld"))
def test_a_tool_goes_on_from_what_carries_it(name: str) -> None:
    """Each part begins at the hand, the flange or a part before it."""
    task = yaml.safe_load(SCENARIO_FILES[name].read_text(encoding="utf-8"))
    tool = {key: value for key, value in task["tool"].items() if key != "holds"}
    rest = [{"joints": "home"}, {"joints": "home", "after": 1}]
    units = {"units": task["units"]} if "units" in task else {}
    page = scene(kw.plan({"robot": task["robot"], "tool": tool, "waypoints": rest, **units}).view())
    shapes = [one for one in page["things"] if one["name"] == "tool shape"]
    tools = [surface(vertices(one["mesh"])[faces(one["mesh"])]) for one in shapes]
    arm = page["shapes"][shapes[0]["carrier"]]
    corners = np.concatenate([vertices(mesh)[faces(mesh)] for mesh in arm])
    parts = [surface(corners), *tools]
    trees = [cKDTree(part) for part in parts]
    for i, part in enumerate(parts[1:], 1):
        gap = min(tree.query(part)[0].min() for tree in trees[:i])
        assert gap < GAP, f"part {i} is {1e3 * gap:.1f} mm from what carries it"

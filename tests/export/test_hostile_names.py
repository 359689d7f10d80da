"""Joints of any name through every format that is read back: the same motion of the same joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import knotwork as kw
from knotwork.files import export
from knotwork.files.foreign import read_trajectory
from sweeps import examples

NAMES = [
    *("time", "time_step_s", "position", "tool.position_x", "j.position_rad", "nan", "null"),
    *("a\nb", "a\r\nb", " x ", "a,b", 'a"b', "#a", "- a", "a: b", "{a}"),
    *("\u2028x", "\ufeffz", "x\x85y", "\x1b[0m", "😀", "=1+1", "'"),
]
TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1)
FORMATS = {
    "samples.csv": lambda motion: export.content(export.motion_table(motion, rate=50), "csv"),
    "knots.csv": lambda motion: export.content(export.motion_table(motion, knots_only=True), "csv"),
    "samples.json": lambda motion: export.content(export.motion_table(motion, rate=50), "json"),
    "pvt.csv": lambda motion: export.content(motion, "pvt"),
    "steps.csv": lambda motion: export.content(motion, "pvt", incremental=True, degrees=True),
    "ros2.yaml": lambda motion: motion.to_ros2(),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("names")


def there_and_back(names: list[str], folder: Path) -> None:
    values = {name: 0.1 * i for i, name in enumerate(names)}
    units = dict.fromkeys(names, "rad")
    stop = {"stop": True}
    motion = kw.plan(
        {
            "joint_units": units,
            "waypoints": [
                {"joints": values, "time": 0, **stop},
                {
                    "joints": {name: value + 0.7 for name, value in values.items()},
                    "after": 1,
                    **stop,
                },
                {"joints": dict.fromkeys(names, 1.1), "after": 1.5, **stop},
            ],
        }
    ).trajectory
    times = np.linspace(0, 2.5, 40)
    for name, write in FORMATS.items():
        content = write(motion)
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        back, faults = read_trajectory(path, motion.joint_names, motion.joint_units)
        assert back.joint_names == tuple(names)
        assert not faults
        atol = 1e-4 if "samples" in name else 1e-8
        np.testing.assert_allclose(back.position(times), motion.position(times), atol=atol)


@pytest.mark.parametrize("name", NAMES)
def test_names_that_have_a_meaning_elsewhere(name: str, folder: Path) -> None:
    there_and_back([name], folder)
    there_and_back(["other", name, f"{name}2"], folder)


@examples(5, 30)
@given(st.lists(TEXT, min_size=1, max_size=3, unique=True))
@example(["a", "a "])
@example(["time", "s", "position"])
def test_any_names(folder: Path, names: list[str]) -> None:
    if len({name.replace("\r\n", "\n").replace("\r", "\n") for name in names}) == len(names):
        there_and_back(names, folder)

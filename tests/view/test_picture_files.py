"""Pictures in files: whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from knotwork import Plan
from knotwork.errors import InputError
from knotwork.view import plot_joints, save_figure

START = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.fixture(scope="module")
def figure(paper_case: Plan) -> Figure:
    return plot_joints(paper_case)


@pytest.mark.parametrize("suffix", START)
def test_each_type_is_what_its_name_says_and_the_same_each_time(
    suffix: str, figure: Figure, tmp_path: Path
) -> None:
    path = save_figure(figure, tmp_path / f"a{suffix}")
    assert path == tmp_path / f"a{suffix}"
    assert path.read_bytes().startswith(START[suffix])
    again = save_figure(figure, tmp_path / f"b{suffix.upper()}")
    assert again.read_bytes() == path.read_bytes()
    assert {entry.name for entry in tmp_path.iterdir()} == {path.name, again.name}


def test_a_picture_is_replaced_and_readable_by_others(figure: Figure, tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_text("old")
    save_figure(figure, str(path))
    assert path.read_bytes().startswith(START[".png"])
    mask = os.umask(0)
    os.umask(mask)
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.png.txt", ".png", "a.yaml"])
def test_other_suffixes_are_refused(name: str, figure: Figure, tmp_path: Path) -> None:
    (tmp_path / name).write_text("kept")
    with pytest.raises(InputError, match=r"give \.png, \.svg, \.pdf"):
        save_figure(figure, tmp_path / name)
    assert (tmp_path / name).read_text() == "kept"

"""Maps of a study: in the scenario's units, plain numbers, and only where something differs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from figures import outside, overlaps

import knotwork as kw
from knotwork.view import save_figure

TASK: dict[str, Any] = {
    "units": {"length": "mm"},
    "joint_units": {"lift": "m"},
    "limits": {"velocity": 1000},
    "frames": {"bench": {"position": [0, 0, 0]}},
    "waypoints": [{"joints": {"lift": 0}}, {"joints": {"lift": 400}, "after": 1}],
}


def study(vary: dict[str, Any]) -> Any:
    return kw.sweep(TASK, vary=vary, workers=0)


def scales(figure: Any) -> list[str]:
    """Of the figures that maps show."""
    bars = [axes for axes in figure.axes if axes.get_label() == "<colorbar>"]
    return [axes.get_ylabel().replace("\n", " ") for axes in bars]


def test_axes_say_the_units_of_the_file() -> None:
    made = study({"waypoints[1].after": [1, 2], "frames.bench.position[0]": [0, 250]})
    axes = made.plot().axes[0]
    assert axes.get_xlabel() == "waypoints[1].after [s]"
    assert axes.get_ylabel() == "frames.bench.position[0] [mm]"
    other = study({"limits.velocity": [1000, 1100], "knots": ["paper", "balanced"]}).plot()
    labels = {other.axes[0].get_xlabel(), other.axes[0].get_ylabel()}
    assert labels == {"limits.velocity", "knots"}  # mm/s or deg/s, and words


def test_figures_are_drawn_in_the_units_of_the_file(monkeypatch: pytest.MonkeyPatch) -> None:
    made = study({"waypoints[1].after": [1, 2], "frames.bench.position[0]": [0, 250]})
    rows = [row | {"clearance": row["duration"]} for row in made.rows()]
    monkeypatch.setattr(made, "_rows", rows)
    figure = made.plot(["clearance"])
    assert scales(figure) == ["clearance to the surroundings [mm]"]
    *_, dots = figure.axes[1].collections
    assert dots.get_clim() == (1000, 2000)


def test_what_is_the_same_in_all_rows_is_not_drawn_unasked() -> None:
    made = study({"waypoints[1].after": [1, 1.0001], "frames.bench.position[0]": [0, 250]})
    assert scales(made.plot()) == []  # the verdict alone
    asked = made.plot(["duration"])
    assert scales(asked) == ["duration [s]"]


def test_verdicts_have_colours_that_change_with_those_of_the_page(tmp_path: Path) -> None:
    made = study({"waypoints[1].after": [0.5, 1], "frames.bench.position[0]": [0, 250]})
    drawing = save_figure(made.plot(), tmp_path / "map.svg").read_text(encoding="utf-8")
    assert "#009e73" in drawing
    assert "#d55e00" in drawing
    assert "<image" not in drawing


AFTER, SPEED, BENCH = "waypoints[1].after", "limits.velocity", "frames.bench.position[0]"
SAMPLES = {AFTER: "uniform(0.3, 1)", SPEED: "uniform(500, 1000)", BENCH: "uniform(0, 9)"}


def sampled(*paths: str, **more: Any) -> Any:
    vary = {path: SAMPLES[path] for path in paths}
    return kw.sweep(TASK, vary=vary | more, samples=6, workers=0)


def dots(figure: Any) -> list[int]:
    """How many each panel has."""
    panel_axes = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    return [sum(len(one.get_offsets()) for one in axes.collections) for axes in panel_axes]


def test_two_values_that_go_together_are_dots_in_one_panel() -> None:
    assert dots(sampled(AFTER, SPEED).plot([])) == [6]
    rows = kw.sweep(TASK, vary={AFTER: [1, 2], "knots": ["paper"] * 2}, together=True, workers=0)
    assert dots(rows.plot([])) == [2]


def test_one_value_has_a_curve_with_verdicts_below_and_three_are_too_many() -> None:
    (axes,) = sampled(AFTER).plot(["duration"]).axes
    (line,) = axes.lines
    assert list(line.get_xdata()) == sorted(line.get_xdata())
    assert dots(axes.figure) == [6]
    with pytest.raises(kw.InputError, match="3 values are varied, and a picture shows one or two"):
        sampled(*SAMPLES).plot(["duration"])


@pytest.mark.parametrize("together", [False, True])
def test_long_names_are_neither_cut_nor_over_each_other(together: bool) -> None:
    name = "the_place_above_the_left_holder"
    task = TASK | {"waypoints": [TASK["waypoints"][0], TASK["waypoints"][1] | {"name": name}]}
    vary = {f"waypoints[{name}].after": [0.5, 1000.25], BENCH: [0.5, 1000.25]}
    figure = kw.sweep(task, vary=vary, together=together, workers=0).plot()
    figure.draw_without_rendering()
    assert overlaps(figure) == []
    assert outside(figure) == []

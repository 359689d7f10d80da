"""The curve of duration against torque and jerk as a picture."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from knotwork.view.style import colour, dress, new_figure, printable, settings

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from knotwork.units import Units


WIDE = 20.0
"""Values that differ by more than this factor are shown on a logarithmic axis."""


class Curve(Protocol):
    """What is drawn: `knotwork.tradeoffs.Tradeoff`."""

    @property
    def scenario(self) -> str:
        """Name of the scenario."""

    @property
    def objective(self) -> str:
        """What is made least."""

    @property
    def units(self) -> Units:
        """Those of the scenario."""

    @property
    def points(self) -> Sequence[Any]:
        """From the least time on."""


def plot_tradeoff(curve: Curve) -> Figure:
    """Draw duration against the integral of torque squared, peak torque and peak jerk.

    Peaks are shown as parts of the limit where there is one.

    >>> swing = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> limits = {"velocity": 2, "acceleration": 4, "jerk": 40}
    >>> curve = kw.tradeoff({"limits": limits, "waypoints": swing}, factors=[1, 2])
    >>> [axis.get_ylabel() for axis in plot_tradeoff(curve).axes]
    ['peak jerk [% of its limit]']

    Args:
        curve: What `knotwork.tradeoff` returns.

    Returns:
        A figure, not known to `pyplot`.
    """
    points = curve.points
    jerks = [curve.units.shown(one.peak_jerk, one.jerk_unit) for one in points]
    unit = " or ".join(sorted({unit for _, unit in jerks}))
    panels = [
        ("∫τ² [N² m² s]", [one.squared_effort for one in points]),
        _shown("peak torque", "N m", (one.peak_effort for one in points), points, "effort_use"),
        _shown("peak jerk", unit, (value for value, _ in jerks), points, "jerk_use"),
    ]
    drawn = [(label, values) for label, values in panels if None not in values]
    durations = [one.duration for one in points]
    with settings():
        figure = new_figure(len(drawn), 1)
        axes = figure.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0]
        for i, (axis, (label, values)) in enumerate(zip(axes, drawn, strict=True)):
            axis.plot(durations, values, marker="o", color=colour(i), clip_on=False)
            _mark(axis, curve.points, values)
            axis.set_ylabel(label)
            axis.set_ylim(0.0, 1.1 * max(values) or 1.0)
            axis.margins(x=0.04)
            dress(axis)
            if max(values) > WIDE * min(values) > 0.0:
                _show_powers(axis, min(values), max(values))
        _legend(figure, list(axes))
        axes[-1].set_xlabel("duration [s]")
        what = {"effort": "torque", "jerk": "jerk"}[curve.objective]
        figure.suptitle(f"{printable(curve.scenario)}: duration against {what}")
    return figure


def _show_powers(axis: Axes, least: float, most: float) -> None:
    """Show positive values on a logarithmic axis that has room around them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_yscale("log")
    axis.set_ylim(least / 1.5, 1.5 * most)
    axis.yaxis.set_major_locator(LogLocator(numticks=6))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())


def _mark(axis: Axes, points: Sequence[Any], values: Sequence[float]) -> None:
    """Mark the motions that fail, and those that stand in the place of one that fails."""
    for ok, marker, label in (
        (True, "o", "least torque fails: jerk counts too"),
        (False, "X", "fails"),
    ):
        pairs = zip(points, values, strict=True)
        here = [(p.duration, v) for p, v in pairs if p.failure and p.ok == ok]
        if here:
            look: dict[str, Any] = {"markerfacecolor": "white" if ok else "red", "markersize": 9.0}
            axis.plot(
                *zip(*here, strict=True), marker, color="black", label=label, clip_on=False, **look
            )


def _legend(figure: Figure, axes: Sequence[Axes]) -> None:
    """Say once, below the panels, what the marks mean."""
    found = {
        label: handle
        for axis in axes
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    if found:
        figure.legend(
            list(found.values()), list(found), loc="outside lower center", ncols=len(found)
        )


def _shown(
    name: str, unit: str, values: Iterable[Any], points: Sequence[Any], use: str
) -> tuple[str, list[Any]]:
    """Values in percent of a limit, or as they are where there is none."""
    uses = [getattr(point, use) for point in points]
    if None not in uses:
        return f"{name} [% of its limit]", [100.0 * share for share in uses]
    return f"{name} [{unit}]", list(values)

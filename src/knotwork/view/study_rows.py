"""Content of pictures of a study: verdicts and their colours, figures, and places of rows."""

from __future__ import annotations

import math
import re
import textwrap
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.view.style import LARGE, NORMAL, number, printable, shortened

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_REASONS = 7
"""That have a colour of their own; the others share one."""
PASSED = "passed"
PASSED_COLOUR, OTHER_COLOUR = "#009E73", "#B8B8B8"
# Reasons, most frequent first; distinct in lightness, too.
REASON_COLOURS = ("#D55E00", "#404040", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442", "#0072B2")
MOST_TICKS = 9
"""Places that are written each; of more only round numbers are."""
LEAST_GAP = 0.02
"""Part of their range by which few values must differ to be drawn to scale."""
LEAST_SPREAD = 1e-3
"""Part of a figure by which rows must differ for it not to be the same."""
LETTER = 0.092
"""Width of a letter of normal size [in]."""


@dataclass(frozen=True, eq=False)
class Places:
    """Places of rows along one direction of a picture.

    Attributes:
        title: The varied value.
        at: Place of each row, shape (n,).
        names: Of the places 0, 1, …, where values are no numbers.
    """

    title: str
    at: Any
    names: list[str] | None

    @cached_property
    def values(self) -> Any:
        """The places that there are, in order."""
        return np.unique(self.at)

    @property
    def edges(self) -> Any:
        """Edges of the cells around the places that there are."""
        if len(self.values) == 1:
            return self.values[0] + np.array([-0.5, 0.5])
        middle = 0.5 * (self.values[1:] + self.values[:-1])
        first, last = 2 * self.values[0] - middle[0], 2 * self.values[-1] - middle[-1]
        return np.concatenate([[first], middle, [last]])

    def _fit(self, length: float, upright: bool) -> bool:
        """Whether each of the places can be written along an axis."""
        if len(self.values) > MOST_TICKS:
            return False
        gaps = np.diff(self.values) * length / (self.edges[-1] - self.edges[0])
        least = 0.25 if upright else LETTER * max(len(number(v)) + 1 for v in self.values)
        return bool(np.all(gaps > least))

    def dress(self, axis: Any, length: float) -> None:
        """Label an axis of a panel of this length [in]."""
        from matplotlib.ticker import MaxNLocator

        upright = axis.axis_name == "y"
        if self.names is None:
            axis.set_major_formatter(lambda value, _: number(value))
            if self._fit(length, upright):
                axis.set_ticks(self.values)
                return
            most = min(max(2, int(length / (0.35 if upright else 0.8))), 7)
            axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]))
            return
        lying = len(self.names) * (max(map(len, self.names)) + 2) * LETTER <= length
        most = max(2, int(length / (0.2 if upright or not lying else LETTER)))
        shown = range(0, len(self.names), -(-len(self.names) // most))
        axis.set_ticks(shown, [self.names[i] for i in shown])
        if not upright and not lying:
            for label in axis.get_ticklabels():
                label.set(rotation=35, ha="right", rotation_mode="anchor")


class DrawnStudy:
    """A study as its pictures need it."""

    def __init__(self, study: Any) -> None:
        self._study = study
        pairs = zip(study["verdict"], study["reason"], strict=True)
        kinds = [verdict if verdict == PASSED else reason for verdict, reason in pairs]
        self.kinds = np.array(kinds, str)
        """For each row that it passed, or why it did not, shape (n,)."""
        reasons = sorted(set(kinds) - {PASSED}, key=lambda kind: (-kinds.count(kind), kind))
        colours = dict.fromkeys(reasons, OTHER_COLOUR)
        colours |= dict(zip(reasons[:MOST_REASONS], REASON_COLOURS, strict=False))
        self.palette = {PASSED: PASSED_COLOUR, **colours}
        """A colour for rows that pass, and for each of the reasons, most frequent first."""
        self.codes = np.array([list(self.palette).index(kind) for kind in kinds], float)
        """For each row which of these colours it has, shape (n,)."""
        self.axes = [
            [self._places(column, len(axis) == 1) for column in axis] for axis in study.together
        ]
        """The varied values, by the axes of the study."""

    def _places(self, column: str, alone: bool) -> Places:
        values, title = self._study[column], printable(self._study.titles[column])
        if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
            at = np.array(values, float)
            return _by_order(title, at) if alone and _is_uneven(at) else Places(title, at, None)
        texts = [str(value).lower() if isinstance(value, bool) else str(value) for value in values]
        names = list(dict.fromkeys(texts))
        order = {name: i for i, name in enumerate(names)}
        at = np.array([order[name] for name in texts], float)
        return Places(printable(column), at, shortened(names, 24))

    @property
    def verdict_look(self) -> dict[str, Any]:
        """Colours of the codes, as Matplotlib takes them."""
        from matplotlib.colors import ListedColormap

        colours = list(self.palette.values())
        return {"cmap": ListedColormap(colours), "vmin": -0.5, "vmax": len(colours) - 0.5}

    def label(self, figure: str) -> str:
        """Title of a figure, with its unit."""
        known = self._study.figures[figure]
        unit = self._study.units.shown(0.0, known.unit)[1]
        return f"{known.title} [{unit}]" if unit else known.title

    def values(self, figure: str) -> Any:
        """A figure by row, NaN where a row does not pass or does not have it, shape (n,)."""
        factor = self._study.units.shown(1.0, self._study.figures[figure].unit)[0]
        given = np.array(self._study[figure], float)  # which makes NaN of None
        return np.where((self.kinds == PASSED) & np.isfinite(given), factor * given, math.nan)

    def write_heading(self, figure: Figure) -> None:
        """Write the name of the study, and how many rows pass, above all panels."""
        passed = np.count_nonzero(self.kinds == PASSED)
        text = f"{printable(self._study.name)}: {passed} of {len(self.kinds)} rows pass"
        figure.suptitle(wrapped(text, 0.8 * figure.get_figwidth()), fontsize=LARGE)

    def write_legend(self, figure: Figure) -> None:
        """Explain the colours of verdicts below all panels."""
        from matplotlib.patches import Patch

        counts = {kind: np.count_nonzero(self.kinds == kind) for kind in self.palette}
        kinds = [kind for kind, count in counts.items() if count]
        more = [kind for kind in kinds if self.palette[kind] == OTHER_COLOUR]
        texts = {f"{printable(k)} ({counts[k]})": self.palette[k] for k in kinds if k not in more}
        if more:
            texts[f"{len(more)} other reasons ({sum(counts[k] for k in more)})"] = OTHER_COLOUR
        columns = 0.95 * figure.get_figwidth() / (LETTER * (max(map(len, texts)) + 8))
        shown = [Patch(color=colour, label=text) for text, colour in texts.items()]
        columns = max(1, min(4, int(columns)))
        figure.legend(handles=shown, loc="outside lower center", ncols=columns, frameon=False)


def _is_uneven(at: Any) -> bool:
    """Whether a few values are so uneven, as powers of ten are, that some do not fit."""
    values = np.unique(at)
    few = 2 < len(values) <= MOST_TICKS
    return few and bool(np.diff(values).min() < LEAST_GAP * np.ptp(values))


def _by_order(title: str, at: Any) -> Places:
    values = np.unique(at)
    return Places(title, np.searchsorted(values, at).astype(float), [number(v) for v in values])


def differ(values: Any) -> bool:
    """Whether values of a figure differ by more than rounding; NaN are left out."""
    known = values[np.isfinite(values)]
    return len(known) > 0 and bool(np.ptp(known) > LEAST_SPREAD * np.abs(known).max())


def wrapped(text: str, length: float, size: float = NORMAL) -> str:
    """Break text into lines of this length [in]: at spaces, and within the words of paths."""
    hint = "\v"
    parts = re.sub(r"([._])(?=[^\W\d])", rf"\1{hint}", text)
    letters = max(6, int(length / (LETTER * size / NORMAL)))
    lines = textwrap.wrap(parts, letters, replace_whitespace=False, break_on_hyphens=False)
    return "\n".join(lines).replace(hint, "")

"""Style of pictures: sizes, colours for colour-blind readers, units and names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#000000", "#56B4E9", "#8C8C8C")
"""Okabe and Ito's colours and grey.

Yellow is left out, because it is too light for a line on white. Vermillion is reserved for
failures.
"""
WRONG = "#D55E00"
FAINT = "#B8B8B8"
DARK = "#404040"
GRID = "#E4E4E4"
NIGHT = {
    "#ffffff": "#15181c",
    "#000000": "#e4e9ef",
    DARK: "#b9c3ce",
    "#e4e4e4": "#2b323a",
    "#b8b8b8": "#66717d",
    "#0072b2": "#4aa3e8",
    "#e69f00": "#f2b233",
    "#009e73": "#2cc69b",
    "#cc79a7": "#ec9fcb",
    "#56b4e9": "#a5dcff",
    "#8c8c8c": "#9aa0a6",
    "#d55e00": "#ff7f3f",
}
"""Colours on dark pages: lighter ones, which differ as much."""
DASHES: tuple[str | tuple[float, tuple[float, ...]], ...] = (
    "solid",
    (0, (5, 1.6)),
    (0, (1, 1.2)),
    (0, (6, 1.5, 1, 1.5)),
    (0, (9, 2)),
    (0, (4, 1.2, 1, 1.2, 1, 1.2)),
    (0, (2.5, 2.5)),
)
"""Line styles that differ without colour, because planners overlap in one panel."""
_LIMIT = {"color": DARK, "ls": (0, (7, 4)), "lw": 1.3, "zorder": 2}
_EXCESS = {"color": WRONG, "lw": 8, "alpha": 0.6, "solid_capstyle": "butt", "zorder": 2.5}
_CIRCLE = {"marker": "o", "mfc": "white"}
_LOOKS: dict[str, dict[str, Any]] = {
    "waypoint": {"color": FAINT, "lw": 0.8},
    "given": {**_CIRCLE, "ls": "", "ms": 6, "mec": DARK, "mew": 1.3, "zorder": 4},
    "knots": {"ls": "", "marker": "|", "color": DARK, "ms": 8, "mew": 1.6, "label": "knot"},
    "limit": _LIMIT,
    "band": {
        "color": COLOURS[2],
        "alpha": 0.35,
        "lw": 7.0,
        "zorder": 1.5,
        "label": "given speed along the path",
    },
    "jump": {**_CIRCLE, "color": DARK, "ls": (0, (1, 1.5)), "lw": 1.2, "ms": 4, "zorder": 3.5},
    "exceeded": {**_EXCESS, "label": "limit exceeded"},
    "contact": {"color": WRONG, "lw": 7.0, "alpha": 0.22, "zorder": 0.5, "label": "collision"},
    # on the upper edge of the first row of panels
    "tool path": {"color": COLOURS[2], "lw": 3.0},
    "way": {"color": COLOURS[3], "lw": 3.0},
    "wait": {"color": FAINT, "lw": 3.0},
    "event": {"ls": "", "marker": "v", "ms": 6, "color": "#7a1fa2", "zorder": 5},
    "tolerance": _LIMIT,
    "beyond": {**_EXCESS, "label": "beyond the tolerance"},
}
MARK_LOOKS = {kind: {"label": kind} | look for kind, look in _LOOKS.items()}
"""Style and name of each kind of mark, in panels and in the legend below them.

The `gid` of a mark begins with its kind.
"""

LARGE, NORMAL, SMALL = 13.0, 11.0, 9.5
"""Font sizes [pt] for a picture 10 inches wide: at least 8 points on the width of A4 paper."""
_OTHER_FONTS = (
    *("Noto Sans CJK SC", "Noto Sans CJK JP", "Source Han Sans SC", "WenQuanYi Zen Hei"),
    *("Microsoft YaHei", "SimHei", "PingFang SC", "Hiragino Sans", "Yu Gothic", "Malgun Gothic"),
)
"""Fonts for Chinese, Japanese and Korean, which Matplotlib's own DejaVu Sans lacks; the first that
is installed is used.
"""
_SETTINGS: dict[Any, Any] = {
    "font.family": ["sans-serif"],
    "font.size": NORMAL,
    "axes.unicode_minus": True,
    "axes.labelsize": NORMAL,
    "xtick.labelsize": NORMAL - 1,
    "ytick.labelsize": NORMAL - 1,
    "path.simplify": True,
    "agg.path.chunksize": 20_000,
    "text.usetex": False,
    "text.parse_math": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "knotwork",
    "pdf.fonttype": 42,
}


@contextmanager
def settings() -> Iterator[None]:
    """Apply Knotwork's settings over Matplotlib's defaults, and restore the user's afterwards."""
    import matplotlib as mpl
    from matplotlib.font_manager import fontManager

    installed = {font.name for font in fontManager.ttflist}
    others = [name for name in _OTHER_FONTS if name in installed][:1]
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_SETTINGS | {"font.sans-serif": ["DejaVu Sans", *others]})
        yield


def colour(index: int) -> str:
    """Colour of the index-th joint or planner."""
    return COLOURS[index % len(COLOURS)]


def dashes(index: int) -> str | tuple[float, tuple[float, ...]]:
    """Line style of the index-th planner."""
    return DASHES[index % len(DASHES)]


def number(value: float) -> str:
    """Text of a number on an axis, short, with a true minus sign, never -0."""
    return f"{value:.7g}".replace("-", "−") if abs(value) > 0 else "0"


def rounded_text(value: float, digits: int = 3) -> str:
    """Text of a number in a note, with at most this many significant digits."""
    return number(float(f"{value:.{digits}g}"))


def printable(text: str) -> str:
    """Text on one line, with dots for characters that can't be printed."""
    return "".join(letter if letter.isprintable() else "·" for letter in text)


def shorten_names(names: Sequence[str], most: int) -> list[str]:
    """Cut the middle out of names longer than `most` letters, unless two would become equal."""
    plain = [printable(name) for name in names]
    tail = most // 2
    short = [
        name if len(name) <= most else f"{name[: most - tail - 1]}…{name[-tail:]}" for name in plain
    ]
    return short if len(set(short)) == len(set(plain)) else plain

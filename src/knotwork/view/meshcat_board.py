"""A board in a Meshcat viewer with the verdict, failures, and the legend of colours."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from meshcat import Visualizer

BOARD_WIDTH, BOARD_HEIGHT = 6.4, 3.2
"""Size of the board, in inches of its picture."""
MOST_BOARD_LINES = 5
"""Largest number of lines for failures."""
LINE_LETTERS = 74
"""Number of letters in a line."""
VERDICT_LOOKS = {True: ("passed", "#12803c"), False: ("FAILED", "#c01018"), None: ("", "black")}


def put_up_board(scene: Mapping[str, Any], node: Visualizer) -> FloatArray:
    """Place a board at the left of a scene, facing the first view.

    Args:
        scene: From `make_scene`.
        node: Node of the viewer for the board.

    Returns:
        Its corners [m], shape (4, 3).
    """
    from meshcat.geometry import Box, ImageTexture, MeshBasicMaterial, PngImage

    points = np.array(scene["view"]["points"])
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    towards = np.array(scene["view"]["from"]) * (1.0, 1.0, 0.0)
    towards /= max(float(np.linalg.norm(towards)), 1e-9)
    up = np.array([0.0, 0.0, 1.0])
    right = np.cross(up, towards)
    middle = (low + high) / 2
    width, height = (0.55 * size * side / BOARD_WIDTH for side in (BOARD_WIDTH, BOARD_HEIGHT))
    aside = float(((points - middle) @ right).min()) - 0.5 * width - 0.05 * size
    place = pin.SE3(np.column_stack([right, up, towards]), middle + aside * right)
    place.translation[2] = high[2] - 0.5 * height
    picture = MeshBasicMaterial(map=ImageTexture(image=PngImage(drawn_board(scene))))
    node.set_object(Box([width, height, 1e-3 * size]), picture)
    node.set_transform(place.homogeneous)
    corners = np.array([(i * width, j * height, 0.0) for i in (-0.5, 0.5) for j in (-0.5, 0.5)])
    return np.asarray(corners @ place.rotation.T + place.translation)


def board_lines(scene: Mapping[str, Any]) -> list[str]:
    """Lines of the board below its title: the summary, and each failure with its remedy."""
    lines = [" · ".join(part for part in (scene["summary"], scene["duration"]) if part)]
    for failure in scene["failures"]:
        lines += textwrap.wrap(
            failure["line"], LINE_LETTERS, initial_indent="• ", subsequent_indent="   "
        )
        remedy = textwrap.wrap(failure["remedy"] or "", LINE_LETTERS - 3)
        lines += [f"   {line}" for line in remedy]
    return lines if len(lines) <= 1 + MOST_BOARD_LINES else [*lines[: 1 + MOST_BOARD_LINES], "   …"]


def drawn_board(scene: Mapping[str, Any]) -> bytes:
    """The board's picture, a PNG."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    verdict, colour = VERDICT_LOOKS[scene["ok"]]
    figure = Figure(figsize=(BOARD_WIDTH, BOARD_HEIGHT), dpi=160, facecolor="white")
    figure.text(0.03, 0.9, f"{scene['title']}   {verdict}", size=15, weight="bold", color=colour)
    for i, line in enumerate(board_lines(scene)):
        figure.text(0.03, 0.82 - 0.075 * i, line, size=9.5, color=colour if i else "black")
    for i, (name, colours, low, high) in enumerate(_scales(scene)):
        edge = 0.03 + 0.48 * i
        axis = figure.add_axes((edge, 0.09, 0.4, 0.07))
        shades = LinearSegmentedColormap.from_list(name, list(colours))
        axis.imshow(np.linspace(0, 1, 200)[np.newaxis], cmap=shades, aspect="auto")
        axis.set_axis_off()
        figure.text(edge, 0.18, name, size=9)
        figure.text(edge, 0.02, low, size=9)
        figure.text(edge + 0.4, 0.02, high, size=9, ha="right")
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()


def _scales(scene: Mapping[str, Any]) -> list[tuple[str, Any, str, str]]:
    """Scales of the tool's path: quantity, colours, and the values at both ends."""
    legend, units = scene["legend"], scene["units"]
    scales = []
    if "off_colours" in legend:
        off = f"{100 * legend['off_tolerance']:.3g} %"
        scales.append(("off the given speed", legend["off_colours"], f"−{off}", f"+{off}"))
    if legend.get("high"):
        most = float(f"{legend['high'] * units['per_metre']:.3g}")
        high = f"{most:g} {units['length']}/s"
        elsewhere = " elsewhere" if scales else ""
        scales.append((f"tool speed{elsewhere}", legend["colours"], "0", high))
    return scales

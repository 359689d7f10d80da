"""Pictures of motions: joints over time, and the tool. Matplotlib is loaded when one is drawn.

No function here touches Matplotlib's global state: figures are made without `pyplot`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.view.files import save_figure
    from knotwork.view.plots import plot_joints
    from knotwork.view.tool_plots import plot_tool

__all__ = ["plot_joints", "plot_tool", "save_figure"]

__getattr__, __dir__ = lazy_names(
    __name__, {"files": ("save_figure",), "plots": ("plot_joints",), "tool_plots": ("plot_tool",)}
)

"""Pictures of motions: joints over time, and the tool. Matplotlib is loaded when one is drawn.

No function here touches Matplotlib's global state: figures are made without `pyplot`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from knotwork.view.files import save_figure
    from knotwork.view.plots import plot_joints
    from knotwork.view.tool_plots import plot_tool

__all__ = ["plot_joints", "plot_tool", "save_figure"]

_HOME = {"plot_joints": "plots", "plot_tool": "tool_plots", "save_figure": "files"}


def __getattr__(name: str) -> Any:
    """Load a public name from its module when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'knotwork.view' has no attribute {name!r}")
    return getattr(importlib.import_module(f"knotwork.view.{_HOME[name]}"), name)

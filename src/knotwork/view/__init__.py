"""Pictures of motions, scenes and reports. Matplotlib is loaded when a picture is drawn.

No function here touches Matplotlib's global state: figures are made without `pyplot`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.view.files import save_figure as save_figure
    from knotwork.view.plots import plot_joints as plot_joints
    from knotwork.view.report import report_page as report_page
    from knotwork.view.show import view_trajectory as view_trajectory
    from knotwork.view.tool_plots import plot_tool as plot_tool
    from knotwork.view.tradeoff_plot import plot_tradeoff as plot_tradeoff

__getattr__, __dir__, __all__ = lazy_names(__name__)

from .html_report import report_page as report_page
from .joint_plots import plot_joints as plot_joints
from .picture_files import save_figure as save_figure
from .scene_data import view_trajectory as view_trajectory
from .tool_plots import plot_tool as plot_tool

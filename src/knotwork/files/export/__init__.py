"""Export of trajectories: one module per family of formats, loaded on demand.

from knotwork.files.export import save, to_ros2

text = to_ros2(plan.trajectory, goal=True)
save(plan.trajectory, "pvt", "axis_table.csv", degrees=True)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

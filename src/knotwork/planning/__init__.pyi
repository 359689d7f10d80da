from . import comparison as comparison
from . import sweeps as sweeps
from . import timing as timing
from .check_trajectory import check_without_task as check_without_task
from .check_trajectory import clearance_between as clearance_between
from .path_following import follow_path as follow_path
from .planned_motion import Plan as Plan
from .planning import plan as plan
from .replanning import continued_scenario as continued_scenario

__all__: list[str]

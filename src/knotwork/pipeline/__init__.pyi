from .alone import check_alone as check_alone
from .following import follow_path as follow_path
from .planning import Plan as Plan
from .planning import plan as plan
from .replanning import scenario_from as scenario_from
from .together import clearance_between as clearance_between

__all__: list[str]

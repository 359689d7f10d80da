from .following import follow_path as follow_path
from .planning import Plan as Plan
from .planning import plan as plan
from .planning import replanned as replanned

__all__: list[str]

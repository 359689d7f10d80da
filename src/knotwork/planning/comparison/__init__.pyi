from .every_planner import Comparison as Comparison
from .every_planner import compare as compare
from .scores import Refusal as Refusal
from .scores import Score as Score
from .scores import best as best

__all__: list[str]

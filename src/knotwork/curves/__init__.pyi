from . import interpolation as interpolation
from . import polynomial as polynomial
from . import retiming as retiming
from . import tool_paths as tool_paths
from . import trajectory as trajectory

__all__: list[str]

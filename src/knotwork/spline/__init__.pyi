from . import interpolation as interpolation
from . import polynomial as polynomial
from . import retiming as retiming
from . import trajectory as trajectory

__all__: list[str]

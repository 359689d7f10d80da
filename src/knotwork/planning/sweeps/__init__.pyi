from .figures import FIGURES as FIGURES
from .figures import RowFigure as RowFigure
from .many import plan_many as plan_many
from .run import SweepProgress as SweepProgress
from .run import sweep as sweep
from .study import Study as Study

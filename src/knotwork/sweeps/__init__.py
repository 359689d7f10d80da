"""Many scenarios from one: values varied, each planned and checked, a row of figures for each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.sweeps.figures import FIGURES as FIGURES
    from knotwork.sweeps.figures import RowFigure as RowFigure
    from knotwork.sweeps.many import plan_many as plan_many
    from knotwork.sweeps.run import SweepProgress as SweepProgress
    from knotwork.sweeps.run import sweep as sweep
    from knotwork.sweeps.study import Study as Study

__getattr__, __dir__, __all__ = lazy_names(__name__)

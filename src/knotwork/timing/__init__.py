"""Least times: durations, velocities and accelerations chosen so that a motion is fastest.

    from knotwork import timing

    limits = timing.TimingLimits(velocity=[2.0], acceleration=[8.0], jerk=[80.0])
    problem = timing.TimingProblem(("elbow",), [[0], [1], [0]], [[0], [0.5], [0]], limits)
    motion = timing.solve(problem)

CasADi, which is slow to load, is loaded when a problem is solved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.timing.bounds import lower_bound as lower_bound
    from knotwork.timing.dynamics import Dynamics as Dynamics
    from knotwork.timing.motion import Binding as Binding
    from knotwork.timing.motion import Progress as Progress
    from knotwork.timing.motion import TimedMotion as TimedMotion
    from knotwork.timing.problem import Objective as Objective
    from knotwork.timing.problem import TimingLimits as TimingLimits
    from knotwork.timing.problem import TimingProblem as TimingProblem
    from knotwork.timing.solving import solve as solve

__getattr__, __dir__, __all__ = lazy_names(__name__)

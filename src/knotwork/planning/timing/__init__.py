"""Time-optimal motions: durations, velocities and accelerations by nonlinear programming.

    from knotwork.joint_quantities import JointLimits
    from knotwork.planning import timing

    limits = JointLimits(velocity=[2.0], acceleration=[8.0], jerk=[80.0])
    problem = timing.TimingProblem(("elbow",), [[0], [1], [0]], [[0], [0.5], [0]], limits)
    motion = timing.solve(problem)

A long problem is solved over a receding horizon, others at once: IPOPT solves a `TimingProgram`,
which is tightened until its `TimedCurve` keeps every limit. `TimedMotion` adds the figures.
CasADi, which is slow to import, is imported when a problem is solved.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

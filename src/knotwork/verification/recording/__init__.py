"""Robot logs: noisy samples, the smooth motion behind them, and its uncertainty.

    from knotwork.verification.recording import aligned, check_log, read_log, smoothed

    log = read_log("log.csv", plan.trajectory.joint_names, plan.trajectory.joint_units)
    alignment = aligned(smoothed(log), plan.trajectory)

`check_log(alignment, plan.scenario, plan.joints)` checks it against the scenario of its plan.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

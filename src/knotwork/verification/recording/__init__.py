"""Robot logs: noisy samples, the smooth motion behind them, and its uncertainty.

from knotwork.verification.recording import read_log, smoothed

log = read_log("log.csv", robot.joint_names, robot.joint_units)
curve = smoothed(log)
curve.trajectory.velocity(1.2), curve.noise
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

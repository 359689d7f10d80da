"""Motion as a robot recorded it: samples with noise, the curve behind them, what that can tell.

from knotwork.recording import read_log, smoothed

log = read_log("log.csv", robot.joint_names, robot.joint_units)
curve = smoothed(log)
curve.trajectory.velocity(1.2), curve.noise
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.recording.alignment import Alignment as Alignment
    from knotwork.recording.alignment import aligned as aligned
    from knotwork.recording.alignment import deviation_findings as deviation_findings
    from knotwork.recording.likeness import LeftOfPlan as LeftOfPlan
    from knotwork.recording.noise import Noise as Noise
    from knotwork.recording.reading import Recording as Recording
    from knotwork.recording.reading import read_log as read_log
    from knotwork.recording.smoothing import Smoothed as Smoothed
    from knotwork.recording.smoothing import smoothed as smoothed
    from knotwork.recording.verdict import check_log as check_log
    from knotwork.recording.verdict import compare_log as compare_log

__getattr__, __dir__, __all__ = lazy_names(__name__)

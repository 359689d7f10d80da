"""`Solvable`: what a robot is asked for and inverse kinematics answers.

Inverse kinematics knows robots, so robots must not know it. When one of these methods is called,
it asks the package itself for `knotwork.kinematics`, and hands it the robot; nothing is loaded
before.
"""

from __future__ import annotations

import importlib
from typing import Any

_KINEMATICS = f"{__package__.partition('.')[0]}.kinematics"


class Solvable:
    """An arm whose poses can be solved for."""

    def solve_all(self, pose: Any, **options: Any) -> tuple[Any, ...]:
        """Find every branch that takes the TCP to a pose, as `Branch`; see `knotwork.solve_all`.

        Args:
            pose: Pose of the TCP in the base frame, `pin.SE3`.
            options: Those of `knotwork.solve_all`.
        """
        return tuple(importlib.import_module(_KINEMATICS).solve_all(self, pose, **options))

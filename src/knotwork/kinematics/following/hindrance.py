"""`Hindrance`: what keeps an arm from following a tool path."""

from __future__ import annotations

from dataclasses import dataclass

from knotwork.robot import Robot


@dataclass(frozen=True)
class Hindrance:
    """What keeps the arm from following a path from some start.

    Attributes:
        kind: `"joint limit"`, `"velocity limit"`, or `"singularity"` where the tool can't stay on
            the path whatever the joints do.
        time: When it begins [s].
        joint: Index of the joint that is farthest beyond its limit.
        value: The joint's worst value [rad or m, or per second].
        limit: The limit it is beyond.
        worst: When it is worst [s].
        smallest_singular_value: Of the Jacobian when it is worst.
    """

    kind: str
    time: float
    joint: int
    value: float
    limit: float
    worst: float
    smallest_singular_value: float

    def described(self, robot: Robot) -> str:
        """Say what is in the way, and by how much."""
        if self.kind == "singularity":
            return (
                "the arm is stretched out or singular and can't go on (smallest singular value "
                f"{self.smallest_singular_value:.3g})"
            )
        joint, kind = robot.joint_names[self.joint], robot.joint_units[self.joint]
        if self.kind == "joint limit":
            return (
                f"{joint} comes to its limit {self.limit:.4g} {kind}; it would have to go to "
                f"{self.value:.4g} {kind}"
            )
        slower = self.limit / self.value
        singular = (
            f" (close to a singularity, smallest singular value {self.smallest_singular_value:.3g})"
            if self.smallest_singular_value < 0.05
            else ""
        )
        return (
            f"{joint} would have to turn at {self.value:.4g} {kind}/s, and its limit is "
            f"{self.limit:.4g}{singular}; at {slower:.3g} of the speed it could be done"
        )

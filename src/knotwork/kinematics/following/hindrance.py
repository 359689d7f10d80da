"""`Hindrance`: what keeps an arm from following a tool path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.errors import FollowingError
from knotwork.robot import Robot
from knotwork.tool_paths import TimedPath


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


def following_error(
    robot: Robot,
    path: TimedPath,
    one: Hindrance,
    what: str,
    remedy: str,
    *,
    since: float | None = None,
    shown_length: tuple[float, str] = (1.0, "m"),
    waypoint: str = "",
    where: str = "",
) -> FollowingError:
    """The error for a path that can't be followed.

    Args:
        robot: The arm.
        path: The path.
        one: What is in the way.
        what: What can't be done, in words.
        remedy: What else would do, besides another path and another orientation.
        since: From when on the way is told [s]; by default from the start of the path.
        shown_length: What a metre is in the unit of the message, and its name.
        waypoint: The waypoint that can't be reached.
        where: Where that is given.
    """
    begin = path.start_time if since is None else since
    first, reached = path.arc_length(np.array([begin, one.time]))
    scale, unit = shown_length
    return FollowingError(
        waypoint,
        f"{what} {scale * (reached - first):.4g} {unit} along it {one.described(robot)}. Move the "
        f"path, turn the tool, or {remedy}",
        where=where,
        arc_length=float(reached),
        cause=one.kind,
        joint=robot.joint_names[one.joint] if one.kind != "singularity" else "",
    )

"""The motions of a picture, and the names chosen for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, UnknownNameError
from knotwork.task.scenario import Scenario
from knotwork.verification.report import AnyMotion
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.style import DASHES


def motions_of(
    motions: AnyMotion | Sequence[AnyMotion], scenario: Scenario | None = None
) -> list[ShownMotion]:
    """Collect the motions of a picture, with distinct labels.

    Raises:
        InputError: There is no motion, there are more motions than line styles, one is neither a
            plan nor a trajectory, or their joints differ.
    """
    items: list[Any] = list(motions) if isinstance(motions, Sequence) else [motions]
    if not items:
        raise InputError("a picture needs at least one plan or trajectory")
    if len(items) > len(DASHES):
        raise InputError(
            f"{len(items)} motions are too many for one picture; accepted: at most {len(DASHES)}"
        )
    shown = [_motion(item, scenario) for item in items]
    first = shown[0].trajectory
    for motion in shown[1:]:  # raises for other joints
        owner = "the first motion of the picture"
        motion.trajectory.reordered(first.joint_names, first.joint_units, owner=owner)
    labels = [motion.label for motion in shown]
    return [
        replace(motion, label=f"{label} ({labels[: i + 1].count(label)})")
        if labels.count(label) > 1
        else motion
        for i, (motion, label) in enumerate(zip(shown, labels, strict=True))
    ]


def _motion(item: Any, scenario: Scenario | None) -> ShownMotion:
    if isinstance(item, JointTrajectory):
        if scenario is None:
            return ShownMotion.of_joints(item)
        return ShownMotion.of_trajectory(item, scenario)
    if not isinstance(getattr(item, "trajectory", None), JointTrajectory):
        raise InputError(f"can't draw {type(item).__name__}; give a Plan or a JointTrajectory")
    return ShownMotion.of_checked(item)


def choose_names(kind: str, names: Sequence[str] | None, available: Sequence[str]) -> list[str]:
    """Names chosen among the available ones, by default all, each once.

    Raises:
        UnknownNameError: A name is not available.
        InputError: No name is chosen.
    """
    names = list(dict.fromkeys(available if names is None else names))
    for name in names:
        if name not in available:
            raise UnknownNameError(kind, name, available)
    if not names:
        raise InputError(f"no {kind} is chosen; accepted: {', '.join(available)}")
    return names

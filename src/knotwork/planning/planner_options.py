"""Planner options of a scenario: values in SI, support by other planners, locations in errors."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any

from knotwork.curves.interpolation import (
    PLANNER_SPECS,
    PlannerOptions,
    get_planner,
    planner_and_rule,
)
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, KnotError, OptionError
from knotwork.errors.plain_text import waypoint_text
from knotwork.planning.task_to_joint import knots_of
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_requirements import JointRequirements, read_joint_requirements
from knotwork.waypoints import JointWaypoints


def planner_options(scenario: Scenario, joints: JointRequirements) -> PlannerOptions:
    """Return a scenario's planner options with joint values in SI, in the order of the joints.

    Raises:
        InputError: An option names an unknown joint, or is out of range.
    """
    ends = scenario.given.end_acceleration
    _refuse_values_for_each(scenario, joints)
    return PlannerOptions(
        knots=knots_of(scenario),
        end_acceleration=ends if isinstance(ends, str) else joints.end_acceleration,
        chosen=joints.chosen_sections,
        accelerations=joints.accelerations,
    )


def _refuse_values_for_each(scenario: Scenario, joints: JointRequirements) -> None:
    """Raise an error if values are given for each waypoint and a path inserts further waypoints."""
    if not scenario.paths:
        return
    text = "given one by one, but waypoints are inserted along the path"
    if not isinstance(scenario.knots, str | int | float):
        message = f"times are {text}; accepted: paper, balanced or its constant"
        raise InputError(message, where=scenario.where("knots"))
    if joints.accelerations is not None and not isinstance(joints.accelerations, str):
        message = f"values are {text}; accepted: a rule, such as zero or estimated"
        raise InputError(message, where=scenario.where("planner_options", "accelerations"))


def supported_options(
    options: PlannerOptions, original: str, planner: str
) -> tuple[PlannerOptions, tuple[str, ...]]:
    """Keep those options of one planner that another one supports.

    Accelerations given for each waypoint are dropped, because they are meant for its own planner.
    Options that the rule of the other planner sets are dropped as well.

    Args:
        options: The options.
        original: Their planner.
        planner: The other planner; a rule may follow after a colon.

    Returns:
        The supported options, and the names of the others.
    """
    base, ruled = planner_and_rule(planner)
    same = base == planner_and_rule(original)[0]
    unsupported = tuple(
        name
        for name in options.requested
        if name not in PLANNER_SPECS[base].supports
        or (name in ruled and options != replace(options, **{name: ruled[name]}))
        or (name == "chosen" and "knots" in ruled)
        or (name == "accelerations" and not same and not isinstance(options.accelerations, str))
    )
    defaults = PlannerOptions()
    return replace(options, **{name: getattr(defaults, name) for name in unsupported}), unsupported


@dataclass(frozen=True, eq=False)
class Interpolator:
    """Interpolates joint waypoints by a scenario's planner, with its options in SI.

    Attributes:
        scenario: The scenario, with the planner that was given instead of its own.
        joints: Its joints.
        options: Options of the planner, in SI.
        unsupported: Names of the scenario's options that the planner does not support.
        planner_given: Whether a planner was given.
    """

    scenario: Scenario
    joints: JointRequirements
    options: PlannerOptions
    unsupported: tuple[str, ...]
    planner_given: bool

    @classmethod
    def for_scenario(cls, scenario: Scenario, planner: str | None) -> Interpolator:
        """Make it for a scenario. `planner` replaces its own, as in `knotwork.plan`.

        Raises:
            InputError: An option is wrong, or the planner does not support it.
        """
        original, unsupported = scenario.planner, tuple[str, ...]()
        with nullcontext() if planner else scenario.locations.errors_at("planner"):
            get_planner(planner or original)
        scenario = replace(scenario, planner=planner or original)
        joints = read_joint_requirements(scenario)
        options = planner_options(scenario, joints)
        if scenario.planner != original:
            options, unsupported = supported_options(options, original, scenario.planner)
        return cls(scenario, joints, options, unsupported, planner is not None)

    @property
    def knots_along_paths(self) -> Any:
        """Knot positions for inserting waypoints: those of the planner, if it has knots."""
        base, ruled = planner_and_rule(self.scenario.planner)
        if "knots" not in PLANNER_SPECS[base].supports:
            return PlannerOptions().knots
        return ruled.get("knots", self.options.knots)

    def trajectory(self, waypoints: JointWaypoints) -> JointTrajectory:
        """Interpolate joint waypoints.

        Raises:
            InputError: The planner can't interpolate them. The error names a field of the scenario,
                or the argument that was given instead.
        """
        try:
            return get_planner(self.scenario.planner)(waypoints, self.options)
        except InputError as error:
            field: tuple[str, ...] = ("planner",)
            if isinstance(error, KnotError) and error.waypoint_index is not None:
                count = 1 if error.interval is None else 2
                names = map(waypoint_text, waypoints.names[error.waypoint_index :][:count])
                error.locate(("at", "between")[count - 1] + " " + " and ".join(names))
            if isinstance(error, KnotError | OptionError):
                option = getattr(error, "option", "knots")
                field = ("planner_options", option) if option == "accelerations" else (option,)
            if self.planner_given and field == ("planner",):
                error.locate(f"{self.scenario.name}: planner")
                raise
            with self.scenario.locations.errors_at(*field):
                raise

"""Planner options of a scenario, in SI, and their support by other planners."""

from __future__ import annotations

from dataclasses import replace

from knotwork.curves.interpolation import PLANNER_SPECS, PlannerOptions, planner_and_rule
from knotwork.errors import InputError
from knotwork.planning.task_to_joint import knots_of
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints


def planner_options(scenario: Scenario, joints: ScenarioJoints) -> PlannerOptions:
    """Return a scenario's planner options with joint values in SI, in the order of the joints.

    Raises:
        InputError: An option names an unknown joint, or is out of range.
    """
    ends = scenario.task.end_acceleration
    _refuse_values_by_waypoint(scenario, joints)
    return PlannerOptions(
        knots=knots_of(scenario),
        end_acceleration=ends if isinstance(ends, str) else joints.end_acceleration,
        chosen=joints.chosen_sections,
        accelerations=joints.accelerations,
    )


def _refuse_values_by_waypoint(scenario: Scenario, joints: ScenarioJoints) -> None:
    """Raise an error if values are given for each waypoint and a path inserts further waypoints."""
    if not scenario.paths:
        return
    text = "given one by one, but waypoints are inserted along the path"
    if isinstance(knots_of(scenario), tuple):
        message = f"times are {text}; accepted: paper, balanced or {{balanced: a constant}}"
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
    base, set_by_rule = planner_and_rule(planner)
    same = base == planner_and_rule(original)[0]
    unsupported = tuple(
        name
        for name in options.requested
        if name not in PLANNER_SPECS[base].supports
        or (name in set_by_rule and options != replace(options, **{name: set_by_rule[name]}))
        or (name == "chosen" and "knots" in set_by_rule)
        or (name == "accelerations" and not same and not isinstance(options.accelerations, str))
    )
    defaults = PlannerOptions()
    return replace(options, **{name: getattr(defaults, name) for name in unsupported}), unsupported

"""Planners by name, with or without a rule, loaded on first use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pkgutil import resolve_name
from types import MappingProxyType
from typing import Any

import numpy as np

from knotwork.curves.interpolation.knots import KNOT_RULES
from knotwork.curves.interpolation.options import ACCELERATION_RULES, Planner, PlannerOptions
from knotwork.curves.interpolation.specs import PLANNER_SPECS, check_supported
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, KnotError, OptionError, UnknownNameError
from knotwork.waypoints import JointWaypoints

RULES: Mapping[str, tuple[str, ...]] = {
    "knots": KNOT_RULES,
    "accelerations": ACCELERATION_RULES,
}
"""Rules that may follow a planner's name, by the option that they set."""


def get_planner(name: str) -> Planner:
    """Return the planner of a name with an optional rule: `quintic`, `quintic:estimated`.

    A planner with a rule takes the same options except the one that the rule sets, and its
    trajectories have the whole name.

    >>> waypoints = kw.JointWaypoints(("lift",), [0, 1, 3], [[0], [1], [2]], [[0], [1], [0]])
    >>> trajectory = kw.interpolation.get_planner("quintic:estimated")(waypoints)
    >>> trajectory.origin, trajectory.velocity(1.0)
    ('quintic:estimated', array([1.]))

    Raises:
        UnknownNameError: There is no such planner, or it has no such rule.
    """
    planner_and_rule(name)
    return PLANNERS.get(name) or partial(_plan, name)


def planner_and_rule(name: str) -> tuple[str, dict[str, Any]]:
    """Split `planner` or `planner:rule` into the planner and the option that the rule sets.

    >>> planner_and_rule("quintic:estimated")
    ('quintic', {'accelerations': 'estimated'})

    Raises:
        UnknownNameError: There is no such planner, or it has no such rule.
    """
    if not isinstance(name, str):
        raise UnknownNameError("planner", str(name), PLANNER_SPECS)
    planner, colon, rule = name.partition(":")
    if planner not in PLANNER_SPECS:
        raise UnknownNameError("planner", planner, PLANNER_SPECS)
    if not colon:
        return planner, {}
    for option in RULES:
        if option in PLANNER_SPECS[planner].supports and rule in RULES[option]:
            return planner, {option: rule}
    if rules(planner):
        raise UnknownNameError(f"rule of planner {planner!r}", rule, rules(planner))
    with_rules = (f"{other}:RULE" for other in PLANNER_SPECS if rules(other))
    raise UnknownNameError("planner", name, (planner, *with_rules))


def rules(planner: str) -> list[str]:
    """Rules that may follow the name of a planner.

    >>> rules("modified-hermite")
    ['paper', 'balanced']
    """
    supports = PLANNER_SPECS[planner].supports
    return [rule for option in RULES if option in supports for rule in RULES[option]]


def _plan(
    name: str, waypoints: JointWaypoints, options: PlannerOptions | None = None
) -> JointTrajectory:
    """Plan with the planner of a name; see `Planner`. Errors name the planner."""
    planner, set_by_rule = planner_and_rule(name)
    make = resolve_name(f"knotwork.curves.interpolation.{PLANNER_SPECS[planner].entry_point}")
    options = options if options is not None else PlannerOptions()
    try:
        with_rule = replace(options, **set_by_rule)
        for option, rule in set_by_rule.items():
            if option in options.requested and options != with_rule:
                raise OptionError(
                    option, f"is given together with the rule {rule!r}; give one of the two"
                )
        check_supported(planner, with_rule)
        with np.errstate(over="ignore", invalid="ignore"):
            curve = make(waypoints, with_rule)
    except KnotError:
        raise  # the error is about knots, independent of the planner
    except InputError as error:
        if isinstance(error, OptionError):
            error.planner = name
        error.locate(f"planner {name!r}")
        raise
    return JointTrajectory(
        waypoints.joint_names,
        curve,
        joint_units=waypoints.joint_units,
        origin=name,
        waypoint_times=waypoints.time,
    )


PLANNERS: Mapping[str, Planner] = MappingProxyType(
    {name: partial(_plan, name) for name in PLANNER_SPECS}
)
"""All planners, by their names in scenarios and on the command line.

A planner is loaded when it is called.
"""

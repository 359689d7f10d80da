"""Planners by name, with or without a rule; each is loaded when it is first asked for."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import replace

from knotwork.errors import OptionError, UnknownNameError
from knotwork.interpolation.knots import KNOT_RULES
from knotwork.interpolation.options import ACCELERATION_RULES, Planner, PlannerOptions
from knotwork.interpolation.specs import PLANNER_SPECS
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import JointWaypoints


class _Planners(Mapping[str, Planner]):
    """Names to planners; listing the names and testing for one loads none of them."""

    def __getitem__(self, name: str) -> Planner:
        spec = PLANNER_SPECS[name]
        module = importlib.import_module(f"knotwork.interpolation.{spec.module}")
        planner: Planner = getattr(module, spec.function)
        return planner

    def __contains__(self, name: object) -> bool:
        return name in PLANNER_SPECS

    def __iter__(self) -> Iterator[str]:
        return iter(PLANNER_SPECS)

    def __len__(self) -> int:
        return len(PLANNER_SPECS)


PLANNERS: Mapping[str, Planner] = _Planners()
"""All planners, by the name that scenarios and the command line use."""


RULES: Mapping[str, tuple[str, ...]] = {
    "knots": KNOT_RULES,
    "accelerations": ACCELERATION_RULES,
}
"""Options that a rule after a planner's name can stand for, and the rules."""


def get_planner(name: str) -> Planner:
    """Return the planner of a name, which a rule may follow: `quintic`, `quintic:estimated`.

    A planner with a rule takes the same options but the one that the rule stands for, and its
    trajectories bear its whole name.

    >>> waypoints = kw.JointWaypoints(("lift",), [0, 1, 3], [[0], [1], [2]], [[0], [1], [0]])
    >>> trajectory = kw.get_planner("quintic:estimated")(waypoints)
    >>> trajectory.planner, trajectory.velocity(1.0)
    ('quintic:estimated', array([1.]))

    Raises:
        UnknownNameError: There is no such planner, or it has no such rule.
    """
    planner, ruled = planner_and_rule(name)
    return _with_rule(name, ruled) if ruled else PLANNERS[planner]


def planner_and_rule(name: str) -> tuple[str, dict[str, str]]:
    """Split `planner` or `planner:rule` into the planner and the option that the rule stands for.

    Raises:
        UnknownNameError: There is no such planner, or it has no such rule.
    """
    if not isinstance(name, str):
        raise UnknownNameError("planner", str(name), PLANNERS)
    planner, colon, rule = name.partition(":")
    if planner not in PLANNERS:
        raise UnknownNameError("planner", planner, PLANNERS)
    if not colon:
        return planner, {}
    for option in RULES:
        if option in PLANNER_SPECS[planner].supports and rule in RULES[option]:
            return planner, {option: rule}
    if rules(planner):
        raise UnknownNameError(f"rule of planner {planner!r}", rule, rules(planner))
    ruled = (f"{other}:RULE" for other in PLANNER_SPECS if rules(other))
    raise UnknownNameError("planner", name, (planner, *ruled))


def rules(planner: str) -> list[str]:
    """Rules that may follow the name of a planner."""
    supports = PLANNER_SPECS[planner].supports
    return [rule for option in RULES if option in supports for rule in RULES[option]]


def _with_rule(name: str, ruled: Mapping[str, str]) -> Planner:
    planner, _, rule = name.partition(":")
    interpolate = PLANNERS[planner]

    def plan(waypoints: JointWaypoints, options: PlannerOptions | None = None) -> JointTrajectory:
        given = options if options is not None else PlannerOptions()
        wanted = replace(given, **ruled)
        for option in ruled:
            if option in given.requested and given != wanted:
                raise OptionError(
                    option, f"is given beside the rule {rule!r}; give one of the two", planner=name
                )
        return replace(interpolate(waypoints, wanted), planner=name)

    return plan

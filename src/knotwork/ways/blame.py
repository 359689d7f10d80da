"""`to_blame`: the objects that prevent a collision-free motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knotwork.ways.configurations import Configurations
from knotwork.ways.problem import WayProblem
from knotwork.ways.proof import contacts_along
from knotwork.ways.rrt import connect
from knotwork.ways.search import STAGES, affordable, stretches


def to_blame(problem: WayProblem, checks: int) -> list[str] | None:
    """Find a set of objects without which a polyline exists, as small as found.

    The first polyline ignores all objects. The objects that it touches are then restored in turn.

    Args:
        problem: A problem for which no motion was found.
        checks: Number of configurations checked, for the first polyline and for all others.

    Returns:
        Names; empty if a polyline is found among all objects; `None` if none is found without
        objects.
    """
    objects = {body.name for body in problem.model.bodies if body.kind == "object"}
    blamed = _passed_through(problem, objects, checks)
    if blamed is None:
        return None
    for name in sorted(blamed):
        fewer = _passed_through(problem, blamed - {name}, checks // len(blamed))
        if fewer is not None and len(fewer) < len(blamed):
            blamed = fewer
    return sorted(blamed)


def _passed_through(problem: WayProblem, without: set[str], checks: int) -> set[str] | None:
    """The objects that a polyline found without some of them touches, or `None`."""
    model, limits = problem.model, problem.timing.limits
    bodies, inner = model.bodies, problem.timing.position[1:-1]
    others = [
        pair
        for pair in model.pairs
        if without.isdisjoint((bodies[pair.first].name, bodies[pair.second].name))
    ]
    fewer = replace(model, pairs=tuple(others))
    space = Configurations(problem.robot, fewer, limits, problem.loaded)
    rng, most = np.random.default_rng(0), affordable(checks, space) // (len(inner) + 1)
    starts, goals = space.select_free(problem.starts), space.select_free(problem.goals)
    touched = set[str]()
    for first, last in stretches(starts, inner, goals):
        line = connect(space, first, last, rng, STAGES[0].step, most)
        if line is None:
            return None
        for one in contacts_along(model, line, problem.resolution):
            touched |= {one.first.name, one.second.name}
    return touched & without

"""`to_blame`: the objects without which there is a way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knotwork.ways.configurations import Configurations
from knotwork.ways.problem import WayProblem
from knotwork.ways.proof import too_near
from knotwork.ways.rrt import connect
from knotwork.ways.search import CARES, affordable, stretches


def to_blame(problem: WayProblem, checks: int) -> list[str] | None:
    """Objects without which a polyline is found; each of them is needed, as far as is seen.

    The first polyline passes through all objects. What it touches is then put back one by one.

    Args:
        problem: A problem for which no way was found.
        checks: Number of configurations looked at, for the first polyline and for all others.

    Returns:
        Names, none of them where one is found among all objects; `None` where none is found without
        any object.
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
    """The objects that polylines touch which are found without some of them, or `None`."""
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
    starts, goals = space.those_free(problem.starts), space.those_free(problem.goals)
    touched = set[str]()
    for first, last in stretches(starts, inner, goals):
        line = connect(space, first, last, rng, CARES[0].step, most)
        if line is None:
            return None
        for one in too_near(model, line, problem.resolution):
            touched |= {one.first.name, one.second.name}
    return touched & without

"""Planners by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from knotwork.errors import UnknownNameError
from knotwork.interpolation import cubic, modified_hermite
from knotwork.interpolation.options import Planner

PLANNERS: Mapping[str, Planner] = MappingProxyType(
    {
        modified_hermite.NAME: modified_hermite.plan,
        cubic.NAME: cubic.plan,
    }
)
"""All planners, by the name that scenarios and the command line use."""


def get_planner(name: str) -> Planner:
    """Return the planner of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in PLANNERS:
        raise UnknownNameError("planner", name, PLANNERS)
    return PLANNERS[name]

"""Planners by name; each is loaded when it is first asked for."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping

from knotwork.errors import UnknownNameError
from knotwork.interpolation.catalogue import RECORDS
from knotwork.interpolation.options import Planner


class _Planners(Mapping[str, Planner]):
    """Names to planners; listing the names and testing for one loads none of them."""

    def __getitem__(self, name: str) -> Planner:
        record = RECORDS[name]
        module = importlib.import_module(f"knotwork.interpolation.{record.module}")
        planner: Planner = getattr(module, record.function)
        return planner

    def __contains__(self, name: object) -> bool:
        return name in RECORDS

    def __iter__(self) -> Iterator[str]:
        return iter(RECORDS)

    def __len__(self) -> int:
        return len(RECORDS)


PLANNERS: Mapping[str, Planner] = _Planners()
"""All planners, by the name that scenarios and the command line use."""


def get_planner(name: str) -> Planner:
    """Return the planner of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in PLANNERS:
        raise UnknownNameError("planner", name, PLANNERS)
    return PLANNERS[name]

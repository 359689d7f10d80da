"""Packages that only sweeps need, imported when one is made."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import Any

from knotwork.export.packages import needed

_HOW = "pip install 'knotwork[sweep]'"


def arrow() -> tuple[Any, Any]:
    """The packages `pyarrow` and `pyarrow.parquet`.

    Raises:
        InputError: They can't be imported.
    """
    parquet = needed("pyarrow.parquet", "a sweep", _HOW)
    return needed("pyarrow", "a sweep", _HOW), parquet


def arrow_compute() -> Any:
    """The package `pyarrow.compute`, which comes with it."""
    return needed("pyarrow.compute", "a sweep", _HOW)


def distributed() -> Any:
    """The package `distributed`, Dask's scheduler.

    Raises:
        InputError: It can't be imported.
    """
    return needed("distributed", "a sweep with several workers", _HOW)


def dask_config() -> Any:
    """The settings of Dask, which comes with `distributed`."""
    return needed("dask.config", "a sweep with several workers", _HOW)


def own_version() -> str:
    """Version of Knotwork; empty where it is not installed but only found on the path."""
    try:
        return version("knotwork")
    except PackageNotFoundError:
        return ""

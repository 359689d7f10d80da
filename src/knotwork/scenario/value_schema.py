"""Kinds of values in a scenario file: numbers, vectors, and telling forms of a value apart."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Field

from knotwork.documents import StrictModel

# No length, angle, time or limit of a real task is larger, and nothing computed from numbers of
# this size leaves the range of floats.
LARGEST = 1e12
Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST)]
Vector3 = Annotated[list[Number], Field(min_length=3, max_length=3)]
Vector4 = Annotated[list[Number], Field(min_length=4, max_length=4)]
JointMap = Annotated[dict[str, Number], Field(min_length=1)]


def _kind(value: Any) -> str | None:
    """Tell text, a mapping, a list and a number apart, so that only one of them is tried."""
    if isinstance(value, str):
        return "text"
    if isinstance(value, dict | StrictModel):
        return "mapping"
    if isinstance(value, list | tuple):
        return "list"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return "number"
    return None


def by_kind(accepted: str) -> Discriminator:
    """Tell the forms of a value apart by their kind; the error says which are accepted."""
    return Discriminator(
        _kind, custom_error_type="kind", custom_error_message=f"Input should be {accepted}"
    )

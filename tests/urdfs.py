"""URDFs of small robots, put together of links and joints."""

from __future__ import annotations


def robot(*parts: str, name: str = "r") -> str:
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def link(name: str, *parts: str) -> str:
    return f'<link name="{name}">{"".join(parts)}</link>'


def visual(geometry: str, more: str = "") -> str:
    return f"<visual><geometry>{geometry}</geometry>{more}</visual>"


def collision(geometry: str, at: str = "0 0 0") -> str:
    return f'<collision><origin xyz="{at}"/><geometry>{geometry}</geometry></collision>'


def limits(lower: float = -1, upper: float = 1, *, velocity: float = 1, effort: float = 1) -> str:
    return f'<limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="{effort}"/>'


def joint(
    name: str,
    parent: str,
    child: str,
    kind: str = "revolute",
    *,
    at: str = "0 0 0",
    axis: str = "0 0 1",
    more: str | None = None,
) -> str:
    """A joint; one that moves has limits of ±1, unless `more` gives others, or something else."""
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{at}"/>'
        f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
        f"{limits() if more is None else more}</joint>"
    )

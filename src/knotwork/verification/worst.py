"""Of many findings those to print: the worst of those alike, and those nearest their limits."""

from __future__ import annotations

from collections.abc import Sequence

from knotwork.verification.finding import Finding


def and_more(count: int) -> str:
    """Say of a finding how many more there are like it."""
    return f" (and {count} more like it)" if count else ""


def failure_lines(findings: Sequence[Finding], most: int | None = None) -> list[str]:
    """Findings in their own words: the worst of those alike, and how many more there are.

    Args:
        findings: The findings.
        most: Number of kinds to print; then a line says how many findings are left.
    """
    kinds = alike(findings)
    lines = [f"{worst}{and_more(len(others))}" for worst, *others in kinds[:most]]
    left = sum(map(len, kinds[len(lines) :]))
    return [*lines, f"and {left} more"] if left else lines


def worst_failures(findings: Sequence[Finding]) -> list[Finding]:
    """Of each quantity that fails with a number, the worst of those alike, in the order given."""
    failing = [one for one in findings if not one.ok and one.value is not None and not one.detail]
    return [several[0] for several in alike(failing)]


def alike(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Findings on the same quantity of things of the same kind, together, the worst first.

    It is the one furthest beyond its limit: by the part of it that is used, else by the margin.
    """
    found: dict[tuple[str, str, str], list[Finding]] = {}
    for one in findings:
        found.setdefault((one.group, one.subject, one.quantity), []).append(one)
    for several in found.values():
        worst = max(several, key=lambda one: (one.use or 0.0, -(one.margin or 0.0)))
        several.insert(0, several.pop(several.index(worst)))
    return list(found.values())


def without_use(findings: Sequence[Finding]) -> list[Finding]:
    """The findings to print of a group in which no part of a limit is used.

    Where a limit is zero, it is the finding nearest its limit; where nothing has a limit, the
    largest of each quantity; else nothing.
    """
    numbers = [one for one in findings if one.value is not None]
    limited = with_limits(numbers)
    if any(one.use is None for one in limited):
        return [min(limited, key=lambda one: one.margin if one.margin is not None else 0.0)]
    if any(one.limit is not None for one in numbers):
        return []
    largest: dict[str, Finding] = {}
    for one in numbers:
        if abs(one.value or 0.0) >= abs(largest.get(one.quantity, one).value or 0.0):
            largest[one.quantity] = one
    return list(largest.values())


def with_limits(numbers: Sequence[Finding]) -> list[Finding]:
    """Those with a limit that they are known to keep, or to break."""
    return [
        one for one in numbers if one.required and one.limit is not None and not one.only_sampled
    ]

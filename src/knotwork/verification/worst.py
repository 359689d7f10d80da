"""Selection of findings to print: the worst of each kind, and those nearest their limits."""

from __future__ import annotations

from collections.abc import Sequence

from knotwork.verification.finding import Finding


def and_more(count: int) -> str:
    """Text of the number of further findings of a kind."""
    return f" (and {count} more like it)" if count else ""


def failure_lines(findings: Sequence[Finding], most: int | None = None) -> list[str]:
    """Messages of the worst finding of each kind, and the number of others.

    Args:
        findings: The findings.
        most: Maximum number of kinds; another line has the number of remaining findings.
    """
    kinds = alike(findings)
    lines = [f"{worst}{and_more(len(others))}" for worst, *others in kinds[:most]]
    left = sum(map(len, kinds[len(lines) :]))
    return [*lines, f"and {left} more"] if left else lines


def worst_failures(findings: Sequence[Finding]) -> list[Finding]:
    """The worst failure of each kind that has a number, in the given order."""
    failing = [one for one in findings if not one.ok and one.value is not None and not one.detail]
    return [several[0] for several in alike(failing)]


def alike(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Group findings by quantity and kind of subject, the worst of each group first.

    The worst finding has the largest use of its limit, or else the smallest margin.
    """
    found: dict[tuple[str, str, str], list[Finding]] = {}
    for one in findings:
        found.setdefault((one.group, one.subject, one.quantity), []).append(one)
    for several in found.values():
        worst = max(several, key=lambda one: (one.use or 0.0, -(one.margin or 0.0)))
        several.insert(0, several.pop(several.index(worst)))
    return list(found.values())


def without_use(findings: Sequence[Finding]) -> list[Finding]:
    """The findings to print of a group without use of limits.

    With limits of zero, the finding nearest its limit; without limits, the largest of each
    quantity; otherwise nothing.
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
    """Findings with a limit that is known to be kept or exceeded."""
    return [
        one for one in numbers if one.required and one.limit is not None and not one.only_sampled
    ]

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
    kinds = group_alike(findings)
    lines = [f"{worst}{and_more(len(similar))}" for worst, *similar in kinds[:most]]
    remaining = sum(map(len, kinds[len(lines) :]))
    return [*lines, f"and {remaining} more"] if remaining else lines


def worst_failures(findings: Sequence[Finding]) -> list[Finding]:
    """The worst failure of each kind that has a number, in the given order."""
    failing = (item for item in findings if not (item.ok or item.value is None or item.detail))
    return [worst for worst, *_ in group_alike(list(failing))]


def group_alike(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Group findings by quantity and kind of subject, the worst of each group first.

    The worst finding has the largest use of its limit, or else the smallest margin.
    """
    kinds: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        kinds.setdefault((finding.group, finding.subject, finding.quantity), []).append(finding)
    for kind in kinds.values():
        worst = max(kind, key=lambda finding: (finding.use or 0.0, -(finding.margin or 0.0)))
        kind.insert(0, kind.pop(kind.index(worst)))
    return list(kinds.values())


def without_use(findings: Sequence[Finding]) -> list[Finding]:
    """The findings to print of a group without use of limits.

    If limits are zero, it is the finding nearest its limit. Without limits, it is the largest value
    of each quantity. Otherwise there is none.
    """
    numbers = [finding for finding in findings if finding.value is not None]
    limited = with_limits(numbers)
    if any(finding.use is None for finding in limited):
        return [min(limited, key=lambda finding: finding.margin or 0.0)]
    if any(finding.limit is not None for finding in numbers):
        return []
    largest: dict[str, Finding] = {}
    for finding in numbers:
        if abs(finding.value or 0.0) >= abs(largest.get(finding.quantity, finding).value or 0.0):
            largest[finding.quantity] = finding
    return list(largest.values())


def with_limits(numbers: Sequence[Finding]) -> list[Finding]:
    """Findings with a limit that is known to be kept or exceeded."""
    return [
        finding
        for finding in numbers
        if finding.required and finding.limit is not None and not finding.only_sampled
    ]

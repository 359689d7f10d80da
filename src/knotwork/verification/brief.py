"""Findings in a few lines: failures, and the finding nearest to its limit in each group."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence

from knotwork.errors.plain_text import to_one_line
from knotwork.units import Units
from knotwork.verification.finding import Finding

MAX_TEXTS = 9
"""Approximate number of texts of all groups, shared evenly, so that a report fits on a screen."""
MAX_GROUP_TEXTS = 4
"""Maximum number of texts of a group."""
NOTABLE_UTILISATION = 0.01
"""Minimum utilisation of a limit that gets its own row."""
MIN_TEXT_WIDTH = 20
"""Minimum width of a text behind its indentation, in characters."""
BRIEF_INDENT = "  "
"""Indentation of the rows of a short report."""
_NO_BREAK = "\N{NO-BREAK SPACE}"
_SPACE_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|mm|m|s|deg|rad|N)(?![\w'-]))|(?<=\d N) (?=m\b)")
"""The space between a number and its unit, at which lines must not break."""


def group_lines(
    groups: Mapping[str, list[Finding]], units: Units, width: int, *, ok: bool
) -> list[str]:
    """A row for each notable group, and one row with the names of the others.

    Args:
        groups: Findings by group.
        units: Units of values.
        width: Width of the lines in characters.
        ok: Whether there is no failure. Otherwise only rows that explain the failure are printed.
    """
    is_listed = _far_from_limits if ok else _meets_requirements
    rows: dict[str, list[str]] = {}
    listed = []
    for name, findings in groups.items():
        texts, (_, required) = highlights(findings), requirement_counts(findings)
        if not texts and all(finding.value is None for finding in findings):
            continue
        heading = f"{name} ({required})" if required else name
        if is_listed(findings):
            listed.append(heading)
        elif ok or (texts and not any(finding.is_decided for finding in findings)):
            rows[heading] = texts or _group_texts(findings, units)
    max_texts = min(MAX_GROUP_TEXTS, max(MAX_TEXTS // max(len(rows), 1), 1))
    indent = max(map(len, rows), default=0) + len(BRIEF_INDENT) + 2
    lines: list[str] = []
    for heading, texts in rows.items():
        if len(texts) > max_texts + 1:  # one more text takes no more space than its number
            texts = [*texts[:max_texts], f"and {len(texts) - max_texts} more"]
        head = f"{BRIEF_INDENT}{heading}"
        for text in texts:
            lines += wrap(text, width, " " * indent, f"{head:<{indent}}")
            head = ""
    if listed:
        text = f"{BRIEF_INDENT}{'well within limits' if ok else 'met'}: {', '.join(listed)}"
        lines += wrap(text, width, 2 * BRIEF_INDENT)
    return lines


def worst_lines(mark: str, findings: Sequence[Finding], max_kinds: int, width: int) -> list[str]:
    """The worst finding of each kind, and the number of others.

    Args:
        mark: Text before each finding.
        findings: The findings.
        max_kinds: Maximum number of kinds.
        width: Width of the lines in characters.
    """
    indent = " " * len(mark)
    lines: list[str] = []
    for i, text in enumerate(finding_lines(findings, max_kinds)):
        lines += wrap(text, width, indent, mark if i < max_kinds else indent)
    return lines


def requirement_counts(findings: Sequence[Finding]) -> tuple[int, int]:
    """Number of requirements met, and number of all requirements, with undecided ones."""
    verdicts = [finding.verdict for finding in findings]
    met = verdicts.count("met")
    return met, met + verdicts.count("failed") + verdicts.count("undecided")


def highlights(findings: Sequence[Finding]) -> list[str]:
    """Short texts of findings that are printed even if there is no failure."""
    return [
        f"{finding.highlight}: undecided" if finding.verdict == "undecided" else finding.highlight
        for finding in findings
        if finding.highlight
    ]


def highlights_by_group(groups: Mapping[str, list[Finding]]) -> dict[str, list[str]]:
    """Short texts of findings, by group."""
    return {name: texts for name, findings in groups.items() if (texts := highlights(findings))}


def _group_texts(findings: Sequence[Finding], units: Units) -> list[str]:
    """Text of the finding nearest its limit; without limits, of each quantity's largest value."""
    numbers = [finding for finding in findings if finding.value is not None]
    undecided = [finding for finding in numbers if finding.verdict == "undecided"]
    if undecided:
        worst = max(undecided, key=lambda finding: finding.utilisation or 0.0)
        return [f"{len(undecided)} undecided: {value_text(worst, units)}"]
    if shown := representatives(findings):
        return [value_text(finding, units) for finding in shown]
    if limited := limited_findings(numbers):
        worst = max(limited, key=lambda finding: finding.utilisation or 0.0)
        return [utilisation_text(worst, units)]
    return ["sampled only" if any(finding.only_sampled for finding in numbers) else "not judged"]


def utilisation_text(finding: Finding, units: Units) -> str:
    """Utilisation of a finding's limit, and its subject, as text."""
    return f"{100.0 * (finding.utilisation or 0.0):.0f} %: {value_text(finding, units)}"


def value_text(finding: Finding, units: Units) -> str:
    """Text of a finding's subject, value, limit and time."""
    value, limit = finding.value or 0.0, finding.limit
    number = units.text(value, finding.unit, ".4g")
    if limit:
        allowed = units.text(limit, finding.unit, ".4g")
        beyond = abs(value) > abs(limit) or finding.is_across_zero
        if beyond and (finding.margin or 0.0) > 0.0:
            number += f", at {'least' if value > limit else 'most'} {allowed},"
        else:
            number = f"{units.number(value, finding.unit)} of {allowed}"
    parts = to_one_line(finding.name), finding.quantity_text, number, _moment(finding)
    return " ".join(filter(None, parts))


def failure_text(finding: Finding, units: Units) -> str:
    """A failure in one short line: quantity, location, excess."""
    if finding.short_fact:
        return f"{finding.short_fact} {_moment(finding)}".strip()
    return finding.message if finding.value is None else value_text(finding, units)


def _moment(finding: Finding) -> str:
    """Text of the worst time, or of the interval."""
    if not finding.time_text:
        return ""
    return f"{'from' if finding.time is None else 'at'} {finding.time_text} s"


def worst_failure_text(findings: Sequence[Finding], units: Units) -> str:
    """The first kind of failure in one short line, and the number of others; empty if none."""
    kinds = group_alike(findings)
    if not kinds:
        return ""
    count = len(findings) - 1
    return failure_text(kinds[0][0], units) + (f", and {count} more" if count else "")


def _far_from_limits(findings: Sequence[Finding]) -> bool:
    """Whether all findings have limits and use less than `NOTABLE_UTILISATION` of them."""
    if any(finding.highlight for finding in findings):
        return False
    return all(
        finding.is_decided
        and (
            finding.value == finding.limit == 0.0
            or (finding.utilisation is not None and finding.utilisation < NOTABLE_UTILISATION)
        )
        for finding in findings
        if finding.value is not None
    )


def _meets_requirements(findings: Sequence[Finding]) -> bool:
    return all(finding.ok for finding in findings) and any(
        finding.is_decided for finding in findings
    )


def wrap(text: str, width: int, indent: str, head: str = "") -> list[str]:
    """Lines of a text; the first begins with a head, the others are indented."""
    lines = textwrap.wrap(
        _SPACE_BEFORE_UNIT.sub(_NO_BREAK, to_one_line(text)),
        max(width, len(indent) + MIN_TEXT_WIDTH),
        initial_indent=head,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(_NO_BREAK, " ") for line in lines or [head]]


def finding_lines(findings: Sequence[Finding], max_kinds: int | None = None) -> list[str]:
    """Messages of the worst finding of each kind, and the number of others.

    Args:
        findings: The findings.
        max_kinds: Maximum number of kinds; another line has the number of remaining findings.
    """
    kinds = group_alike(findings)
    lines = []
    for worst, *similar in kinds[:max_kinds]:
        lines.append(f"{worst} (and {len(similar)} more like it)" if similar else str(worst))
    remaining = sum(map(len, kinds[len(lines) :]))
    return [*lines, f"and {remaining} more"] if remaining else lines


def finding_kind(finding: Finding) -> tuple[str, str, str]:
    """Group, subject and quantity, which findings of one kind share."""
    return finding.group, finding.subject, finding.quantity


def group_alike(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Group findings by their kind, the worst of each kind first.

    The worst finding has the largest utilisation, or else the smallest margin.
    """
    kinds: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        kinds.setdefault(finding_kind(finding), []).append(finding)
    for kind in kinds.values():
        worst = max(
            kind, key=lambda finding: (finding.utilisation or 0.0, -(finding.margin or 0.0))
        )
        kind.insert(0, kind.pop(kind.index(worst)))
    return list(kinds.values())


def representatives(findings: Sequence[Finding]) -> list[Finding]:
    """Select the findings to print for a group without utilisations.

    If limits are zero, it is the finding nearest its limit. Without limits, it is the largest value
    of each quantity. Otherwise there is none.
    """
    numbers = [finding for finding in findings if finding.value is not None]
    limited = limited_findings(numbers)
    if any(finding.utilisation is None for finding in limited):
        return [min(limited, key=lambda finding: finding.margin or 0.0)]
    if any(finding.limit is not None for finding in numbers):
        return []
    largest: dict[str, Finding] = {}
    for finding in numbers:
        if abs(finding.value or 0.0) >= abs(largest.get(finding.quantity, finding).value or 0.0):
            largest[finding.quantity] = finding
    return list(largest.values())


def limited_findings(numbers: Sequence[Finding]) -> list[Finding]:
    """Findings with a limit that is known to be kept or exceeded."""
    return [
        finding
        for finding in numbers
        if finding.is_decided and finding.limit is not None and not finding.only_sampled
    ]

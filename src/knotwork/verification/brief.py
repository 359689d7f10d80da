"""Findings in a few lines: what fails, and the tightest case of each group."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from knotwork.errors.plain_text import one_line
from knotwork.units import Units, readable
from knotwork.verification.finding import Finding
from knotwork.verification.worst import alike, and_more, with_limits, without_use

MOST_ROWS = 4
"""Number of lines of a group, the first finding of which is printed whole."""
MOST_LINES = 9
"""Where there are more lines, each group has fewer."""
NOTABLE = 0.01
"""A use of a limit below this part of it is worth no row of its own."""
NARROWEST = 20
INDENT = "  "
_NO_BREAK = "\N{NO-BREAK SPACE}"
_SPACE_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|mm|m|s|deg|rad|N)(?![\w'-]))|(?<=\d N) (?=m\b)")
"""A number stays in a line with its unit."""


class BriefLine(NamedTuple):
    """A line of a short report.

    >>> kw.plan("paper_case").report.brief()[0].kind
    'passed'

    Attributes:
        kind: `"passed"`, `"failed"`, `"failure"`, `"tried"`, `"sampled"`, `"warning"`, `"group"`
            or `"more"`.
        text: Without a line feed.
    """

    kind: str
    text: str


def group_lines(
    findings: Mapping[str, list[Finding]], units: Units, width: int, *, ok: bool
) -> list[BriefLine]:
    """A row for each group that has anything to say, and the names of the others in one.

    Args:
        findings: By their group.
        units: To show values in.
        width: Of the lines, in characters.
        ok: Nothing fails: else rows that explain why are printed only.
    """
    groups = {name: found for name, found in findings.items() if _has_numbers(found)}
    if ok:
        rest = "far below what is allowed"
        listed = {name: found for name, found in groups.items() if _far_from_limits(found)}
        rows = {name: found for name, found in groups.items() if name not in listed}
    else:
        rest = "met"
        listed = {name: found for name, found in groups.items() if _met(found)}
        rows = {name: found for name, found in groups.items() if _without_requirements(found)}
    for most in range(MOST_ROWS, 0, -1):
        lines = _rows(rows, units, width, most)
        if len(lines) <= MOST_LINES:
            break
    if listed:
        names = ", ".join(_counted(name, found) for name, found in listed.items())
        lines += wrapped("group", f"{INDENT}{rest}: {names}", width, 2 * INDENT)
    return lines


def worst_lines(
    kind: str, mark: str, findings: Sequence[Finding], most: int, units: Units, width: int
) -> list[BriefLine]:
    """The worst of findings that are alike, in some lines, and how many more there are.

    The first is printed whole. Others are shortened as far as that leaves lines for those after.

    Args:
        kind: Of the lines.
        mark: Words before each.
        findings: The findings.
        most: Number of lines; the first finding may take more.
        units: To show values in.
        width: Of the lines, in characters.
    """
    kinds = alike(findings)
    forms = [
        [
            wrapped(kind, f"{mark}{text}{and_more(len(others))}", width, " " * len(mark))
            for text in _forms(worst, units)
        ]
        for worst, *others in kinds
    ]
    shortest = [len(some[-1]) for some in forms]
    lines: list[BriefLine] = []
    for i, some in enumerate(forms):
        left = most - len(lines)
        if lines and shortest[i] > left - (i + 1 < len(forms)):
            more = sum(map(len, kinds[i:]))
            return [*lines, BriefLine("more", f"{' ' * len(mark)}and {more} more")]
        free = left - sum(shortest[i + 1 :])
        lines += next((form for form in some if not lines or len(form) <= free), some[-1])
    return lines


def _forms(found: Finding, units: Units) -> list[str]:
    """Texts of a finding, from the longest to the shortest."""
    words = [found.message, found.fact]
    return words if found.value is None else [*words, described(found, units)]


def _rows(
    groups: Mapping[str, list[Finding]], units: Units, width: int, most: int
) -> list[BriefLine]:
    """A row for each group: what its findings say in short of themselves, or its tightest case."""
    heads = {name: f"{INDENT}{_counted(name, found)}" for name, found in groups.items()}
    indent = max(map(len, heads.values()), default=0) + 2
    lines = []
    for name, found in groups.items():
        texts = own_words(found) or _tightest(found, units)
        own: list[BriefLine] = []
        for i, text in enumerate(texts):
            head = f"{'' if own else heads[name]:<{indent}}"
            row = wrapped("group", text, width, " " * indent, head)
            if own and len(own) + len(row) > most - (i + 1 < len(texts)):
                own.append(BriefLine("group", f"{'':<{indent}}and {len(texts) - i} more"))
                break
            own += row
        lines += own
    return lines


def own_words(findings: Sequence[Finding]) -> list[str]:
    """What findings say in short of themselves, even where all is well."""
    return [
        f"{one.brief}: undecided" if one.verdict == "undecided" else one.brief
        for one in findings
        if one.brief
    ]


def facts(groups: Mapping[str, list[Finding]]) -> dict[str, list[str]]:
    """What findings say in short of themselves, by group."""
    return {name: words for name, found in groups.items() if (words := own_words(found))}


def _tightest(findings: Sequence[Finding], units: Units) -> list[str]:
    """The finding nearest its limit: what part of it is used, or else by how much it is kept.

    Where nothing has a limit, it is the largest of each quantity.
    """
    numbers = [one for one in findings if one.value is not None]
    undecided = [one for one in numbers if one.verdict == "undecided"]
    if undecided:
        worst = max(undecided, key=lambda one: one.use or 0.0)
        return [f"{len(undecided)} undecided: {described(worst, units)}"]
    if others := without_use(findings):
        return [described(one, units) for one in others]
    limited = with_limits(numbers)
    if not limited:
        return ["sampled only" if any(one.only_sampled for one in numbers) else "not judged"]
    return [used(max(limited, key=lambda one: one.use or 0.0), units)]


def used(found: Finding, units: Units) -> str:
    """What part of its limit a finding uses, and what it is about."""
    return f"{100.0 * (found.use or 0.0):.0f} %: {described(found, units)}"


def described(found: Finding, units: Units) -> str:
    """What a finding is about, its value, its limit and when."""
    value, limit = found.value or 0.0, found.limit
    number = units.text(value, found.unit, ".4g")
    if limit:
        allowed = units.text(limit, found.unit, ".4g")
        from_below = (found.margin or 0.0) > 0.0 and abs(value) > abs(limit)
        bare = readable(units.shown(value, found.unit)[0])
        number = f"{number}, at least {allowed}," if from_below else f"{bare} of {allowed}"
    return " ".join(filter(None, (one_line(found.name), found.title, number, _moment(found))))


def in_short(found: Finding, units: Units) -> str:
    """A failure in one short line: what, where, by how much."""
    if found.label:
        return f"{found.label} {_moment(found)}".strip()
    return found.message if found.value is None else described(found, units)


def _moment(found: Finding) -> str:
    """When it is worst, or from when to when it holds."""
    if not found.when:
        return ""
    return f"{'from' if found.time is None else 'at'} {found.when} s"


def worst_in_short(findings: Sequence[Finding], units: Units) -> str:
    """The first kind of failure in one short line, and how many failures there are; or nothing."""
    kinds = alike(findings)
    if not kinds:
        return ""
    count = len(findings) - 1
    return in_short(kinds[0][0], units) + (f", and {count} more" if count else "")


def _far_from_limits(findings: Sequence[Finding]) -> bool:
    """Whether all have limits, and no part of them worth a word is used."""
    numbers = [one for one in findings if one.value is not None]
    if not numbers or any(one.brief for one in findings):
        return False
    uses = (0.0 if one.value == one.limit == 0.0 else one.use for one in numbers if one.required)
    return all(one.required for one in numbers) and all(
        use is not None and use < NOTABLE for use in uses
    )


def _counted(name: str, findings: Sequence[Finding]) -> str:
    """The name of a group, with how much it requires, if anything."""
    required = sum(one.required for one in findings)
    return f"{name} ({required})" if required else name


def _has_numbers(findings: Sequence[Finding]) -> bool:
    return any(one.value is not None or one.brief for one in findings)


def _without_requirements(findings: Sequence[Finding]) -> bool:
    return any(one.brief for one in findings) and not any(one.required for one in findings)


def _met(findings: Sequence[Finding]) -> bool:
    return all(one.ok for one in findings) and any(one.required for one in findings)


def wrapped(kind: str, text: str, width: int, indent: str, head: str = "") -> list[BriefLine]:
    """Lines of a text; the first begins with a head, the others are indented."""
    found = textwrap.wrap(
        _SPACE_BEFORE_UNIT.sub(_NO_BREAK, one_line(text)),
        max(width, len(indent) + NARROWEST),
        initial_indent=head,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [BriefLine(kind, line.replace(_NO_BREAK, " ")) for line in found or [head]]

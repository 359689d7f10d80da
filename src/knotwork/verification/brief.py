"""A report in a few lines: the verdict, what fails, and the tightest case of each group."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from knotwork.plain_text import one_line
from knotwork.units import Units, readable
from knotwork.verification.finding import Finding
from knotwork.verification.worst import alike, and_more, told_apart, with_limits

WIDTH = 80
MOST_LINES = 14
"""Largest number of lines of a report; failures may need more."""
MOST_FAILURE_LINES = 8
MOST_WARNING_LINES = 4
"""The first failure or warning is printed whole; others while this many lines have room."""
NOTABLE = 0.01
"""A use of a limit below this part of it is worth no row of its own."""
INDENT = "  "
_NO_BREAK = "\N{NO-BREAK SPACE}"
_SPACE_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|mm|m|s|deg|rad|N)(?![\w'-]))|(?<=\d N) (?=m\b)")
"""A number stays in a line with its unit."""


class ReportContent(Protocol):
    """The parts of a report that are printed."""

    @property
    def scenario(self) -> str:
        """Its name."""

    @property
    def start_time(self) -> float:
        """[s]."""

    @property
    def end_time(self) -> float:
        """[s]."""

    @property
    def units(self) -> Units:
        """Those of the scenario."""

    @property
    def ok(self) -> bool:
        """Whether nothing fails."""

    @property
    def failures(self) -> Sequence[Finding]:
        """Findings that fail."""

    @property
    def warnings(self) -> Sequence[Finding]:
        """Findings that are plausibly slips."""

    @property
    def sampled(self) -> Sequence[Finding]:
        """Findings that count as met because of samples alone."""

    @property
    def tried(self) -> Sequence[Finding]:
        """Findings on what was tried because something fails."""

    @property
    def groups(self) -> dict[str, list[Finding]]:
        """Findings by their group."""

    @property
    def counts(self) -> tuple[int, int]:
        """Requirements that are met, and all."""

    @property
    def tightest(self) -> Sequence[Finding]:
        """Of each quantity what uses most of its limit, most used first."""


class BriefLine(NamedTuple):
    """A line of a short report.

    Attributes:
        kind: `"passed"`, `"failed"`, `"failure"`, `"tried"`, `"sampled"`, `"warning"`, `"group"`
            or `"more"`.
        text: Without a line feed.
    """

    kind: str
    text: str


def brief(report: ReportContent, width: int = WIDTH) -> list[BriefLine]:
    """Write a report in at most some 15 lines.

    Args:
        report: The report.
        width: Of the lines, in characters; only longer words are longer.
    """
    lines = _wrapped("passed" if report.ok else "failed", _verdict(report), width)
    lines += _printed("failure", "FAIL ", report, report.failures, MOST_FAILURE_LINES, width)
    for found in report.tried:
        lines += _wrapped("tried", str(found), width)
    lines += _printed("sampled", "not proved: ", report, report.sampled, MOST_WARNING_LINES, width)
    lines += _printed("warning", "warning: ", report, report.warnings, MOST_WARNING_LINES, width)
    groups = {name: found for name, found in report.groups.items() if _has_numbers(found)}
    if report.ok:
        plain = {name: found for name, found in groups.items() if _far_from_limits(found)}
        rest = _listed("far below what is allowed", plain, width)
        rows = {name: found for name, found in groups.items() if name not in plain}
        room = MOST_LINES - len(lines) - len(rest)
        return [*lines, *_rows(rows, report.units, room, width), *rest]
    met = _listed("met", {name: found for name, found in groups.items() if _met(found)}, width)
    # a group without requirements may explain why the rest fails
    others = {name: found for name, found in groups.items() if _without_requirements(found)}
    room = MOST_LINES - len(lines) - len(met)
    return [*lines, *_rows(others, report.units, room, width), *met]


def summary(report: ReportContent) -> str:
    """Say in a line how much is met; where all is, what uses most of its limit.

    >>> from knotwork.verification.brief import summary
    >>> summary(kw.plan("ur5_deburring").report)
    '90 of 90 met; tightest 81 %: ...'
    """
    met, required = report.counts
    tight = [one for one in report.tightest if (one.use or 0.0) >= NOTABLE]
    tightest = f"; tightest {_used(tight[0], report.units)}" if tight and report.ok else ""
    return f"{met} of {required} met{reservations(report)}{tightest}"


def _verdict(report: ReportContent) -> str:
    met, required = report.counts
    failed = f", {required - met} failed" if required > met else ""
    word = "PASSED" if report.ok else "FAILED"
    duration = f"{report.end_time - report.start_time:.5g} s"
    failed += reservations(report)
    return f"{word} {report.scenario}: {met} of {required} requirements met{failed}; {duration}"


def reservations(report: ReportContent) -> str:
    """Say how much is undecided, and how much is met because of samples alone, if anything is."""
    findings = (one for found in report.groups.values() for one in found)
    undecided = sum(one.verdict == "undecided" for one in findings)
    counted = {"undecided": undecided, "sampled only": len(report.sampled)}
    return "".join(f", {count} {what}" for what, count in counted.items() if count)


def _listed(what: str, groups: Mapping[str, Sequence[Finding]], width: int) -> list[BriefLine]:
    """Groups of which only the names are printed."""
    if not groups:
        return []
    names = ", ".join(_counted(name, found) for name, found in groups.items())
    return _wrapped("group", f"{INDENT}{what}: {names}", width, 2 * INDENT)


def _printed(
    kind: str, mark: str, report: ReportContent, findings: Sequence[Finding], most: int, width: int
) -> list[BriefLine]:
    """Print findings in their own words: the worst of those alike, and how many more there are.

    The first is printed whole. Others are shortened as far as this makes room for those after
    them.
    """
    kinds = alike(findings)
    forms = [
        [_wrapped(kind, f"{mark}{text}", width, " " * len(mark)) for text in texts]
        for texts in (_forms(several, report.units) for several in kinds)
    ]
    shortest = [len(some[-1]) for some in forms]
    lines: list[BriefLine] = []
    for i, some in enumerate(forms):
        room = most - len(lines)
        free = room - sum(shortest[i + 1 :])
        if lines and shortest[i] > room - (i + 1 < len(forms)):
            left = sum(len(several) for several in kinds[i:])
            return [*lines, BriefLine("more", f"{' ' * len(mark)}and {left} more")]
        fitting = (form for form in some if not lines or len(form) <= free)
        lines += next(fitting, some[-1])
    return lines


def _forms(several: Sequence[Finding], units: Units) -> list[str]:
    """Texts of findings that are alike, from the longest to the shortest."""
    worst, *others = several
    words = [worst.message, worst.fact]
    if worst.value is not None:
        words.append(_described(worst, units))
    return [f"{text}{and_more(len(others))}" for text in words]


def _rows(groups: dict[str, list[Finding]], units: Units, room: int, width: int) -> list[BriefLine]:
    """One row a group, and what findings say in short of themselves as long as there is room."""
    heads = {name: f"{INDENT}{_counted(name, found)}" for name, found in groups.items()}
    indent = max((len(head) for head in heads.values()), default=0) + 2
    printed = {
        name: [_own_words(one) for one in found if one.brief] or _tightest(found, units)
        for name, found in groups.items()
    }
    # a line for how many more there are is kept free where there are any
    needed = (
        len(_lines(texts[0], width - indent)) + (len(texts) > 1) for texts in printed.values()
    )
    spare = max(0, room - sum(needed))
    lines: list[BriefLine] = []
    for name, texts in printed.items():
        kept, spare = _fitting(texts, spare, width - indent)
        head = heads[name]
        for text in kept:
            for line in _lines(text, width - indent):
                lines.append(BriefLine("group", f"{head:<{indent}}{line}"))
                head = ""
    return lines


def _fitting(texts: Sequence[str], spare: int, width: int) -> tuple[list[str], int]:
    """The first text, others as long as there is room, and the lines that are left after them."""
    sizes = [len(_lines(text, width)) for text in texts]
    room = spare + (len(texts) > 1)
    if sum(sizes[1:]) <= room:
        return list(texts), room - sum(sizes[1:])
    kept, used = 1, 0
    while used + sizes[kept] < room:
        used += sizes[kept]
        kept += 1
    return [*texts[:kept], f"and {len(texts) - kept} more"], room - used - 1


def _own_words(found: Finding) -> str:
    return f"{found.brief}: undecided" if found.verdict == "undecided" else found.brief


def _tightest(findings: Sequence[Finding], units: Units) -> list[str]:
    """The finding nearest its limit: what part of it is used, or else by how much it is kept.

    Where nothing has a limit, it is the largest of each quantity.
    """
    numbers = [one for one in findings if one.value is not None]
    undecided = [one for one in numbers if one.verdict == "undecided"]
    if undecided:
        worst = max(undecided, key=lambda one: one.use or 0.0)
        return [f"{len(undecided)} undecided: {_described(worst, units)}"]
    apart = told_apart(findings)
    if apart:
        return [_described(one, units) for one in apart]
    limited = with_limits(numbers)
    if not limited:
        return ["sampled only" if any(one.only_sampled for one in numbers) else "not judged"]
    return [_used(max(limited, key=lambda one: one.use or 0.0), units)]


def _used(found: Finding, units: Units) -> str:
    """What part of its limit a finding uses, and what it is about."""
    return f"{100.0 * (found.use or 0.0):.0f} %: {_described(found, units)}"


def _described(found: Finding, units: Units) -> str:
    """What a finding is about, its value, its limit and when."""
    number = units.text(found.value or 0.0, found.unit, ".4g")
    if found.limit:
        limit = units.text(found.limit, found.unit, ".4g")
        from_below = (found.margin or 0.0) > 0.0 and abs(found.value or 0.0) > abs(found.limit)
        bare = readable(units.shown(found.value or 0.0, found.unit)[0])
        number = f"{number}, at least {limit}," if from_below else f"{bare} of {limit}"
    at = f"at {found.when} s" if found.when else ""
    return " ".join(filter(None, (one_line(found.name), found.title, number, at)))


def _far_from_limits(findings: Sequence[Finding]) -> bool:
    """Whether all have limits, and no part of them worth a word is used."""
    uses = [
        0.0 if one.value == one.limit == 0.0 else one.use
        for one in findings
        if one.required and one.value is not None
    ]
    others = any(one.brief or (one.value is not None and not one.required) for one in findings)
    return bool(uses) and not others and all(use is not None and use < NOTABLE for use in uses)


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


def _wrapped(kind: str, text: str, width: int, indent: str = INDENT) -> list[BriefLine]:
    first, *others = _lines(text, width, width - len(indent))
    return [BriefLine(kind, first), *(BriefLine(kind, indent + line) for line in others)]


def _lines(text: str, width: int, later: int | None = None) -> list[str]:
    """Lines of a text; those after the first are as wide as `later` says, if it does."""
    indent = " " * (width - later) if later is not None else ""
    found = textwrap.wrap(
        _SPACE_BEFORE_UNIT.sub(_NO_BREAK, one_line(text)),
        max(width, 20),
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
        drop_whitespace=True,
    )
    lines = [found[0], *(line[len(indent) :] for line in found[1:])] if found else [""]
    return [line.replace(_NO_BREAK, " ") for line in lines]

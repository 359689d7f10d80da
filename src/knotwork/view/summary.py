"""A report in a line: how much of what is required is met, and what is tightest."""

from __future__ import annotations

from knotwork.verification import Finding, Report

# Below this part of its limit nothing is worth a word.
LOOSE = 0.01


def summary(report: Report) -> str:
    """Say how many requirements are met, and if all are, which of them uses most of its limit.

    >>> from knotwork.view.summary import summary
    >>> summary(kw.plan("ur5_deburring").report)
    '86 of 86 met; tightest: tool speed 81 % of the limit'
    """
    met, required = report.counts
    said = f"{met} of {required} met"
    tight = [found for found in report.tightest if (found.use or 0.0) >= LOOSE]
    return f"{said}; tightest: {in_words(tight[0])}" if tight and report.ok else said


def in_words(found: Finding) -> str:
    """Say in a few words what a finding is about, and how much of its limit it uses."""
    name = found.name or found.subject
    title = found.title if not found.title.startswith(name) else found.title[len(name) :].strip()
    return f"{name} {title} {100 * (found.use or 0.0):.0f} % of the limit"

"""Equations as MathML, which browsers draw by themselves: no script, no font, no network.

The translation from LaTeX is that of docutils, on which Sphinx stands anyway. A label `eq-30`
or a tag 30 shows as (30), the number of the equation in the paper.
"""

from __future__ import annotations

import re
import unicodedata
from typing import Any
from xml.etree import ElementTree

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

MATHML = "http://www.w3.org/1998/Math/MathML"
COMBINING_DOT = "\N{COMBINING DOT ABOVE}"
logger = logging.getLogger(__name__)


def _mathml(node: Any, *, block: bool) -> str:
    # docutils knows neither
    source = re.sub(r"\\tag\{\w+\}", "", node.astext())
    source = re.sub(r"\\[Bb]ig+\(", r"\\left(", source)
    source = re.sub(r"\\[Bb]ig+\)", r"\\right)", source)
    try:
        return _dots_above(str(tex2mathml(source, as_block=block)))
    except MathError as error:
        logger.warning("equation %r: %s", node.astext(), error, location=node)
        raise nodes.SkipNode from error


def _dots_above(text: str) -> str:
    """Dot small letters by a combining dot on the italic letter, with an index next to it.

    docutils puts the dot into an element of its own, which fonts without tables for mathematics set
    onto the letter, and an index below it, as of a sum. On capitals the combining dot is too low.
    """
    ElementTree.register_namespace("", MATHML)
    root = ElementTree.fromstring(text)
    for kind in ("mover", "munderover"):
        for node in list(root.iter(f"{{{MATHML}}}{kind}")):
            letter, *index, accent = node
            if accent.text != "˙" or (letter.text or "").isupper():
                continue
            node.clear()
            target = node
            if index:
                node.tag = f"{{{MATHML}}}msub"
                target = ElementTree.SubElement(node, "")
                node.extend(index)
            target.tag = f"{{{MATHML}}}mi"
            target.text = _italic(letter.text or "") + COMBINING_DOT
    return ElementTree.tostring(root, encoding="unicode")


def _italic(letter: str) -> str:
    """Return the mathematical italic of a small Latin or Greek letter."""
    return unicodedata.lookup(f"MATHEMATICAL ITALIC SMALL {unicodedata.name(letter).split()[-1]}")


def visit_inline(translator: Any, node: nodes.math) -> None:
    """Write an equation inside a line."""
    translator.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def visit_block(translator: Any, node: nodes.math_block) -> None:
    """Write an equation of its own, with its number if it has a label."""
    body = translator.body
    body.append('<div class="math">')
    body.append(f'<div class="scroll">{_mathml(node, block=True)}</div>')
    label, tag = str(node.get("label") or ""), re.search(r"\\tag\{(\w+)\}", node.astext())
    if label.startswith("eq-"):
        link = f'<a class="headerlink" href="#equation-{label}" title="Link to this equation">¶</a>'
        body.append(f'<span class="eqno">({label.removeprefix("eq-")}){link}</span>')
    elif tag:
        body.append(f'<span class="eqno">({tag[1]})</span>')
    body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Offer the renderer."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Equations as MathML, which browsers draw by themselves: no script, no font, no network.

The translation from LaTeX is that of docutils, on which Sphinx stands anyway. A label `eq-30`
shows as (30), the number of the equation in the paper.
"""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

MATHML = "http://www.w3.org/1998/Math/MathML"
logger = logging.getLogger(__name__)


def _mathml(node: Any, *, block: bool) -> str:
    try:
        return _dots_above(str(tex2mathml(node.astext(), as_block=block)))
    except MathError as error:
        logger.warning("equation %r: %s", node.astext(), error, location=node)
        raise nodes.SkipNode from error


def _dots_above(text: str) -> str:
    """Put the index of a dotted letter beside it; docutils puts it below, as of a sum."""
    ElementTree.register_namespace("", MATHML)
    root = ElementTree.fromstring(text)
    for node in root.iter(f"{{{MATHML}}}munderover"):
        if node[2].text == "˙":
            letter, index, dot = node
            node.clear()
            node.tag = f"{{{MATHML}}}msub"
            dotted = ElementTree.SubElement(node, f"{{{MATHML}}}mover", accent="true")
            dotted.extend([letter, dot])
            node.append(index)
    return ElementTree.tostring(root, encoding="unicode")


def visit_inline(translator: Any, node: nodes.math) -> None:
    """Write an equation inside a line."""
    translator.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def visit_block(translator: Any, node: nodes.math_block) -> None:
    """Write an equation of its own, with its number if it has a label."""
    body = translator.body
    body.append(translator.starttag(node, "div", CLASS="math"))
    body.append(f'<div class="scroll">{_mathml(node, block=True)}</div>')
    label = str(node.get("label") or "")
    if label.startswith("eq-"):
        link = f'<a class="headerlink" href="#equation-{label}" title="Link to this equation">¶</a>'
        body.append(f'<span class="eqno">({label.removeprefix("eq-")}){link}</span>')
    body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Offer the renderer."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

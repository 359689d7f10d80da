"""Validation of a URDF before Pinocchio reads it: a tree of links of limited size.

Pinocchio's parser is recursive, so a long chain of links would crash the process, and its
result for links in a ring depends on the order of the file.
"""

from __future__ import annotations

import math
from typing import Any
from xml.dom.minidom import Element

from knotwork.errors import InputError, format_value

MAX_LINKS = 2_000
MAX_LINK_DEPTH = 500
MIN_MOMENT = -1e-12
"""Minimum moment of inertia [kg m²]. CAD programs may write negative rounding errors for zero."""

_TREE_ELEMENTS = {
    "robot": ("link", "joint"),
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "joint": ("origin", "parent", "child", "axis", "limit", "mimic", "dynamics"),
}
"""Elements of the tree of links by their parent; Pinocchio sees no others."""


def child_elements(element: Element, tag: str = "") -> list[Element]:
    """Child elements, optionally of one tag."""
    nodes = element.childNodes
    return [node for node in nodes if isinstance(node, Element) and tag in ("", node.tagName)]


def read_link(joint: Element, end: str) -> str:
    """Read the link at an end of a joint, `"parent"` or `"child"`; empty if there is none."""
    elements = child_elements(joint, end)
    return elements[0].getAttribute("link") if elements else ""


def elements_by_name(root: Element, tag: str) -> dict[str, Element]:
    """Child elements by name, such as the links of a URDF."""
    return {element.getAttribute("name"): element for element in child_elements(root, tag)}


def append_element(parent: Element, tag: str, **attributes: str) -> Element:
    """Append a new child element, and return it."""
    document: Any = parent.ownerDocument
    element: Element = document.createElement(tag)
    for name, value in attributes.items():
        element.setAttribute(name, value)
    parent.appendChild(element)
    return element


def check_tree(root: Element) -> str:
    """Check that links and joints form one tree, and return its root link.

    Raises:
        InputError: Links and joints do not form one tree, or the tree is above the maximum size.
    """
    if not root.getAttribute("name"):
        raise InputError("<robot> has no name")
    links, joints = child_elements(root, "link"), child_elements(root, "joint")
    if len(links) > MAX_LINKS:
        raise InputError(f"it has {len(links)} links; at most {MAX_LINKS} are read")
    names = _check_names(links, "link")
    _check_names(joints, "joint")
    above: dict[str, str] = {}
    for joint in joints:
        name = joint.getAttribute("name")
        if name == "universe":
            raise InputError("a joint is named 'universe', which Pinocchio reserves for its root")
        for end in ("parent", "child"):
            link = read_link(joint, end)
            if link not in names:
                fault = f"{link!r}, which is not a link" if link else "not given"
                raise InputError(f"the {end} of joint {name!r} is {fault}")
        child = read_link(joint, "child")
        if child in above:
            raise InputError(f"link {child!r} is the child of two joints; only one is accepted")
        above[child] = read_link(joint, "parent")
    roots = [name for name in names if name not in above]
    if len(roots) > 1:
        some = ", ".join(map(repr, roots[:5]))
        raise InputError(f"it has {len(roots)} root links; only one is accepted: {some}")
    _check_depth(roots, names, above)
    for element in links:
        _check_inertia(element)
    for element in joints:
        _check_axis(element)
    return roots[0]


def _check_names(elements: list[Element], kind: str) -> dict[str, None]:
    """Check that names are given once each; return them in order, as keys of a mapping."""
    names: dict[str, None] = {}
    for element in elements:
        name = element.getAttribute("name")
        if not name or name in names:
            raise InputError(f"{kind} {name!r} is given twice" if name else f"a {kind} has no name")
        names[name] = None
    if not names and kind == "link":
        raise InputError("it has no link")
    return names


def _check_depth(roots: list[str], names: dict[str, None], above: dict[str, str]) -> None:
    """Refuse rings of links, and chains that are too long for Pinocchio."""
    below: dict[str, list[str]] = {}
    for child, parent in above.items():
        below.setdefault(parent, []).append(child)
    level, depth, unvisited = roots, 0, dict(names)
    while level:
        depth += 1
        if depth > MAX_LINK_DEPTH:
            raise InputError(
                f"link {level[0]!r} is the last of {depth} in a row; at most "
                f"{MAX_LINK_DEPTH} are read"
            )
        for link in level:
            del unvisited[link]
        level = [child for link in level for child in below.get(link, ())]
    if unvisited:  # not connected to a root
        some = ", ".join(map(repr, [*unvisited][:5]))
        raise InputError(f"its links form a ring, which no root link carries: {some}")


def _check_inertia(link: Element) -> None:
    """Refuse impossible masses and moments of inertia, which Pinocchio would accept."""
    name = link.getAttribute("name")
    for inertial in child_elements(link, "inertial"):
        for mass in child_elements(inertial, "mass"):
            _check_not_negative(mass, "value", f"the mass of link {name!r}")
        for inertia in child_elements(inertial, "inertia"):
            for moment in ("ixx", "iyy", "izz"):
                if inertia.hasAttribute(moment):
                    quantity = f"{moment} of link {name!r}"
                    _check_not_negative(inertia, moment, quantity, MIN_MOMENT)


def _check_not_negative(element: Element, attribute: str, name: str, minimum: float = 0.0) -> None:
    text = element.getAttribute(attribute)
    if not minimum <= _parse_number(text) < math.inf:
        raise InputError(f"{name} is {format_value(text)}; it must be a number from 0 on")


def _check_axis(joint: Element) -> None:
    """Refuse an axis without a direction of a joint that needs one."""
    if joint.getAttribute("type") in ("fixed", "floating"):
        return
    for axis in child_elements(joint, "axis"):
        text = axis.getAttribute("xyz")
        if not 0.0 < math.hypot(*map(_parse_number, text.split())) < math.inf:
            name = joint.getAttribute("name")
            raise InputError(
                f"the axis of joint {name!r} is {format_value(text)}; it must be a direction, such "
                "as '0 0 1'"
            )


def _parse_number(text: str) -> float:
    """Parse a number; NaN for other text."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def reduce_to_tree(root: Element) -> str:
    """Reduce a URDF to the tree of links, without shapes and data of other programs."""
    for name in list(root.attributes.keys()):
        if name != "name":
            root.removeAttribute(name)
    _prune(root)
    return root.toxml()


def _prune(element: Element) -> None:
    for name in list(element.attributes.keys()):
        if ":" in name:  # of a namespace, possibly undeclared
            element.removeAttribute(name)
    children = child_elements(element)
    element.childNodes[:] = [
        x for x in children if x.tagName in _TREE_ELEMENTS.get(element.tagName, ())
    ]
    for child in child_elements(element):
        _prune(child)

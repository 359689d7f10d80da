"""What a COLLADA file counts of its shapes, against what it has.

pycollada leaves out what it does not know, takes what the file has where a count is larger, and
writes zeros in place of text that is no number.
"""

from __future__ import annotations

from xml.etree import ElementTree

from knotwork.errors import InputError, shown
from knotwork.scene.meshes.size_limits import require_whole

_FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
_UNREAD = {
    "instance_controller": "a skin or morph (<instance_controller>)",
    "ph": "a polygon with holes (<ph>)",
}


def tag(element: ElementTree.Element) -> str:
    """Name of an element without its namespace; empty for comments."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def check_whole(root: ElementTree.Element) -> None:
    """Check that all shapes of a file are of kinds that are read, and as many as it says.

    Raises:
        InputError: They are not.
    """
    for element in root.iter():
        kind = tag(element)
        require_whole(kind not in _UNREAD, f"it has {_UNREAD.get(kind)}, which is not read")
        if kind == "unit":
            _check_unit(element.get("meter", "1"))
        elif kind == "mesh":
            for part in element.iter():
                _check_part(part, tag(part))


def _check_unit(metres: str) -> None:
    """Refuse a unit that pycollada takes for a metre because it is no number."""
    try:
        known = 0.0 <= float(metres) < float("inf")
    except ValueError:
        known = False
    if not known:
        raise InputError(f"its unit of length is {shown(metres)}, no number of metres")


def _check_part(element: ElementTree.Element, kind: str) -> None:
    if kind == "float_array":
        _check_counted(element, "numbers", _count(element))
    elif kind == "accessor":
        # pycollada takes values to lie one after the other
        offset, stride = element.get("offset", "0"), element.get("stride", "1")
        named = sum(tag(one) == "param" for one in element)
        require_whole(
            offset == "0" and int(stride) == named,
            f"an accessor has offset {shown(offset)} and stride {shown(stride)}; read are offset 0 "
            f"and a stride of its {named} values",
        )
    elif kind in _FACES:
        _check_primitive(element, kind)


def _check_primitive(element: ElementTree.Element, kind: str) -> None:
    inputs = [int(one.get("offset", "0")) for one in element if tag(one) == "input"]
    each = max(inputs, default=0) + 1
    lists = [_count(one) for one in element if tag(one) == "p"]
    whole = all(size % each == 0 for size in lists)
    require_whole(whole, f"a <p> of <{kind}> ends within a corner")
    corners = [size // each for size in lists]
    total = sum(corners)
    if kind == "triangles":
        require_whole(
            len(corners) <= 1 and total % 3 == 0,
            f"<triangles> has {len(corners)} <p> with {total} corners; read is one with 3 for each",
        )
        corners = total // 3 * [3]
    elif kind == "polylist":
        texts = [one.text or "" for one in element if tag(one) == "vcount"]
        sides = [int(word) for text in texts for word in text.split()]
        require_whole(
            len(corners) <= 1 and sum(sides) == total,
            f"<vcount> of <polylist> adds up to {sum(sides)} corners, and {len(corners)} <p> has "
            f"{total}",
        )
        corners = sides
    _check_counted(element, f"faces of <{kind}>", len(corners))
    if min(corners, default=3) < 3:
        raise InputError(f"it has <{kind}> with {min(corners)} corners, fewer than 3")


def _check_counted(element: ElementTree.Element, what: str, found: int) -> None:
    stated = element.get("count", str(found))
    fault = f"its count says {shown(stated)} {what}, and it has {found}"
    require_whole(stated.strip() == str(found), fault)


def _count(element: ElementTree.Element) -> int:
    """How many numbers there are, without making them, since a file may have millions."""
    text = element.text or ""
    if "n" in text.lower():
        raise InputError(f"<{tag(element)}> has numbers that are not finite")
    return len(text.split())

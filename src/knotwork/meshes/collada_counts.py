"""What a COLLADA file counts of its shapes, against what it has.

pycollada leaves out what it does not know, takes what the file has where a count is larger, and
writes zeros in place of text that is no number.
"""

from __future__ import annotations

from xml.etree import ElementTree

from knotwork.errors import InputError, shown

_FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")


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
        if kind == "instance_controller":
            what = "a skin or morph (<instance_controller>)"
        elif kind == "ph":
            what = "a polygon with holes (<ph>)"
        else:
            what = ""
        if what:
            raise InputError(f"it is not read whole: it has {what}, which is not read")
        if kind == "mesh":
            _check_mesh(element)
        elif kind == "unit":
            _check_unit(element.get("meter", "1"))


def _check_unit(metres: str) -> None:
    """Refuse a unit that pycollada takes for a metre because it is no number."""
    try:
        known = 0.0 <= float(metres) < float("inf")
    except ValueError:
        known = False
    if not known:
        raise InputError(f"its unit of length is {shown(metres)}, no number of metres")


def _check_mesh(mesh: ElementTree.Element) -> None:
    for element in mesh.iter():
        kind = tag(element)
        if kind == "float_array":
            _check_counted(element, "numbers", _count(element))
        elif kind == "accessor":
            _check_accessor(element)
        elif kind in _FACES:
            _check_primitive(element)


def _check_accessor(element: ElementTree.Element) -> None:
    """Refuse values that lie otherwise than one after the other, as pycollada takes them."""
    named = sum(tag(one) == "param" for one in element)
    if element.get("offset", "0") != "0" or int(element.get("stride", "1")) != named:
        raise InputError(
            f"it is not read whole: an accessor has offset {shown(element.get('offset', '0'))} and "
            f"stride {shown(element.get('stride', '1'))}; read are offset 0 and a stride of its "
            f"{named} values"
        )


def _check_primitive(element: ElementTree.Element) -> None:
    kind = tag(element)
    inputs = [int(one.get("offset", "0")) for one in element if tag(one) == "input"]
    each = max(inputs, default=0) + 1
    lists = [_count(one) for one in element if tag(one) == "p"]
    what = f"faces of <{kind}>"
    if any(size % each for size in lists):
        raise InputError(f"it is not read whole: a <p> of <{kind}> ends within a corner")
    corners = [size // each for size in lists]
    if kind == "triangles":
        if len(corners) > 1 or sum(corners) % 3:
            raise InputError(
                f"it is not read whole: <triangles> has {len(corners)} <p> with {sum(corners)} "
                "corners; read is one with 3 for each"
            )
        _check_counted(element, what, sum(corners) // 3)
        return
    if kind == "polylist":
        texts = [one.text or "" for one in element if tag(one) == "vcount"]
        sides = [int(word) for text in texts for word in text.split()]
        stated = sum(sides)
        if len(corners) > 1 or stated != sum(corners):
            raise InputError(
                f"it is not read whole: <vcount> of <polylist> adds up to {stated} corners, and "
                f"{len(corners)} <p> has {sum(corners)}"
            )
        corners = sides
    _check_counted(element, what, len(corners))
    if corners and min(corners) < 3:
        raise InputError(f"it has <{kind}> with {min(corners)} corners, fewer than 3")


def _check_counted(element: ElementTree.Element, what: str, found: int) -> None:
    stated = element.get("count")
    if stated is not None and stated.strip() != str(found):
        raise InputError(
            f"it is not read whole: its count says {shown(stated)} {what}, and it has {found}"
        )


def _count(element: ElementTree.Element) -> int:
    """How many numbers there are, without making them, since a file may have millions."""
    text = element.text or ""
    if "n" in text.lower():
        raise InputError(f"<{tag(element)}> has numbers that are not finite")
    return len(text.split())

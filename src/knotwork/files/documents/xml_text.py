"""Untrusted XML text as a tree, with its size checked before any recursion."""

from __future__ import annotations

from xml.dom import expatbuilder
from xml.dom.minidom import Document
from xml.parsers import expat

from knotwork.errors import InputError

MAX_XML_DEPTH = 100
"""Maximum nesting depth; parsers and writers of trees are recursive."""


def parse_xml(data: bytes, max_elements: int) -> Document:
    """Parse XML into a tree without namespaces, so that prefixes need not be declared.

    Args:
        data: The text.
        max_elements: Largest number of elements.

    Raises:
        InputError: As for `check_xml`.
    """
    check_xml(data, max_elements)
    return expatbuilder.parseString(data, namespaces=False)


def check_xml(data: bytes, max_elements: int) -> None:
    """Check that XML is well formed, small and plain, without making a tree of it.

    Raises:
        InputError: The text is not XML, has too many elements, nests elements deeper than
            `MAX_XML_DEPTH`, or declares entities or attributes, because these can expand a short
            text to a long one.
    """
    depth = count = 0

    def start(name: str, attributes: object) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_XML_DEPTH:
            raise _error_at(parser, f"elements are nested more than {MAX_XML_DEPTH} deep")
        if count > max_elements:
            raise _error_at(parser, f"it has more than {max_elements} elements")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def entity(*_: object) -> None:
        raise _error_at(parser, "it declares an entity; write out its text")

    def attribute(*_: object) -> None:
        raise _error_at(parser, "it declares an attribute; write it out where it is used")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.EntityDeclHandler, parser.AttlistDeclHandler = entity, attribute
    try:
        parser.Parse(data, True)
    except InputError:
        raise
    except (expat.ExpatError, ValueError, LookupError) as error:  # or an unknown encoding
        raise InputError(f"it is not XML: {error}") from error


def _error_at(parser: expat.XMLParserType, reason: str) -> InputError:
    return InputError(f"line {parser.CurrentLineNumber}: {reason}")

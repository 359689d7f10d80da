"""A YAML file or a mapping in, a validated model out; every problem with its line and field.

Files are YAML 1.2 (core schema): `1e-3` is a number, `on` is text, and a key given twice is an
error.
"""

from knotwork.documents.document import Document, Location, Places, field_path
from knotwork.documents.edits import REMOVED, Edits, edited, edited_text
from knotwork.documents.validation import description_of, validate
from knotwork.documents.values import Finite, Number, Positive, StrictModel, Text, optional
from knotwork.documents.xml_text import check_xml, parse_xml
from knotwork.documents.yaml_text import parse, read, read_text

__all__ = [
    "REMOVED",
    "Document",
    "Edits",
    "Finite",
    "Location",
    "Number",
    "Places",
    "Positive",
    "StrictModel",
    "Text",
    "check_xml",
    "description_of",
    "edited",
    "edited_text",
    "field_path",
    "optional",
    "parse",
    "parse_xml",
    "read",
    "read_text",
    "validate",
]

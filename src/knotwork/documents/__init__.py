"""A YAML file or a mapping in, a validated model out; every problem with its line and field.

Files are YAML 1.2 (core schema): `1e-3` is a number, `on` is text, and a key given twice is an
error.
"""

from knotwork.documents.document import Document, Location, field_path
from knotwork.documents.validation import Number, Positive, StrictModel, Text, validate
from knotwork.documents.yaml_text import parse, read, read_text

__all__ = [
    "Document",
    "Location",
    "Number",
    "Positive",
    "StrictModel",
    "Text",
    "field_path",
    "parse",
    "read",
    "read_text",
    "validate",
]

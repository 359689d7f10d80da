"""YAML files and mappings, validated as models. Each problem has its line and field.

Files are YAML 1.2 (core schema): `1e-3` is a number, `on` is text, and a key given twice is an
error.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

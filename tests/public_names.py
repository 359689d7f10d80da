"""Names that users rely on: those that docs/api describes."""

from __future__ import annotations

import re
from pathlib import Path

PAGES = Path(__file__).parents[1] / "docs" / "api"


def documented() -> set[str]:
    """Dotted names that the pages of the Python interface describe."""
    texts = [page.read_text(encoding="utf-8") for page in PAGES.glob("*.rst")]
    return {name for text in texts for name in re.findall(r"^\.\. auto\w+:: ([\w.]+)", text, re.M)}

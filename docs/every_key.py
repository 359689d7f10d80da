"""Write `docs/every_key.md`: every key of scenario and robot files, to be read in the repository.

`make keys` runs it; the site has the same tables, made while it is built.
"""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))
schema_tables = importlib.import_module("schema_tables")

OUTPUT = HERE / "every_key.md"
HEAD = """# Every key

<!-- `make keys` writes this page from the schema that files are checked by. -->

The keys of scenario files, and below those of robot files. [Scenario files](scenario.md) and
[robots](robot_file.md) explain them. *Length* is the file's unit of length, *angle* its unit of
angle; robot files are in m and rad.
"""


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    for kind, title in (("scenario", "Scenario files"), ("robot", "Robot files")):
        parts.append(f"\n## {title}\n")
        definitions = schema_tables.schema_of(kind)
        for name in schema_tables.order(definitions):
            about = str(definitions[name].get("description", "")).split("\n\n")[0]
            parts += _section(kind, name, about.replace("\n", " "))
            parts += _table(kind, list(schema_tables.rows(definitions[name])))
    return "\n".join(parts) + "\n"


def _section(kind: str, name: str, about: str) -> Iterator[str]:
    yield f'\n<a id="{kind}-{name.lower()}"></a>\n'
    yield f"### {_title(name)}\n"
    yield f"{_linked(about, kind)}\n"


def _table(kind: str, rows: list[tuple[str, ...]]) -> Iterator[str]:
    yield f"| {' | '.join(schema_tables.HEADER)} |"
    yield "|---" * len(schema_tables.HEADER) + "|"
    for cells in rows:
        yield f"| {' | '.join(_linked(cell, kind).replace('|', chr(92) + '|') for cell in cells)} |"


def _title(name: str) -> str:
    title = schema_tables.TITLES[name]
    return f"`{title}`" if re.fullmatch(r"[a-z_]+", title) else title


def _linked(text: str, kind: str) -> str:
    """Text whose `{definitions}` are links to their sections."""
    return re.sub(r"\{(\w+)\}", lambda m: f"[{_title(m[1])}](#{kind}-{m[1].lower()})", text)


if __name__ == "__main__":
    OUTPUT.write_text(page(), encoding="utf-8")

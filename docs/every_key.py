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

Row = tuple[str, ...]
# With this number of keys in common, a table refers to an earlier one instead of repeating them.
FEWEST_SHARED = 4
OUTPUT = HERE / "every_key.md"
HEAD = """# Every key

<!-- `make keys` writes this page from the schema that files are checked by. -->

The keys of scenario files, then those of robot files. [Scenario files](scenario.md) and
[robots](robot_file.md) explain them. Units are in brackets: *length* and *angle* are the file's
own, in robot files m and rad.
"""


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    shown: dict[tuple[str, str], list[Row]] = {}
    for kind, title in (("scenario", "Scenario files"), ("robot", "Robot files")):
        parts.append(f"\n## {title}\n")
        definitions = schema_tables.schema_of(kind)
        for name in schema_tables.order(definitions):
            about = str(definitions[name].get("description", "")).split("\n\n")[0]
            parts += _section(kind, name, about.replace("\n", " "))
            rows = list(schema_tables.rows(definitions[name]))
            parts += _table(kind, rows, shown)
            shown[kind, name] = rows
    return "\n".join(parts) + "\n"


def _section(kind: str, name: str, about: str) -> Iterator[str]:
    yield f"\n### {_title(kind, name)}\n"
    yield f"{_linked(about, kind)}\n"


def _table(kind: str, rows: list[Row], shown: dict[tuple[str, str], list[Row]]) -> Iterator[str]:
    """The keys of one mapping; those that an earlier table describes only by their names."""
    (of, name), same = max(
        ((where, [row for row in rows if row in table]) for where, table in shown.items()),
        key=lambda found: len(found[1]),
        default=(("", ""), []),
    )
    if len(same) >= FEWEST_SHARED:
        keys = ", ".join(row[0] for row in same)
        yield f"As in {_link(of, name)}: {keys}.\n"
        rows = [row for row in rows if row not in same]
    if not rows:
        return
    yield "|key|accepted|meaning|"
    yield "|---|---|---|"
    for key, accepted, unit, left_out, meaning in rows:
        values = accepted if unit == "–" else f"{accepted} [{unit}]"
        default = {"–": "", "needed": " Needed."}.get(left_out, f" Default: {left_out}.")
        cells = (key, values, f"{meaning}.{default}" if default else meaning)
        yield f"|{'|'.join(_linked(cell, kind).replace('|', chr(92) + '|') for cell in cells)}|"


def _title(kind: str, name: str) -> str:
    title = schema_tables.TITLES[name]
    if kind == "robot":
        title = f"robot: {title}"
    return f"`{title}`" if re.fullmatch(r"[a-z_]+", title) else title


def _link(kind: str, name: str) -> str:
    """A link to a section, by the anchor that a viewer of Markdown makes of its heading."""
    title = _title(kind, name)
    anchor = re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")
    return f"[{title}](#{anchor})"


def _linked(text: str, kind: str) -> str:
    """Text whose `{definitions}` are links to their sections."""
    return re.sub(r"\{(\w+)\}", lambda m: _link(kind, m[1]), text)


if __name__ == "__main__":
    OUTPUT.write_text(page(), encoding="utf-8")

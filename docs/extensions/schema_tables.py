"""The directive `schema`: every key of a kind of file, from the schema that files are checked by.

`schema scenario` and `schema robot` make a section for each mapping that such a file may hold, and
in it a table of its keys: what is accepted, the unit, what is taken if the key is left out, and
what it means. A unit stands in brackets in a description in the schema.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

TITLES = {
    "Task": "The file",
    "TaskUnits": "units",
    "Tool": "tool",
    "Inertia": "inertia",
    "Surroundings": "scene",
    "SceneObject": "scene: objects",
    "OtherRobot": "scene: robots",
    "ToolShape": "tool: shape",
    "HeldObject": "tool: holds",
    "SolidOfRevolution": "cylinder, capsule, cone",
    "HalfSpace": "half_space",
    "PointCloud": "points of a shape",
    "Collisions": "collisions",
    "Frame": "frames",
    "FrameMotion": "moves of a frame",
    "Grid": "grid of a frame",
    "PoseWaypoint": "waypoints: pose",
    "PathWaypoint": "waypoints: along",
    "AlongArc": "along: arc",
    "Arc": "arc",
    "AlongPoints": "along: points",
    "Weave": "weave",
    "JointWaypoint": "waypoints: joints",
    "Repeat": "waypoints: repeat",
    "PlacesFile": "over: a file",
    "Action": "do",
    "Fastest": "after: fastest",
    "FreePose": "free",
    "FreePosition": "free: position",
    "AtMost": "speed: at_most",
    "ClearWay": "way: clear",
    "Pose": "pose",
    "SeamTorch": "torch",
    "Torch": "orientation along a path",
    "Placement": "offset",
    "Euler": "euler",
    "Velocity": "velocity",
    "Branch": "branch",
    "Balanced": "knots: balanced",
    "Weights": "objective",
    "ChosenSectionFields": "chosen",
    "EndAcceleration": "end_acceleration",
    "PlannerOptionFields": "planner_options",
    "Tolerances": "tolerances",
    "PathOptions": "path",
    "RobotFile": "The file",
    "ExternalAxis": "external_axes",
    "CollisionFields": "collision",
    "JointLimitFields": "limits",
    "Limits": "limits",
    "LinkSpeed": "frame_speed",
}
HEADER = ("key", "accepted", "unit", "left out", "meaning")
# Bounds that only keep nonsense out, which nobody needs to read about.
FAR_AWAY = 1e9


def schema_of(kind: str) -> dict[str, Any]:
    """The JSON Schema of scenario or robot files, the root among its definitions."""
    if kind == "scenario":
        from knotwork.task import Task as Model
    else:
        from knotwork.robot.robot_file import RobotFile as Model  # type: ignore[assignment]
    whole = Model.model_json_schema()
    found: dict[str, Any] = whole.pop("$defs", {})
    return {Model.__name__: whole, **found}


def order(definitions: dict[str, Any]) -> list[str]:
    """Names of the definitions in the order of the titles; all of them must have one."""
    missing = set(definitions) - set(TITLES)
    if missing:
        raise KeyError(f"no title for {', '.join(sorted(missing))} of the schema")
    return [name for name in TITLES if name in definitions]


def accepted(part: dict[str, Any]) -> str:
    """What a part of the schema accepts, in words; definitions as `{name}`."""
    if "$ref" in part:
        return "{" + str(part["$ref"]).rpartition("/")[2] + "}"
    for key in ("anyOf", "oneOf"):
        if key in part:
            words = [accepted(p) for p in part[key] if p.get("type") != "null"]
            return " or ".join(dict.fromkeys(words))
    if "const" in part:
        return f"`{json.dumps(part['const']).strip(chr(34))}`"
    if "enum" in part:
        return ", ".join(f"`{value}`" for value in part["enum"])
    return {
        "array": _array,
        "object": _mapping,
        "number": _number,
        "integer": lambda found: "whole " + _number(found),
        "boolean": lambda _: "`true` or `false`",
        "string": lambda _: "text",
    }[part["type"]](part)


def _many(words: str) -> str:
    """The plural of what accepts numbers."""
    words = re.sub(r"number$", "numbers", words)
    return re.sub(r"^(list|mapping) of", r"\1s of", words)


def _array(part: dict[str, Any]) -> str:
    items = accepted(part["items"] if "items" in part else part["prefixItems"][0])
    least, most = part.get("minItems", 0), part.get("maxItems")
    if most is not None:
        number = f"{most}" if least == most else f"{least} to {most}"
        return f"list of {number} {_many(items)}"
    more = f", {least} or more" if least else ""
    return f"list, each {items}{more}" if "{" in items else f"list of {_many(items)}{more}"


def _mapping(part: dict[str, Any]) -> str:
    inner = part.get("additionalProperties")
    if not isinstance(inner, dict):
        return "mapping"
    return f"mapping of names to {_many(accepted(inner))}"


def _number(part: dict[str, Any]) -> str:
    above, below = part.get("exclusiveMinimum"), part.get("exclusiveMaximum")
    least, most = part.get("minimum"), part.get("maximum")
    kind = "positive number" if above == 0 else "number"
    if most is not None and most < FAR_AWAY:
        return f"{kind} up to {most:g}"
    if below is not None and below < FAR_AWAY:
        return f"number between {above:g} and {below:g}" if above is not None else "number"
    return "number, not negative" if least == 0 else kind


def left_out(name: str, part: dict[str, Any], required: list[str]) -> str:
    """What leaving a key out means."""
    if name in required:
        return "needed"
    default = part.get("default")
    if default is None or isinstance(default, dict) or default == "":
        return "–"
    return f"`{json.dumps(default).strip(chr(34))}`"


def rows(definition: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """The rows of the table of one definition."""
    for name, part in definition["properties"].items():
        text = str(part.get("description", ""))
        found = re.search(r" \[([^\]]+)\]", text)
        unit = found[1].replace(" or ", ", ") if found else "–"
        text = text.replace(found[0], "", 1) if found else text
        if not text:
            raise KeyError(f"{definition['title']}.{name} has no description in the schema")
        yield (
            f"`{name}`",
            accepted(part),
            unit,
            left_out(name, part, definition.get("required", [])),
            text,
        )


class Schema(SphinxDirective):
    """Sections and tables of one kind of file."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Build them."""
        kind = self.arguments[0]
        definitions = schema_of(kind)
        return [self.section(kind, name, definitions[name]) for name in order(definitions)]

    def section(self, kind: str, name: str, definition: dict[str, Any]) -> nodes.Node:
        """The section of one definition."""
        title = TITLES[name]
        section = nodes.section(ids=[f"{kind}-{name.lower()}"], names=[f"{kind} {name}".lower()])
        code = re.fullmatch(r"[a-z_]+", title)
        section += nodes.title("", "", nodes.literal(title, title) if code else nodes.Text(title))
        about = str(definition.get("description", "")).split("\n\n")[0].replace("\n", " ")
        section += nodes.paragraph("", "", *_inline(about, kind))
        table = nodes.table(classes=["schema"])
        group = nodes.tgroup(cols=len(HEADER))
        table += group
        for width in (14, 26, 10, 12, 38):
            group += nodes.colspec(colwidth=width)
        head, body = nodes.thead(), nodes.tbody()
        head += self.row(HEADER, kind)
        for cells in rows(definition):
            body += self.row(cells, kind)
        group += head
        group += body
        section += nodes.container("", table, classes=["table-wrapper"])
        return section

    def row(self, cells: tuple[str, ...], kind: str) -> nodes.Node:
        """One row of a table."""
        row = nodes.row()
        for cell in cells:
            entry = nodes.entry(classes=["nothing"] if cell == "–" else [])
            entry += nodes.paragraph("", "", *_inline(cell, kind))
            row += entry
        return row


def _inline(text: str, kind: str) -> Iterator[nodes.Node]:
    """Text with `code` and {definitions}, which are links to their sections."""
    for part in re.split(r"(`[^`]+`|\{\w+\})", text):
        if part.startswith("`"):
            yield nodes.literal(part, part.strip("`"))
        elif part.startswith("{"):
            name = part.strip("{}")
            title = TITLES[name]
            code = re.fullmatch(r"[a-z_]+", title)
            shown = nodes.literal(title, title) if code else nodes.Text(title)
            yield nodes.reference("", "", shown, refuri=f"#{kind}-{name.lower()}", internal=True)
        elif part:
            yield nodes.Text(part)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("schema", Schema)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

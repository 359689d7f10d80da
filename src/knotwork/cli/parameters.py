"""Kinds of arguments that several commands take."""

from __future__ import annotations

from typing import Any

import click


class Knots(click.ParamType[Any]):
    """`paper`, `balanced`, `balanced:C` or knot times divided by commas."""

    name = "knots"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument; what it means is for the planner."""
        if value in ("paper", "balanced"):
            return value
        text = str(value).removeprefix("balanced:")
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            self.fail(
                f"{value!r} is not accepted; give paper, balanced, balanced:C with a constant C "
                "between 0 and 0.5, or the knot times in s divided by commas",
                param,
                ctx,
            )
        return numbers[0] if value != text and len(numbers) == 1 else numbers


class Names(click.ParamType[Any]):
    """Names divided by commas."""

    name = "names"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read the argument."""
        if isinstance(value, list):
            return value
        names = [part.strip() for part in str(value).split(",")]
        if not all(names):
            self.fail(f"{value!r} is not accepted; give names divided by commas", param, ctx)
        return names


planner_option = click.option(
    "--planner",
    metavar="NAME[:RULE]",
    help="Planner, in place of the scenario's; `knotwork planners` lists them and their rules.",
)
knots_option = click.option(
    "--knots",
    type=Knots(),
    metavar="KNOTS",
    help="paper, balanced, balanced:C, or knot times in s divided by commas; in place of the "
    "scenario's.",
)
json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON, and nothing else, on standard output."
)

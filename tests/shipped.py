"""Files of the robots and scenarios that Knotwork ships."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[1]

ROBOT_FILES = ROOT / "robots"
SCENARIO_FILES = {path.stem: path for path in sorted((ROOT / "scenarios").glob("*.yaml"))}
"""By the name that each is shipped under."""
LONG = {"ur10_palletise_24"}
"""Those that take seconds to plan."""
QUICK = [name for name in SCENARIO_FILES if name not in LONG]

"""The documentation builds without a warning, describes everything, and needs no network."""

from __future__ import annotations

import html
import importlib
import re
from collections.abc import Iterator
from inspect import isfunction
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from site_build import Site

from knotwork.files.documents import StrictModel
from knotwork.robot.robot_file import RobotFile
from knotwork.task import Task
from plans import planned

ROOT = Path(__file__).parents[2]
SHOWN_ONLY = {"bash", "matlab", "python", "yaml"}
PACKAGES = (
    "files.export",
    "files.foreign",
    "curves.interpolation",
    "robot.kinematics",
    "curves.polynomial",
    "robot",
    "task.scenario",
    "files.storage",
    "planning.sweeps",
    "task",
    "curves.tool_paths",
    "view",
    "verification",
)


def text_of(page: str) -> str:
    return html.unescape(re.sub(r"<[^>]+>", "", page))


@pytest.mark.exhaustive
def test_it_builds_without_a_warning(site: Site) -> None:
    assert site.code == 0, site.output
    printed = [line for line in site.output.splitlines() if "[IPKernelApp]" not in line]
    assert printed == []


@pytest.mark.exhaustive
def test_no_output_tells_of_a_fault(site: Site) -> None:
    for page in site.pages:
        words = text_of(page.read_text(encoding="utf-8"))
        assert "internal error:" not in words, page
        assert "Traceback (most" not in words, page


@pytest.mark.exhaustive
def test_no_description_is_python_s_own(site: Site) -> None:
    """What named tuples, unions and numbers say of themselves, and signatures not understood."""
    foreign = ("Alias for field", "PEP 604", "Convert a string or number", "&lt;factory&gt;")
    for page in site.pages:
        text = page.read_text(encoding="utf-8")
        assert not [words for words in foreign if words in text], page.name


def test_every_public_name_is_on_a_page() -> None:
    pages = "".join(page.read_text("utf-8") for page in (ROOT / "docs" / "api").glob("*.rst"))
    described = set(re.findall(r"^ *\.\. auto\w+:: ([\w.]+)", pages, re.MULTILINE))
    endings = {name.rpartition(".")[2] for name in described}
    top = importlib.import_module("knotwork").__all__
    assert {f"knotwork.{name}" for name in top} <= described
    for package in PACKAGES:
        module = importlib.import_module(f"knotwork.{package}")
        values = {name: getattr(module, name) for name in module.__all__}
        public = {name: one for name, one in values.items() if not isinstance(one, ModuleType)}
        # an old name of a function is described under the new one
        names = {one.__name__ if isfunction(one) else name for name, one in public.items()}
        assert names <= endings, package


def models(model: type[StrictModel]) -> Iterator[type[StrictModel]]:
    """A model and all that its fields are made of."""
    seen: list[Any] = []
    waiting: list[Any] = [model]
    while waiting:
        part = waiting.pop()
        waiting += getattr(part, "__args__", ())
        if isinstance(part, type) and issubclass(part, StrictModel) and part not in seen:
            seen.append(part)
            waiting += [field.annotation for field in part.model_fields.values()]
    return iter(seen)


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("page", "kind", "root"),
    [("scenario", "scenario", Task), ("robot_file", "robot", RobotFile)],
)
def test_file_keys_are_described(site: Site, page: str, kind: str, root: type[StrictModel]) -> None:
    content = site.page(page)
    for model in models(root):
        start = content.index(f'id="{kind}-{model.__name__.lower()}"')
        section = text_of(content[start : content.index("</section>", start)])
        for name, field in model.model_fields.items():
            key = field.validation_alias or name
            assert re.search(rf"^{key}$", section, re.MULTILINE), (model, name)
            if kind == "scenario" and model.__module__.startswith("knotwork.task"):
                described = f"<strong>{name}</strong> – {html.escape(str(field.description)[:9])}"
                assert described in site.page("api/tasks"), (model, name)


def test_every_example_is_shown() -> None:
    page = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"^```\{literalinclude\} \.\./examples/(.*)$", page, re.MULTILINE))
    assert shown == {path.name for path in (ROOT / "examples").glob("*.py")}


@pytest.mark.exhaustive
def test_the_equations_of_the_paper_are_there(site: Site) -> None:
    page = site.page("method")
    for number in (1, 2, 3, 4, 18, 23, 30, 31, 34, 39):
        part = page.split(f'id="equation-eq-{number}"')[1]
        assert part.index("<math") < part.index(f"({number})") < 6000
    assert not re.search(r"\\(frac|dot|left|begin|tfrac|ldots)", text_of(page))


@pytest.mark.exhaustive
def test_nothing_is_loaded_from_a_network(site: Site) -> None:
    loads = re.compile(
        r"""<(?:script|img|iframe|source)\b[^>]*\bsrc=["']?(?:https?:)?//"""
        r"""|<link\b[^>]*rel=["']?(?:stylesheet|preload|icon|preconnect)[^>]*(?:https?:)?//"""
    )
    for page in site.pages:
        assert not loads.search(page.read_text(encoding="utf-8")), page
    for sheet in (site.folder / "_static").rglob("*.css"):
        assert not re.search(r"@import|url\(['\"]?(?:https?:)?//", sheet.read_text()), sheet


def fences(language: str) -> list[str]:
    """What the pages show in a language without running it."""
    pages = sorted((ROOT / "docs").glob("*.md"))
    return [
        block
        for page in pages
        for block in re.findall(
            rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S
        )
    ]


def test_what_is_not_run_is_little() -> None:
    found = {
        language
        for page in (ROOT / "docs").glob("*.md")
        for language in re.findall(r"^```(\w+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert found <= SHOWN_ONLY


def test_the_recipe_for_ros2_names_what_is_exported() -> None:
    (recipe,) = [one for one in fences("bash") if one.startswith("ros2 ")]
    message, goal = recipe.replace("\\\n", "").strip().split("\n")
    assert " trajectory_msgs/msg/JointTrajectory " in message
    assert " control_msgs/action/FollowJointTrajectory " in goal


def test_the_recipe_for_matlab_names_what_is_in_the_file(tmp_path: Path) -> None:
    from scipy.io import loadmat

    (recipe,) = fences("matlab")
    path = planned("paper_case").trajectory.save_as("mat", tmp_path / "motion.mat")
    assert set(re.findall(r"\bs\.(\w+)", recipe)) == {"breaks", "coefs", "d"} <= set(loadmat(path))

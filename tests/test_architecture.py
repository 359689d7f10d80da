"""The import table of docs/design.md, held true by walking the syntax trees."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pytest

from command_line import python
from public_names import documented
from syntax_trees import FILES, ROOT, SOURCE, tree_of

OLD_NAMES = SOURCE / "errors" / "old_names.py"
ENTRANCES = {"__init__", "__main__"}
DRAWING = ("scipy", "matplotlib", "meshcat", "collada", "trimesh", "casadi")


MAP = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
INNER = set(re.findall(r"^\| `(\w+/\w+)/` \|", MAP, re.MULTILINE))


def table() -> dict[str, set[str]]:
    """The parts that each part may import, in the order of the document."""
    rows = re.findall(r"^\| `(?:\w+/)?(\w+)(?:\.py|/)` \|.*\|([^|]*)\|$", MAP, re.MULTILINE)
    allowed: dict[str, set[str]] = {}
    for part, cell in rows:
        excluded = set(filter(None, cell.strip().split(", ")))
        assert excluded <= allowed.keys(), part
        allowed[part] = set(allowed) - excluded
    return allowed


TABLE = table()
CALLS_UP = {
    ("exportable", "'knotwork.files.export'"),
    ("other_robots", "'knotwork.planning'"),
    ("other_robots", "'knotwork.verification.collisions'"),
    ("other_robots", "'knotwork.verification.motion'"),
    ("robot", "'knotwork.robot.kinematics'"),
}
"""The calls that go up, as the document says: the file of each, and what it imports by name."""


def part_named(names: Sequence[str]) -> str:
    """Part of a dotted name: the inner package where that has a row of its own."""
    return names[1] if "/".join(names[:2]) in INNER else names[0]


def part_of(path: Path) -> str:
    names = path.relative_to(SOURCE).with_suffix("").parts
    if names[-1] == "__init__" and names[0] not in TABLE and len(names) == 2:
        return "__init__"  # of packages that only hold others
    return part_named(names)


def imports(tree: ast.AST) -> Iterator[str]:
    """Dotted names of everything imported, at any depth, for types only or not."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide what they import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_only_some_calls_go_up_and_import_by_name() -> None:
    found = {
        (path.stem, ast.unparse(node.args[0]))
        for path in FILES
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Call) and "import_module" in vars(node.func).values()
        if isinstance(node.args[0], ast.Constant)
    }
    assert found == CALLS_UP


def own_parts(path: Path) -> set[str]:
    """Parts of Knotwork that a file imports; with the whole package all of them."""
    names = [name.split(".") for name in imports(tree_of(path))]
    parts = {part_named(name[1:]) for name in names if name[0] == "knotwork" and len(name) > 1}
    return {*parts, *TABLE} if ["knotwork"] in names else parts


def packages(tree: ast.AST) -> set[str]:
    return {name.split(".")[0] for name in imports(tree)}


def test_the_table_lists_every_part_and_no_other() -> None:
    assert {part_of(path) for path in FILES} - ENTRANCES == set(TABLE)


def module_imports(path: Path, modules: Mapping[str, Path]) -> set[str]:
    """Modules of Knotwork that a file imports anywhere: in functions and for types, too."""
    found = set()
    for name in imports(tree_of(path)):
        while name and name not in modules:  # of a class or function, its module
            name = name.rpartition(".")[0]
        found.add(name)
    return found - {""}


def test_no_modules_import_each_other() -> None:
    """No way leads from a module's imports back to it; neither by imports that run late.

    The lazy names of packages are found at run time and are no imports here: a package may offer
    what its own modules define.
    """
    modules = {
        ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts).removesuffix(
            ".__init__"
        ): path
        for path in FILES
    }
    waiting = {name: module_imports(path, modules) - {name} for name, path in modules.items()}
    # What imports nothing that is left is in no cycle.
    while free := {name for name, needed in waiting.items() if not needed & waiting.keys()}:
        waiting = {name: needed for name, needed in waiting.items() if name not in free}
    # Nor is what nothing left imports.
    while waiting.keys() - set().union(*waiting.values()):
        imported = set().union(*waiting.values())
        waiting = {name: needed for name, needed in waiting.items() if name in imported}
    assert not waiting, f"these import each other: {', '.join(waiting)}"


def test_files_import_what_the_table_allows() -> None:
    for path in FILES:
        part = part_of(path)
        if part not in ENTRANCES:
            assert own_parts(path) - {"__version__"} <= TABLE[part] | {part}, path


def test_imports_load_only_what_is_used() -> None:
    for path in FILES:
        if path.parent != SOURCE or part_of(path) not in ENTRANCES:
            continue
        tree = tree_of(path)
        top = ast.Module([node for node in tree.body if not isinstance(node, ast.If)], [])
        loaded = {name for name in imports(top) if name.startswith("knotwork")}
        entered = ("cli.main.main", "errors.old_names.with_old_names")
        assert loaded <= {f"knotwork.{name}" for name in entered}


def reached_from(part: str) -> set[str]:
    """A part, those that it imports, and those that these import."""
    found, new = set[str](), {part}
    while new:
        found |= new
        new = set().union(*(own_parts(path) for path in FILES if part_of(path) in new)) - found
    return found


@pytest.mark.parametrize(
    "part", ["polynomial", "trajectory", "storage", "interpolation", "retiming"]
)
def test_curves_know_no_robot(part: str) -> None:
    assert not reached_from(part) & {"robot", "kinematics", "scenario", "verification"}
    for path in FILES:
        if part_of(path) == part:
            assert not packages(tree_of(path)) & {"pinocchio", "eigenpy", "coal"}, path


def test_verification_does_not_know_how_motions_are_made() -> None:
    """Neither itself nor anything that it may import."""
    makers = {"kinematics", "task_to_joint", "interpolation", "planning", "timing", "clear_motions"}
    assert makers <= TABLE.keys()
    assert not TABLE["verification"] & makers


def test_only_the_command_line_prints() -> None:
    for path in FILES:
        if part_of(path) == "cli":
            continue
        tree = tree_of(path)
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in ("print", "sys.stdout.write", "sys.stderr.write"), path
                # Old names warn whoever writes the program, nothing else does.
                assert called != "warnings.warn" or path == OLD_NAMES, path
        assert not packages(tree) & {"rich", "click", "logging"}, path


def run_at_import(node: ast.AST) -> Iterator[ast.AST]:
    """What runs when a module is imported: all but functions, and blocks for types alone."""
    yield node
    for inner in ast.iter_child_nodes(node):
        if not isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from run_at_import(inner)


def test_modules_and_functions_are_short() -> None:
    for path in FILES:
        assert path.read_text(encoding="utf-8").count("\n") <= 350, path
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.FunctionDef):
                assert (node.end_lineno or 0) - node.lineno < 60, (path, node.name)


def test_what_is_slow_to_import_is_imported_where_it_is_used() -> None:
    for path in FILES:
        top = [node for node in tree_of(path).body if not isinstance(node, ast.If)]
        for node in run_at_import(ast.Module(top, [])):
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert not packages(node) & set(DRAWING), path


# All else is tested through names that docs/api describes and through the command, so that inner
# modules may change. Those below tests may import, for a reason.
IMPORTED_BY_TESTS = {
    "mathematics that is formulated again, independently": (
        "robot.kinematics.chain",
        "robot.kinematics.following.joints_on_path",
        "robot.kinematics.geometry",
        "robot.kinematics.sequence",
        "robot.kinematics.solutions",
        "curves.polynomial.extended_curve",
        "curves.retiming",
        "robot.joint_axes",
        "robot.joint_tree",
        "scene",
        "verification.bounds",
        "view.curves",
        "planning.clear_motions.configuration_space",
    ),
    "files of a format: what is written is what is read, for any content": (
        "files.documents",
        "scene.meshes.mesh_files",
    ),
    "keys of files: each has its test and its line in the docs": (
        "robot.robot_file",
        "task.si_units",
    ),
    "a path that can't be followed at first": ("planning.choosing.solved_scenario",),
    "what a page asks for, without the page: handles, plans that are overtaken": ("view.editing",),
    "a clock of the test's own": (
        "planning.planning",
        "planning.choosing.chosen_values",
        "planning.timing.budget",
    ),
    "a function that a test replaces by a wrong, a watched or a quick one": (
        "planning.speed_override.approximate_by_cubics",
        "robot.kinematics.following.ladder.Ladder.find_guided_starts",
        "view.html_report.plot_",
    ),
    "headings of reports, of which shipped checks use no others": ("verification.finding.Group",),
    "the command in this process": ("cli.main",),
    "the plugin, by the name that pytest gets": ("pytest_plugin",),
    "the text that shows progress, without a clock": ("cli.progress_display",),
}


def names_in_strings(tree: ast.AST) -> Iterator[str]:
    """Dotted names of Knotwork that are text, such as those that `monkeypatch` gets.

    Constants are left out: with small ones, tests reach limits that take long otherwise.
    """
    parts = {path.relative_to(SOURCE).with_suffix("").parts[0] for path in FILES}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = re.fullmatch(r"knotwork\.(\w+)(\.\w+)*", node.value)
            if found and found[1] in parts and not node.value.rpartition(".")[2].isupper():
                yield node.value


def test_tests_import_what_users_have() -> None:
    names = documented()
    public = {name.rpartition(".")[0] for name in names}
    endings = {name.rpartition(".")[2] for name in names}
    inner = tuple(f"knotwork.{one}" for ones in IMPORTED_BY_TESTS.values() for one in ones)
    used = set()
    for path in sorted((ROOT / "tests").rglob("*.py")):
        for name in {*imports(tree_of(path)), *names_in_strings(tree_of(path))}:
            module, _, last = name.rpartition(".")
            if not name.startswith("knotwork.") or name in public:
                continue
            reason = [one for one in inner if f"{name}.".startswith(f"{one}.")]
            used |= set(reason)
            relied_on = module in public and last in endings
            assert relied_on or reason or name == "knotwork.__version__", f"{path}: {name}"
    assert used == set(inner), "not imported any more"


ROOT_FILES = {".gitignore", "CHANGELOG.md", "LICENSE", "Makefile", "README.md", "SECURITY.md"}
ROOT_FILES |= {"constraints.txt", "pyproject.toml"}
FOLDERS = {".ci", "benchmarks", "docs", "examples", "robots", "scenarios", "src", "tests"}


def test_no_results_are_committed() -> None:
    """The root has no files that examples write, nor folders of them."""
    if not (ROOT / ".git").exists():
        pytest.skip("no repository: an unpacked archive")
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert {
        name.partition("/")[0] for name in listed.stdout.split("\n")[:-1]
    } == ROOT_FILES | FOLDERS


def test_user_input_is_not_asserted() -> None:
    for path in FILES:
        found = [node.lineno for node in ast.walk(tree_of(path)) if isinstance(node, ast.Assert)]
        assert not found, path


COMMAND = """import sys; sys.argv = ['knotwork', {}]
from knotwork.cli.main import main
try: main()
except SystemExit as stopped: assert stopped.code == 0"""


def loaded_after(code: str, *, whole: bool = False) -> set[str]:
    """Top-level modules, or all by their whole names, of a fresh Python that has run some code."""
    ran = python("-c", f"{code}\nimport sys; print('\\n'.join(sys.modules), file=sys.stderr)")
    assert ran.returncode == 0, ran.stderr
    return {name if whole else name.split(".")[0] for name in ran.stderr.split()}


def test_importing_knotwork_loads_next_to_nothing() -> None:
    loaded = loaded_after("import knotwork; assert knotwork.__version__")
    assert "knotwork" in loaded
    assert not loaded & {*DRAWING, "pinocchio", "numpy", "pydantic", "yaml", "rich", "click"}


@pytest.mark.parametrize("name", ["interpolation", "kinematics", "sweeps", "timing", "tool_paths"])
def test_packages_are_attributes_before_anything_else_loads_them(name: str) -> None:
    assert loaded_after(f"import knotwork; knotwork.{name}")


def test_splines_load_no_robot_and_no_files() -> None:
    loaded = loaded_after(
        "import knotwork as kw\n"
        "spline = kw.ModifiedHermiteSpline([0, 1, 2], [0, 1, 0], [0, 0.5, 0])\n"
        "assert abs(spline(1.0) - 1.0) < 1e-12\n"
        "assert kw.JointTrajectory and kw.interpolation.get_planner('cubic')"
    )
    assert "numpy" in loaded
    assert not loaded & {*DRAWING, "pinocchio", "pydantic", "yaml", "rich", "click"}


def test_joints_alone_are_planned_without_pinocchio() -> None:
    loaded = loaded_after(
        "import knotwork as kw\n"
        "ends = [{'joints': {'a': 0}}, {'joints': {'a': 1}, 'after': 1}]\n"
        "assert kw.plan({'waypoints': ends}).report.ok"
    )
    assert "pydantic" in loaded
    assert not loaded & {*DRAWING, "pinocchio"}


def test_drawing_never_loads_pyplot(tmp_path: Path) -> None:
    loaded = loaded_after(
        "import sys, knotwork as kw\n"
        "from knotwork import view\n"
        "assert 'matplotlib' not in sys.modules\n"
        f"view.save_figure(view.plot_joints(kw.plan('paper_case')), {str(tmp_path / 'a.png')!r})",
        whole=True,
    )
    assert "matplotlib" in loaded
    assert "matplotlib.pyplot" not in loaded


def test_a_plan_loads_what_it_uses_and_nothing_more() -> None:
    loaded = loaded_after(COMMAND.format("'plan', 'ur5_deburring'"), whole=True)
    assert "pinocchio" in loaded
    for name in (*DRAWING, "rich", "difflib", "html", "xml.etree", "numpy.ma", "numpy.polynomial"):
        assert name not in loaded
    unused = (
        "cli.export",
        "cli.sweep",
        "files.storage.atomic_files",
        "robot.kinematics.solutions.diagnosis",
    )
    unused += ("robot.kinematics.solutions.pose", "planning.choosing")
    assert not loaded & {f"knotwork.{name}" for name in unused}


def test_help_loads_no_command() -> None:
    loaded = loaded_after(COMMAND.format("'--help'"), whole=True)
    assert {name for name in loaded if name.startswith("knotwork.cli.")} == {
        f"knotwork.cli.{name}" for name in ("main", "parameters", "terminal")
    }
    assert not loaded & {"numpy", "pydantic", "yaml", "rich"}


# Names of the standard library that the lowest supported Python, 3.10, has not.
NEW_NAMES = {"enum.StrEnum", "enum.verify", "typing.Self", "typing.assert_never", "typing.override"}
NEW_NAMES |= {"datetime.UTC", "itertools.batched", "contextlib.chdir", "hashlib.file_digest"}
NEW_MODULES = {"tomllib"}


def test_lowest_python_has_imported_names() -> None:
    for path in FILES:
        tree = tree_of(path)
        assert not set(imports(tree)) & NEW_NAMES, path
        assert not packages(tree) & NEW_MODULES, path

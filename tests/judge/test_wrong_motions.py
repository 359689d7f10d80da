"""No wrong motion passes: 10,000 of them, each with one fault, confirmed wrong by the judge first.

The judge shares nothing with Knotwork. Every fault begins with a right motion, which both let pass.
Half of the motions of joints are disguised: breaks next to breaks, and leading zeros.
"""

from __future__ import annotations

import ast
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import python
from judge import faults_of_bodies, faults_of_joints, faults_of_paths
from judge.cases import Case, Fault, Shelf, disguised, joint_case
from judge.task import Task
from judge.verdict import judge

FAULTS: dict[str, Fault] = {
    **faults_of_joints.FAULTS,
    **faults_of_paths.FAULTS,
    **faults_of_bodies.FAULTS,
}
ALL, PARTS, ORDINARY = 10_000, 20, 1
RIGHT = 20
"""Of so many right cases one is judged and checked as well."""
Record = Callable[[str, object], None]


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Shelf:
    return Shelf(tmp_path_factory.mktemp("judge"))


def checked(case: Case, task: Task) -> str:
    """What Knotwork's check says: `passes`, or what it fails for, or why it refuses the task."""
    curve = kw.PiecewisePolynomial(case.motion.c, case.motion.x)
    motion = kw.JointTrajectory(case.motion.names, curve, joint_units=task.units)
    try:
        report = kw.check(motion, kw.load_scenario(case.data))
    except kw.InputError as error:
        return f"refused: {error}"
    except Exception as error:
        return f"crashed: {type(error).__name__}: {error}"
    return "passes" if report.ok else str(report.failures[0])


def tried(name: str, seed: int, shelf: Shelf, *, right: bool) -> list[str]:
    """Make one wrong motion, and the right one before it; what is not as it must be."""
    fault = FAULTS[name]
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    case, disguise = fault.right(rng, shelf), fault.right is joint_case and rng.random() < 0.5
    plain, found = case, []
    if disguise:
        case = case.with_motion(disguised(case.motion, rng))
    if right:
        task = Task(case.data, shelf.folder)
        wrongs = judge(task, case.motion, samples=fault.samples)
        if wrongs:
            found.append(f"the judge finds in the right motion: {wrongs[0]}")
        verdict = checked(case, task)
        if verdict != "passes":
            found.append(f"the check of the right motion: {verdict}")
    case = fault.spoil(plain, rng, shelf)
    if disguise:
        case = case.with_motion(disguised(case.motion, rng))
    task = Task(case.data, shelf.folder)
    wrongs = judge(task, case.motion, samples=fault.samples, collisions=fault.collisions)
    kinds = {wrong.kind for wrong in wrongs}.difference(fault.beside)
    if not kinds or not kinds <= fault.kinds:
        found.append(f"the judge finds {sorted(kinds)}, not only {sorted(fault.kinds)}")
    verdict = checked(case, task)
    if verdict == "passes" or verdict.startswith(("crashed", "refused")):
        found.append(f"wrong ({wrongs[0] if wrongs else 'unknown'}), and the check: {verdict}")
    return [f"{name}, seed {seed}: {finding}" for finding in found]


def all_of(seeds: Callable[[Fault], Iterable[int]], shelf: Shelf, record: Record) -> list[str]:
    """What is not as it must be, of all faults."""
    found = []
    for name, fault in FAULTS.items():
        own: list[str] = []
        count = 0
        for seed in seeds(fault):
            count += 1
            own += tried(name, seed, shelf, right=seed % RIGHT == 0)
        record(f"wrong motions: {name}", [count, sum("the check: passes" in one for one in own)])
        found += own
    return found


def ordinary(fault: Fault) -> range:
    """Those of bare joints take milliseconds."""
    return range(8 if fault.right is joint_case else ORDINARY)


def test_ten_thousand_are_made() -> None:
    assert sum(fault.count for fault in FAULTS.values()) == ALL


def test_no_wrong_motion_passes(shelf: Shelf, record_property: Record) -> None:
    found = all_of(ordinary, shelf, record_property)
    assert not found, "\n".join(found)


@pytest.mark.exhaustive
@pytest.mark.parametrize("part", range(PARTS))
def test_ten_thousand_wrong_motions_fail(part: int, shelf: Shelf, record_property: Record) -> None:
    found = all_of(lambda fault: range(part, fault.count, PARTS), shelf, record_property)
    assert not found, "\n".join(found)


HERE = Path(__file__).parent
TAKEN = {
    "plan",
    "Plan",
    "check",
    "load_scenario",
    "JointTrajectory",
    "PiecewisePolynomial",
    "InputError",
}


def test_the_judge_shares_nothing_with_knotwork() -> None:
    """No module of it imports Knotwork, and its tests take no more than plans and verdicts."""
    modules = [path.stem for path in HERE.glob("*.py") if not path.stem.startswith("test_")]
    names = ", ".join(f"judge.{name}" for name in modules)
    code = f"import sys, {names}; print([n for n in sys.modules if n.startswith('knotwork')])"
    ran = python("-c", code, cwd=HERE.parent, check=True)
    assert ran.stdout.strip() == "[]"
    for path in HERE.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                assert (node.module or "").split(".")[0] != "knotwork", path
            elif isinstance(node, ast.Import):
                own = [name for name in node.names if name.name.split(".")[0] == "knotwork"]
                assert not own or path.stem.startswith("test_"), path
                assert all(name.name == "knotwork" and name.asname == "kw" for name in own)
            elif isinstance(node, ast.Attribute) and ast.unparse(node.value) == "kw":
                assert node.attr in TAKEN, f"{path}: kw.{node.attr}"

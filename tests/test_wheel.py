"""The wheel, installed into a clean environment and run from an empty folder, without a network."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path
from typing import Any

import pytest

from command_line import process

# Building, installing and running a wheel takes long, and what is in it seldom changes.
pytestmark = pytest.mark.exhaustive

ROOT = Path(__file__).parents[1]
BIN = "Scripts" if os.name == "nt" else "bin"


def run(*arguments: Any, cwd: Path) -> subprocess.CompletedProcess[str]:
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    own = {**clean, "PIP_NO_INDEX": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    return process(*arguments, cwd=cwd, env=own)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    ran = run(
        sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, cwd=ROOT
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment with the wheel in it, and its dependencies lent from here."""
    folder = tmp_path_factory.mktemp("clean")
    venv.EnvBuilder(with_pip=False, symlinks=os.name != "nt").create(folder)
    executable = folder / BIN / "python"
    ran = run(
        *(sys.executable, "-m", "pip", "--python", executable),
        *("install", "--quiet", "--no-index", "--no-deps", wheel),
        cwd=folder,
    )
    assert ran.returncode == 0, ran.stderr
    # A folder named in a .pth file is only put on the path: .pth files in it, such as that of an
    # editable install of Knotwork itself, do nothing.
    packages = Path(sysconfig.get_path("purelib"))
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    lent = [packages, packages / "cmeel.prefix" / "lib" / version / "site-packages"]
    own = run(
        executable, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder
    ).stdout.strip()
    Path(own, "lent.pth").write_text("\n".join(map(str, lent)) + "\n")
    where = run(executable, "-c", "import knotwork; print(knotwork.__file__)", cwd=folder)
    assert Path(where.stdout.strip()).is_relative_to(folder.resolve()), where.stdout + where.stderr
    return executable


def test_robots_and_scenarios_are_in_the_wheel(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    for kind in ("robots", "scenarios"):
        inside = {Path(name).name for name in names if name.startswith(f"knotwork/_data/{kind}/")}
        assert inside == {path.name for path in (ROOT / kind).iterdir() if path.is_file()}
    assert "knotwork/py.typed" in names
    assert not [name for name in names if name.startswith(("tests", "docs", "benchmarks"))]


def test_the_command_plans_a_shipped_scenario(python: Path, tmp_path: Path) -> None:
    ran = run(python.parent / "knotwork", "plan", "ur5_deburring", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert "PASSED ur5_deburring" in ran.stdout
    assert not list(tmp_path.iterdir())

"""The documentation, built once for all tests and workers."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest
from site_build import Site, build

DOCS = Path(__file__).parents[2] / "docs"
# References, tables of keys and descriptions are as in the whole site.
NOTHING_RUN = ("-D", "shown_run=0", "-D", "nb_execution_mode=off")


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    """The site without running what it shows, which takes a quarter of the time."""
    return built_once(tmp_path_factory, "site", *NOTHING_RUN)


@pytest.fixture(scope="session")
def whole_site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    """The site as it is published."""
    return built_once(tmp_path_factory, "whole-site")


def built_once(paths: pytest.TempPathFactory, name: str, *options: str) -> Site:
    """A site; the first worker that asks builds it, the others wait."""
    pytest.importorskip("sphinx", reason="the documentation needs Python 3.11 or newer")
    base = paths.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, verdict = shared / name, shared / f"{name}-verdict"
    with (shared / f"{name}-lock").open("w") as lock:  # it ends with the process that has it
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not verdict.exists():
            built = build(DOCS, folder, *options)
            verdict.write_text(f"{built.code}\n{built.said}", encoding="utf-8")
    code, _, said = verdict.read_text(encoding="utf-8").partition("\n")
    return Site(folder, int(code), said)


@pytest.fixture
def extensions(monkeypatch: pytest.MonkeyPatch) -> None:
    """The documentation's own extensions, importable."""
    pytest.importorskip("sphinx", reason="the documentation needs Python 3.11 or newer")
    monkeypatch.syspath_prepend(str(DOCS / "extensions"))

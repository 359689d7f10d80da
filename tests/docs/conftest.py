"""The documentation, built once for all tests and workers."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest
from site_build import Site, build

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    """The site as it is published; the first worker that asks builds it, the others wait."""
    pytest.importorskip("sphinx", reason="the documentation needs Python 3.11 or newer")
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, verdict = shared / "site", shared / "site-verdict"
    with (shared / "site-lock").open("w") as lock:  # it ends with the process that has it
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not verdict.exists():
            built = build(DOCS, folder)
            verdict.write_text(f"{built.code}\n{built.output}", encoding="utf-8")
    code, _, output = verdict.read_text(encoding="utf-8").partition("\n")
    return Site(folder, int(code), output)


@pytest.fixture
def extensions(monkeypatch: pytest.MonkeyPatch) -> None:
    """The documentation's own extensions, importable."""
    pytest.importorskip("sphinx", reason="the documentation needs Python 3.11 or newer")
    monkeypatch.syspath_prepend(str(DOCS / "extensions"))

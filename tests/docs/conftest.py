"""The documentation, built once for all tests and workers."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from site_build import Site, build

DOCS = Path(__file__).parents[2] / "docs"
PATIENCE = 300.0  # for another worker's build [s]
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
    try:
        (shared / f"{name}-begun").mkdir()
    except FileExistsError:
        until = time.monotonic() + PATIENCE
        while not verdict.exists():
            if time.monotonic() > until:
                pytest.fail("another worker has not finished building the documentation")
            time.sleep(0.2)
        code, _, said = verdict.read_text(encoding="utf-8").partition("\n")
        return Site(folder, int(code), said)
    built = build(DOCS, folder, *options)
    partial = verdict.with_suffix(".part")
    partial.write_text(f"{built.code}\n{built.said}", encoding="utf-8")
    partial.rename(verdict)
    return built


@pytest.fixture
def extensions(monkeypatch: pytest.MonkeyPatch) -> None:
    """The documentation's own extensions, importable."""
    pytest.importorskip("sphinx", reason="the documentation needs Python 3.11 or newer")
    monkeypatch.syspath_prepend(str(DOCS / "extensions"))

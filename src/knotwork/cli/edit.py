"""The command `knotwork edit`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from knotwork.cli.live_view import WatchedFiles, serve_live
from knotwork.cli.parameters import (
    NonEmptyPath,
    budget_option,
    exit_codes,
    no_open_option,
    package_path_option,
    port_option,
)
from knotwork.cli.terminal import echo, offered
from knotwork.cli.view import source_files
from knotwork.errors import InputError
from knotwork.files.documents import resources
from knotwork.view.editing.draft import Draft
from knotwork.view.editing.session import Session, draft_of

_EDIT_EPILOG = """
In the page, click a waypoint, via point or object, then drag it, turn it or enter numbers;
the task is planned again after each change. Ctrl+Z undoes an edit, Ctrl+S saves.

"""


class _WatchedDraft(WatchedFiles):
    """The files that a draft names, its own file, and the draft itself."""

    def __init__(self, draft: Draft) -> None:
        super().__init__(())
        self._draft, self._own, self._seen = draft, WatchedFiles([draft.file]), draft.revision

    def take_change(self) -> bool:
        """Return whether the draft, its file or a file named in it was changed since the last call.

        A change of the draft's file is read into the draft.
        """
        if self._own.take_change():
            try:
                self._draft.reread()
            except InputError as error:
                echo(f"error: {error}", err=True)
        seen, self._seen = self._seen, self._draft.revision
        return super().take_change() or seen != self._seen


@click.command(epilog=_EDIT_EPILOG + exit_codes("after Ctrl-C", ""))
@click.option(
    "--copy",
    "copy",
    metavar="FILE",
    type=NonEmptyPath(path_type=Path),
    help="Edit a copy, which is written to this file. A shipped scenario requires it.",
)
@no_open_option
@port_option
@package_path_option
@budget_option
@click.argument("scenario", metavar="SCENARIO")
def edit(
    scenario: str, copy: Path | None, budget: float | None, no_open: bool, port: int | None
) -> None:
    """Edit a scenario by hand, in a page that shows its motion.

    Each edit is planned and checked. Saving writes the file and keeps its comments.

    The page is served until Ctrl-C, on this machine only, to anyone with the address and its
    token.
    """
    if copy is None and scenario in resources.names("scenarios"):
        raise InputError(
            f"{scenario} is a shipped scenario and can't be changed; give a copy to edit "
            f"with --copy, such as --copy {scenario}.yaml"
        )
    session = Session(draft_of(resources.find("scenarios", scenario), copy), port or 0, budget)
    draft, server = session.draft, session.server
    files = _WatchedDraft(draft)

    def build() -> tuple[dict[str, Any], list[Path], str] | None:
        planned = session.replan()
        if planned is None:
            return None
        scene, plan = planned
        verdict = "passed" if plan.report.ok else "FAILED"
        others = [path for path in source_files(plan) if path != draft.file]
        return scene, others, f"{verdict}: {plan.report.summary}"

    with server, offered(server.address, f"editing {draft.file}", no_open):
        serve_live(server, files, build)

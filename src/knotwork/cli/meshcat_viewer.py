"""`knotwork view --meshcat`: an existing Meshcat server, or a new one."""

from __future__ import annotations

import contextlib
import io
import re
import socket
import time
from collections.abc import Iterator
from typing import Any

from knotwork.cli.terminal import echo, offer
from knotwork.errors import InputError
from knotwork.view.meshcat_player import play_scene
from knotwork.view.scene_data import scene_of

OWN = "own"
"""Stands for a new server, which ends with the command, in place of an address."""

# Servers answer at once, or within a second or so while they receive large meshes [s].
PATIENCE = 10.0


def play_in_meshcat(motion: Any, address: str, no_open: bool) -> None:
    """Play a plan in a Meshcat viewer; with a new server until Ctrl-C.

    Args:
        motion: A plan, or a checked file.
        address: The server's ZMQ address, or `OWN`.
        no_open: Do not open a browser.

    Raises:
        InputError: The server does not answer, or the motion can't be shown.
    """
    scene = scene_of(motion)
    for warning in scene["warnings"]:
        echo(f"warning: {warning}", err=True)
    if address != OWN:
        with _answering(address):
            viewer = _viewer(address)
            play_scene(scene, viewer)
        echo(f"playing {scene['title']} at {viewer.url()}")
        return
    viewer = _viewer()
    play_scene(scene, viewer)
    offer(viewer.url(), f"playing {scene['title']} at {viewer.url()}", no_open)
    try:
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        echo("stopped")


def _viewer(address: str | None = None) -> Any:
    import meshcat

    with contextlib.redirect_stdout(io.StringIO()):  # Meshcat prints its address
        return meshcat.Visualizer(zmq_url=address)


@contextlib.contextmanager
def _answering(address: str) -> Iterator[None]:
    """Connect to the Meshcat server at a ZMQ address, with a time limit.

    Raises:
        InputError: No server is at the address, or it does not answer.
    """
    match = re.fullmatch(r"tcp://([^:/]+|\[[^\]]+\]):(\d{1,5})/?", address)
    if match is None:
        raise InputError(
            f"--meshcat {address}: not the ZMQ address of a Meshcat server; accepted: for example "
            "tcp://127.0.0.1:6000, which meshcat-server prints as zmq_url (give the scenario "
            "before --meshcat where no address follows)"
        )
    import zmq
    from meshcat.visualizer import ViewerWindow

    ViewerWindow.context.setsockopt(zmq.RCVTIMEO, round(1e3 * PATIENCE))
    ViewerWindow.context.setsockopt(zmq.LINGER, 0)
    try:
        socket.create_connection((match[1].strip("[]"), int(match[2])), PATIENCE).close()
        with ViewerWindow.context.socket(zmq.REQ) as asked:
            asked.connect(address)
            asked.send(b"url")
            asked.recv()
        yield
    except (OSError, OverflowError, zmq.ZMQError) as error:
        silent = isinstance(error, (TimeoutError, zmq.Again))
        raise InputError(
            f"--meshcat {address}: no Meshcat server answers there"
            f"{f' within {PATIENCE:g} s' if silent else ''}; start one with meshcat-server, or "
            "leave the address out to start one for this command"
        ) from error

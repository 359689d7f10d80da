"""The server of `knotwork view`, and browsers that break off."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from http.client import HTTPConnection

import pytest

from command_line import without_progress
from patience import PATIENCE

HOST = "127.0.0.1"


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Port of a page; whatever browsers do, nothing but the end is said."""
    command = [sys.executable, "-u", "-m", "knotwork", "view", "planar2_closed_form", "--no-open"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ)
    ) as process:
        assert process.stdout is not None
        address = process.stdout.readline().split(" at ")[1].split()[0]
        yield int(address.rsplit(":")[-1].strip("/"))
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    assert out == "stopped\n"
    assert not without_progress(err)


def test_a_connection_that_breaks_off_is_passed_over(port: int) -> None:
    for _ in range(3):
        client = socket.create_connection((HOST, port))
        client.sendall(b"GET / HTTP/1.0\r\n\r\n")
        client.recv(10)
        # close with a reset, as a browser does that is closed in the middle of a page
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.close()
    with urllib.request.urlopen(f"http://{HOST}:{port}/") as answer:  # and it still answers
        assert b"</html>" in answer.read()[-20:]


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:{}", 200),
        ("localhost:{}", 200),
        ("LOCALHOST:8000", 200),  # as where a port is forwarded
        ("[::1]:{}", 200),
        ("localhost", 200),
        ("evil.example:{}", 421),
        ("evil.example", 421),
        ("127.0.0.1.evil.example:{}", 421),
        ("localhost:{}.evil.example", 421),
        ("", 421),
    ],
)
def test_only_its_own_names_are_answered(host: str, status: int, port: int) -> None:
    """A stranger's page may give its own name this machine's address, and read what is answered."""
    for method in ("GET", "HEAD"):
        client = HTTPConnection(HOST, port)
        client.request(method, "/", headers={"Host": host.format(port)})
        answer = client.getresponse()
        assert answer.status == status
        content = answer.read()
        assert (b"planar2_closed_form" in content) == (status == 200 and method == "GET")
        assert int(answer.headers["Content-Length"]) > 0
        client.close()

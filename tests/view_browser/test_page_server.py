"""The page's server, and browsers that break off."""

from __future__ import annotations

import socket
import struct
import threading
import urllib.request
from http.client import HTTPConnection

import pytest

from knotwork.view.server import HOST, PageServer


def test_a_connection_that_breaks_off_is_passed_over(capfd: pytest.CaptureFixture[str]) -> None:
    page = "<p>" + "x" * 5_000_000
    with PageServer(page) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        for _ in range(3):
            client = socket.create_connection((HOST, server.server_port))
            client.sendall(b"GET / HTTP/1.0\r\n\r\n")
            client.recv(10)
            # close with a reset, as a browser does that is closed in the middle of a page
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.close()
        with urllib.request.urlopen(server.address) as answer:  # and it still answers
            assert answer.read().decode() == page
        server.shutdown()
        thread.join(10)
    said = capfd.readouterr()
    assert "Traceback" not in said.err
    assert "Exception" not in said.err


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
def test_only_its_own_names_are_answered(host: str, status: int) -> None:
    """A stranger's page may give its own name this machine's address, and read what is answered."""
    with PageServer("<p>secret") as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        for method in ("GET", "HEAD"):
            client = HTTPConnection(HOST, server.server_port)
            client.request(method, "/", headers={"Host": host.format(server.server_port)})
            answer = client.getresponse()
            assert answer.status == status
            content = answer.read()
            assert (b"secret" in content) == (status == 200 and method == "GET")
            assert int(answer.headers["Content-Length"]) > 0
            client.close()
        server.shutdown()
        thread.join(10)

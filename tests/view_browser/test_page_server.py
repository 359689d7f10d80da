"""The server of `knotwork view`, and browsers that break off."""

from __future__ import annotations

import socket
import struct
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.client import HTTPConnection
from itertools import product

import pytest
from serving import serve

from command_line import without_progress

HOST = "127.0.0.1"


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Port of a page; whatever browsers do, nothing but the end is said."""
    with serve("view", "planar2_closed_form", "--no-open") as serving:
        yield int(serving.address.rsplit(":")[-1].strip("/"))
    assert serving.out == "stopped\n"
    assert not without_progress(serving.err)


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
    with pytest.raises(urllib.error.HTTPError, match="404") as refused:
        urllib.request.urlopen(f"http://{HOST}:{port}/etc/passwd")
    refused.value.close()


OWN_NAMES = ("127.0.0.1:{}", "localhost:{}", "LOCALHOST:8000", "[::1]:{}", "localhost")
FOREIGN_NAMES = (
    *("evil.example:{}", "evil.example", "127.0.0.1.evil.example:{}", ""),
    "localhost:{}.evil.example",
)


def test_only_its_own_names_are_answered(port: int) -> None:
    """A foreign page may give its own name this machine's address, and read the answer."""
    for host, method in product((*OWN_NAMES, *FOREIGN_NAMES), ("GET", "HEAD")):
        client = HTTPConnection(HOST, port)
        client.request(method, "/", headers={"Host": host.format(port)})
        answer = client.getresponse()
        assert answer.status == (200 if host in OWN_NAMES else 421), host
        has_page = host in OWN_NAMES and method == "GET"
        assert (b"planar2_closed_form" in answer.read()) == has_page
        assert int(answer.headers["Content-Length"]) > 0
        client.close()

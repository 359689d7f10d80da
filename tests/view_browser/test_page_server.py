"""The page's server, and browsers that break off."""

from __future__ import annotations

import socket
import struct
import threading
import urllib.request

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

"""`drivepanel serve`: what it refuses before it serves anything."""

from __future__ import annotations

import socket

import pytest

from tui.cli.shared.host_port import host_port, written_host_port

from .commands import refused


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ([], "Missing argument 'LINE...'"),
        (["sim:atv71", "--fresh", "1"], "go with --tcp"),
        (["sim:atv71", "--allow-commands"], "go with --tcp"),
        (["sim:atv71", "--tcp", "localhost"], "write HOST:PORT"),
        (["sim:atv71", "--tcp", ":1", "-d", "1"], "both, or none"),
        (["sim:atv71", "--tcp", ":1", "-d", "1", "-p", "atv99"], "atv99"),
        (["sim:atv71", "--tcp", ":1", "--allow-writes", " "], "name codes"),
        (["sim:atv71", "sim:atv31", "--tcp", ":1"], "Several lines have the same ids"),
        (["sim:atv71", "--tcp", ":1", "--map", "1=2"], "there is no line 2"),
        (["sim:atv71", "sim:atv71"], "named twice"),
    ],
)
def test_what_makes_no_sense_is_usage(typed: list[str], told: str) -> None:
    assert told in refused(2, "serve", *typed)


def test_a_port_that_is_taken_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port: int = taken.getsockname()[1]
        place = f"127.0.0.1:{port}"
        told = refused(3, "serve", "sim:atv71", "--tcp", place)
        assert f"Nothing can be served at {place}: " in told


def test_a_place_without_a_host_is_loopback() -> None:
    assert host_port("502") == ("127.0.0.1", 502)
    assert host_port(":502") == ("127.0.0.1", 502)
    assert host_port("[::1]:502") == ("::1", 502)
    assert host_port("0.0.0.0:502") == ("0.0.0.0", 502)
    assert written_host_port("::1", 502) == "[::1]:502"

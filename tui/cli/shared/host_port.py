"""HOST:PORT as it is typed."""

from __future__ import annotations

import os

import click


def host_port(text: str) -> tuple[str, int]:
    """Host and port; loopback where only a port is given, any free port for 0."""
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or int(port) > 65535:
        raise click.UsageError(f"{text!r}: write HOST:PORT, for example 127.0.0.1:5020.")
    return host.strip("[]") or "127.0.0.1", int(port)


def written_host_port(host: str, port: int) -> str:
    """The same as it is written, an IPv6 address in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def why_not_served(error: OSError) -> str:
    """Why a place cannot be listened at, in the system's own words; asyncio wraps some of them."""
    if error.errno is not None and error.errno > 0:
        return os.strerror(error.errno)
    return error.strerror or str(error)

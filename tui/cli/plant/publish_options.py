"""Options for publication to the plant."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from ..shared.options import Target, host_port, written_host_port
from ..shared.say import say
from ..shared.served_lines import ServedLine
from .broker import Broker, broker_of
from .topics import line_topics


@dataclass(frozen=True, slots=True)
class PublishOptions:
    """Destinations of values, and the rate of reading."""

    metrics: tuple[str, int] | None
    broker: Broker | None
    every: float


def publish_options(
    metrics: str | None, mqtt: str | None, password_file: Path | None, every: float | None
) -> PublishOptions | None:
    """Return the requested publication; None if none. Raises UsageError."""
    if password_file is not None and mqtt is None:
        raise click.UsageError("--mqtt-password-file requires --mqtt.")
    if metrics is None and mqtt is None:
        if every is not None:
            raise click.UsageError("--every requires --metrics or --mqtt.")
        return None
    broker = broker_of(mqtt, password_file) if mqtt is not None else None
    place = host_port(metrics) if metrics is not None else None
    return PublishOptions(place, broker, every if every is not None else 1.0)


def check_names(broker: Broker, names: list[str]) -> None:
    """Raise UsageError if two lines would have the same topic."""
    try:
        line_topics(broker.root, names)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def check_drives(lines: Sequence[ServedLine]) -> None:
    """Raise UsageError if a line has no drive addresses."""
    from tui.session.connect.line_key import SIMULATED_PREFIX

    for line in lines:
        if not line.devices and not line.text.casefold().startswith(SIMULATED_PREFIX):
            raise click.UsageError(
                f"--metrics and --mqtt need the addresses of the drives on {line.name}. Use"
                f" {line.name}@1,2 for example."
            )


def read_drives(line: ServedLine, simulated: Sequence[int]) -> list[Target]:
    """Return the drives to read on a line: the named ones, else all of a simulated line."""
    devices = line.devices or tuple(simulated)
    return [Target(line.text, device, line.profiles.get(device)) for device in devices]


def warn_of_strangers(host: str, port: int) -> None:
    """Warn if other computers can read the metrics."""
    if not is_loopback(host):
        say(
            "drivepanel: metrics have no password: anyone who can reach"
            f" {written_host_port(host, port)} can read these drives."
            " Restrict access by a firewall.",
            err=True,
        )


def warn_of_plain_password(broker: Broker) -> None:
    """Warn if a password is sent unencrypted."""
    if broker.password is not None and not broker.tls and not is_loopback(broker.host):
        say(
            f"drivepanel: the password for {broker.place} is sent unencrypted. Use mqtts://.",
            err=True,
        )


def is_loopback(host: str) -> bool:
    """Return True if an address is reached from this computer only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"

"""The MQTT broker of the options, and its password."""

from __future__ import annotations

import os
import re
import socket
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

import click

from ..shared.errors import USAGE, Failure
from ..shared.standard_streams import given_file

PASSWORD_SETTING = "DRIVEPANEL_MQTT_PASSWORD"
"""Environment variable with the password for the broker."""
PORTS = {"mqtt": 1883, "mqtts": 8883}
SHAPE = "use mqtt://[USER@]HOST[:PORT][/TOPIC], or mqtts:// for TLS"
NO_LEVEL = re.compile(r"[/+#\s\x00-\x1f\x7f]+")
"""Characters that are special or forbidden in a topic."""


class Broker(NamedTuple):
    """A broker, and the topic of all messages."""

    host: str
    port: int
    tls: bool
    user: str | None
    password: str | None
    root: str

    @property
    def place(self) -> str:
        """Scheme, host and port as text."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'mqtts' if self.tls else 'mqtt'}://{host}:{self.port}"


mqtt_password_option = click.option(
    "--mqtt-password-file",
    "password_file",
    type=click.Path(exists=True, dir_okay=False, allow_dash=True, path_type=Path),
    metavar="FILE",
    help="Read the broker password from the first line of a file.",
)


def broker_of(url: str, password_file: Path | None) -> Broker:
    """Return the broker of a URL. Raises UsageError, and Failure if MQTT is not installed.

    A password in the URL is refused, because every user of the computer can see it.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise click.UsageError(f"{url!r}: {error}; {SHAPE}.") from error
    if parts.password is not None:
        raise click.UsageError(
            "Every user of this computer can see a password in the URL. Put it into a file"
            f" (--mqtt-password-file) or into {PASSWORD_SETTING}."
        )
    if parts.scheme not in PORTS or not parts.hostname or parts.query or parts.fragment:
        raise click.UsageError(f"{url!r}: {SHAPE}.")
    user = unquote(parts.username) if parts.username else None
    password = _password(password_file)
    if password is not None and user is None:
        if password_file is not None:
            raise click.UsageError("A password requires a user: mqtt://USER@HOST.")
        password = None
    need_mqtt()
    host, tls = parts.hostname, parts.scheme == "mqtts"
    return Broker(host, port or PORTS[parts.scheme], tls, user, password, _root(parts.path))


def _password(file: Path | None) -> str | None:
    from tui.drive.small_file import read_small_text

    if file is None:
        return os.environ.get(PASSWORD_SETTING) or None
    try:
        return read_small_text(given_file(file)).partition("\n")[0].rstrip("\r")
    except (OSError, UnicodeDecodeError) as error:
        raise click.UsageError(f"{file}: the password cannot be read: {error}.") from error


def _root(path: str) -> str:
    """Return the topic of a URL (default: one for this computer). Raises UsageError."""
    root = unquote(path).strip("/")
    if not root:
        return f"drivepanel/{level(socket.gethostname())}"
    if any(not part or NO_LEVEL.search(part) for part in root.split("/")) or root.startswith("$"):
        raise click.UsageError(
            f"{root!r} is not a topic. Use no +, # or spaces, and no $ at the start."
        )
    return root


def level(text: str) -> str:
    """Return a text as one level of a topic."""
    return NO_LEVEL.sub("_", text).strip("_") or "_"


def need_mqtt() -> None:
    """Raise Failure with advice if the package for MQTT is not installed."""
    try:
        __import__("aiomqtt")
    except ImportError as error:
        raise Failure(
            "MQTT needs the package aiomqtt. Install it: pip install 'drivepanel[mqtt]'.",
            USAGE,
        ) from error

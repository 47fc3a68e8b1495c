"""Bundle parts that send nothing: port, adapter, versions, log, journal, profiles."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator
from dataclasses import asdict
from datetime import datetime
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import msgspec

import tui
from tui.bus.link import Link, SerialLink, label
from tui.bus.transport.port_names import lasting_name
from tui.bus.transport.ports import list_ports, see_port
from tui.drive.profile import library
from tui.drive.small_file import open_regular, read_small_text

from ..changes import read_changes
from ..connect.known_lines import line_name, load_memory
from ..connect.share_place import owners
from ..journal import Journal
from ..logs import log_file
from ..record.ring import record_folder
from .parts import Missing, Part, PartFile, in_own_thread
from .redaction import PASSWORD_VARIABLE
from .subject import BundleSubject

LOG_MOST = 2_000_000
"""Maximum bytes of the log in a bundle, taken from its end."""
SYSTEM_DRIVER = "/sys/class/tty/{}/device/driver"


def line_parts(subject: BundleSubject) -> Iterator[Part]:
    """Yield the line, its port and adapter, and the versions."""
    yield Part(
        "line.json",
        "The line: its port and adapter, its state, its counters, the programs on it, and the"
        " drives that were on it before. Also the other serial ports of this computer.",
        lambda: in_own_thread(partial(_line_file, subject)),
    )
    yield Part(
        "versions.json",
        "Versions of Drive Panel, Python, its libraries and the system.",
        lambda: in_own_thread(_versions_file),
    )


def record_parts(subject: BundleSubject) -> Iterator[Part]:
    """Yield the records of this computer; the profiles, once the drives are known."""
    yield Part(
        "journal.json",
        "The journal of this line for the last day: writes, trips, tests, runs, lost links. The"
        " form is that of `drivepanel journal --json`.",
        lambda: in_own_thread(partial(_journal_file, subject)),
    )
    yield Part(
        "profiles/check.json",
        "The profiles in use, and the errors that `drivepanel profiles --check` finds in them. The"
        " profiles themselves are beside it.",
        lambda: in_own_thread(partial(_profiles_file, subject)),
    )
    yield Part(
        "log.txt",
        "The end of the log of Drive Panel on this computer, also of other lines.",
        lambda: in_own_thread(_log_file),
    )


def _line_file(subject: BundleSubject) -> PartFile:
    link = subject.link
    found: dict[str, Any] = {
        "line": subject.text,
        "link": label(link) if link is not None else None,
        "open": subject.opened is not None,
        "trouble": str(subject.trouble) if subject.trouble is not None else None,
        "port": _port(link) if isinstance(link, SerialLink) else None,
        "remembered": _remembered(link) if link is not None else None,
        "ports": [port._asdict() for port in list_ports()],
        "held": [
            {"line": owner.line, "program": owner.program.name, "pid": owner.program.pid}
            for owner in owners()
        ],
    }
    if subject.opened is not None:
        found |= _open_line(subject)
    return PartFile(found)


def _open_line(subject: BundleSubject) -> dict[str, Any]:
    assert subject.opened is not None
    line = subject.opened.line
    known = subject.opened.known
    facts = line.facts
    return {
        "state": line.state.status.value,
        "reason": line.state.reason or None,
        "changed": list(known.changed) if known is not None else [],
        "programs": [{"program": program.name, "pid": program.pid} for program in facts.programs],
        "counters": msgspec.to_builtins(line.counters, str_keys=True),
        "devices": {str(device): asdict(line.device_state(device)) for device in subject.devices},
    }


def _port(link: SerialLink) -> dict[str, Any]:
    name = lasting_name(link.path)
    driver = os.path.realpath(SYSTEM_DRIVER.format(os.path.basename(os.path.realpath(link.path))))
    return {
        **see_port(link.path)._replace(user="")._asdict(),
        "lasting": name.path if name.lasting else None,
        "adapter": name.adapter or None,
        "driver": os.path.basename(driver) if os.path.isdir(driver) else None,
    }


def _remembered(link: Link) -> dict[str, Any] | None:
    mark = load_memory().lines.get(line_name(link).key)
    if mark is None:
        return None
    drives = [
        {"device": device, **asdict(drive_mark)} for device, drive_mark in mark.drives.items()
    ]
    return {"adapter": mark.adapter or None, "drives": drives}


def remembered_devices(link: Link) -> tuple[int, ...]:
    """Return the addresses of the drives at the last use of the line."""
    mark = load_memory().lines.get(line_name(link).key)
    return tuple(mark.drives) if mark is not None else ()


def _versions_file() -> PartFile:
    libraries = {}
    for name in ("pymodbus", "pyserial", "textual", "rich", "click", "msgspec", "aiomqtt"):
        try:
            libraries[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            libraries[name] = "not installed"
    system = platform.uname()
    shown = ("TERM", "COLORTERM", "LANG", "LC_ALL", "SSH_TTY")
    settings = {
        key: text
        for key, text in sorted(os.environ.items())
        if (key in shown or key.startswith("DRIVEPANEL_")) and not PASSWORD_VARIABLE.search(key)
    }
    return PartFile(
        {
            "drivepanel": tui.__version__,
            "python": sys.version,
            # not system.node: that is the name of the computer
            "system": [system.system, system.release, system.version, system.machine],
            "libraries": libraries,
            "environment": settings,
            "time": datetime.now().astimezone().isoformat(timespec="seconds"),
        }
    )


def _journal_file(subject: BundleSubject) -> PartFile:
    texts = {subject.text} | ({label(subject.link)} if subject.link is not None else set())
    found = read_changes(record_folder(), lines=sorted(texts), since=subject.since)
    return PartFile(subject.documents.journal(str(Journal().path), found))


def _profiles_file(subject: BundleSubject) -> PartFile:
    used = _profiles_used(subject)
    if not used:
        raise Missing("No drive was identified, so no profile is in use.")
    listings = {listing.id: listing for listing in library.listings()}
    checks, files = [], {}
    for profile_id in sorted(used):
        path = listings[profile_id].path
        own = listings[profile_id].own
        checks.append({"file": str(path), "own": own, "faults": library.all_faults_of(path)})
        files[f"{profile_id}.toml"] = read_small_text(path)
    return PartFile(checks, more=files)


def _profiles_used(subject: BundleSubject) -> set[str]:
    """Return the profile ids of the drives, also of those that do not answer."""
    used = {session.family.id for session in subject.sessions}
    silent = set(subject.devices) - {session.device for session in subject.sessions}
    expected = (subject.expected_profile(device) for device in silent)
    return {*used, *(profile.id for profile in expected if profile is not None)}


def _log_file() -> PartFile:
    newest = log_file()
    older = [newest.with_name(f"{newest.name}.{number}") for number in (3, 2, 1)]
    text = b""
    for path in (*older, newest):
        text = (text + _end_of(path))[-LOG_MOST:]
    if not text:
        raise Missing(f"There is no log: {newest}.")
    whole = text if len(text) < LOG_MOST else text.partition(b"\n")[2]
    note = "" if len(text) < LOG_MOST else f"Only the last {LOG_MOST // 1_000_000} MB."
    return PartFile(whole.decode("utf-8", "replace"), note)


def _end_of(path: Path) -> bytes:
    """Return the end of a file; empty if it does not exist."""
    try:
        with os.fdopen(open_regular(path), "rb") as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - LOG_MOST))
            return file.read(LOG_MOST)
    except FileNotFoundError:
        return b""

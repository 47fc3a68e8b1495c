"""First file of a plan, from the JSON that `drivepanel scan --json` prints."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tui.drive.errors import DriveError
from tui.drive.plain import escaped_toml
from tui.drive.small_file import read_small_text

HIGHEST = 247


class NotAScan(DriveError):
    """A file without the result of a scan; the text has its name and line."""


def plant_of_scan(path: Path) -> str:
    """Return a plan with the drives that a scan has found. Raises NotAScan."""
    hits: list[dict[str, Any]] = []
    name = "Line"
    for number, row in _rows(path):
        if row.get("command") != "scan" or row.get("event") not in ("hit", "ended"):
            continue
        if row["event"] == "hit":
            device = row.get("device")
            if type(device) is not int or not 0 <= device <= HIGHEST:
                raise NotAScan(f"{path}:{number}: device: must be an address, 0 to {HIGHEST}.")
            hits.append(row)
        name = str(row.get("line") or name)
    if not hits:
        raise NotAScan(
            f"{path}: no drive of a scan. Use the output of: drivepanel scan LINE --json"
        )
    return _text(name, hits)


def _rows(path: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    try:
        lines = read_small_text(path).splitlines()
    except OSError as error:
        raise NotAScan(f"{path}: cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise NotAScan(f"{path}: byte {error.start} is not UTF-8 text.") from error
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise NotAScan(f"{path}:{number}: not valid JSON.") from error
        if isinstance(row, dict):
            yield number, row


def _text(name: str, hits: list[dict[str, Any]]) -> str:
    first = hits[0]
    form = first.get("format")
    rows = [
        "# Plan of a line, begun from a scan. The stations are in the order of their addresses.",
        "# Put them in the order of the cable, and add the lengths in the lines with a #.",
        "",
        "format = 1",
        f"name = {escaped_toml(name)}",
        f"baud = {first['baud']}" if isinstance(first.get("baud"), int) else "# baud = 19200",
        f"characters = {escaped_toml(str(form))}" if form else '# characters = "8E1"',
        "",
        "[master]",
        "# polarization = 650  # ohm to each of 5 V and common",
        'terminator = "RC"  # 120 ohm with 1 nF, if the master is at an end',
    ]
    found = {hit["device"]: hit for hit in hits}
    for number, (device, hit) in enumerate(sorted(found.items()), 1):
        label = str(hit.get("name") or hit.get("reference") or "")
        rows += [
            "",
            "[[stations]]",
            f"address = {device}",
            f"name = {escaped_toml(label)}",
            f"profile = {escaped_toml(str(hit.get('profile') or ''))}",
            "# cable = 10  # m from the element before",
            "# stub = 1  # m from the line to the drive",
        ]
        if number == len(found):
            rows.append('terminator = "RC"')
    return "\n".join([*rows, ""])

"""What the Connection screen offers: the lines of this machine and those used lately."""

from __future__ import annotations

from dataclasses import dataclass

SIMULATED = (
    ("sim:atv21,atv31,atv312,atv71,powerdrive", "five drives on one line"),
    ("sim:atv71@2", "an Altivar 71 at address 2"),
)


@dataclass(frozen=True, slots=True)
class LineChoice:
    """A line that can be opened; `path` where it is a serial port with settings of its own."""

    text: str
    description: str
    path: str = ""


@dataclass(frozen=True, slots=True)
class Group:
    """Choices under one heading."""

    title: str
    choices: tuple[LineChoice, ...]
    empty: str = ""


def groups(ports: list[tuple[str, str]], recent: list[str]) -> list[Group]:
    """The headings with their lines; `ports` are paths with descriptions."""
    serial = tuple(LineChoice(path, description, path) for path, description in ports)
    lately = tuple(LineChoice(text, "") for text in recent)
    return [
        Group("Serial ports", serial, "none found: plug in the adapter, then r"),
        Group("Recent", lately, "none yet: n types a line"),
        Group("Simulated", tuple(LineChoice(text, about) for text, about in SIMULATED)),
    ]

"""The programs that `link` runs over a link, and the text of their pictures.

All checks use the text of a picture, not colors.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.hello import TEXTS
from benchmarks.panel import HELLO, PANEL, word_sign

Shown = Callable[[str], bool]
"""Check of a picture: True if it shows something."""
UPTIME = Path("/proc/uptime")
HTOP_HELP = re.compile(r"Released under|strace")
RUNNING = re.compile(r"FORWARD.* \d+\.\d +Hz")
MONITOR = (
    RUNNING.pattern,
    r"1 Line .* 7 Frames",
    r"Output .*Current",
    r"Command +Modbus",
    r"Timeout +(off|\d)",
    r"Answers +\d",
    r"Speed +\d+ rpm",
    r"Torque +-?\d",
    r"Power +\d",
    r"Motor +\d+ V",
    r"ETA +16#",
    r"Alarms  ",
    r"Space STOP 1 .* q quit",
)
"""All of Monitor at 80 x 24: strip, tabs, values, words of bits, the line of keys."""


def saying_all(*patterns: str) -> Shown:
    """Return a check that all of these patterns are on the picture."""
    found = [re.compile(pattern) for pattern in patterns]
    return lambda text: all(pattern.search(text) for pattern in found)


def saying_none(*patterns: str) -> Shown:
    """Return a check that none of these patterns is on the picture."""
    found = [re.compile(pattern) for pattern in patterns]
    return lambda text: not any(pattern.search(text) for pattern in found)


def both(shown: Shown, other: Shown) -> Shown:
    """Return a check that both hold."""
    return lambda text: shown(text) and other(text)


def below_tabs(text: str) -> object:
    """The first line below the tabs, which differs between screens; the tabs differ in color."""
    return text.split("\n")[2]


@dataclass(frozen=True, slots=True)
class Press:
    """A key, the sign that changes with the first cell of its answer, and the whole answer."""

    name: str
    key: str
    sign: Callable[[str], object]
    complete: Callable[[str, str], bool] | None = None
    """Check that compares the picture before the key with the current one: True if all of it has
    arrived. Without it, a picture is complete once its sign stays unchanged.
    """


def becoming(shown: Shown) -> Callable[[str, str], bool]:
    """Complete as soon as this is shown, whatever stood there before."""
    return lambda _before, now: shown(now)


def other_text(before: str, now: str) -> bool:
    """Return True if the bare Textual program shows its other text completely."""
    return any(text in now and text not in before for text in TEXTS)


def htop_turned(before: str, now: str) -> bool:
    """Return True if the help of htop is complete, or completely gone."""
    if HTOP_HELP.search(before):
        return "F10Quit" in now and not HTOP_HELP.search(now)
    return bool(re.search(r"strace\s*\Z", now)) and "Released under" in now


_MONITOR_SHOWN = both(saying_all(*MONITOR), saying_none("Frames on the line", "Messages ─"))
_MONITOR_GONE = saying_none("Answers  ", "Alarms  ")
_FRAMES_SHOWN = both(saying_all("Frames on the line", r"h pause .* q quit"), _MONITOR_GONE)
_MESSAGES_SHOWN = both(saying_all("Messages ─", r"Esc back .* q quit"), _MONITOR_GONE)
PANEL_KEYS = (
    Press("Tab", "\t", word_sign),
    Press("7 Frames", "7", below_tabs, becoming(_FRAMES_SHOWN)),
    Press("2 Monitor", "2", below_tabs, becoming(_MONITOR_SHOWN)),
    Press("m Messages", "m", below_tabs, becoming(_MESSAGES_SHOWN)),
    Press("2 Monitor", "2", below_tabs, becoming(_MONITOR_SHOWN)),
)
"""A walk that ends where it began; figures of the same name are put together."""
HELLO_KEYS = (Press("w", "w", lambda text: tuple(t in text for t in TEXTS), other_text),)
HTOP_KEYS = (Press("? help", "?", lambda text: text.split("\n")[-1], htop_turned),)


@dataclass(frozen=True, slots=True)
class Program:
    """A program to run, and the text of its picture at each step."""

    command: tuple[str, ...]
    first: Shown
    """The first picture, from its first row to its last one."""
    keys: tuple[Press, ...]
    state: Shown | None = None
    """The motor's state can be read."""
    complete: Shown | None = None
    """All values and the keys are shown."""
    settles: bool = False
    """Its picture says nothing in its last row: it is there when nothing more comes."""
    compressed: bool = False
    clock: Callable[[str], float | None] | None = None
    """A clock on the picture and the real one, in s: how far it is behind."""


def programs(line: str) -> dict[str, Program]:
    """The contestants by name; the panel watches its drive on this LINE."""
    command = (*PANEL, "panel", line, "-d", "1")
    first = saying_all(r"\A.*\w", r"\? help[^\n]*\Z")
    low = Program(
        (*command, "--low-bandwidth"),
        first,
        PANEL_KEYS,
        saying_all(RUNNING.pattern),
        _MONITOR_SHOWN,
    )
    found = {
        "low bandwidth": low,
        "low bandwidth, ssh -C": replace(low, compressed=True),
        "panel": replace(low, command=command),
        "bare Textual": Program(HELLO, saying_all(TEXTS[0]), HELLO_KEYS, settles=True),
    }
    if shutil.which("htop"):
        htop = Program(("htop", "-d", "20"), saying_all("F10Quit"), HTOP_KEYS, clock=behind_uptime)
        found["htop, every 2 s"] = htop
        found["htop, 2 Hz"] = replace(htop, command=("htop", "-d", "5"))
    return found


def behind_uptime(text: str) -> float | None:
    """Delay in s of the uptime that htop shows; None if it shows none."""
    found = re.search(r"Uptime: (?:(\d+) days?, )?(\d+):(\d\d):(\d\d)", text)
    if found is None:
        return None
    days, hours, minutes, seconds = (int(part or 0) for part in found.groups())
    shown = ((days * 24 + hours) * 60 + minutes) * 60 + seconds
    return float(UPTIME.read_text().split()[0]) - shown

"""Sequences of terminals for F1 to F12, from terminfo entries and PuTTY's documentation."""

from __future__ import annotations

TILDE = ["11", "12", "13", "14", "15", "17", "18", "19", "20", "21", "23", "24"]


def _tilde(first: int) -> list[str]:
    return [f"\x1b[{code}~" for code in TILDE[first:]]


def _finals(begins: str, finals: str) -> list[str]:
    return [begins + final for final in finals]


DIALECTS: dict[str, list[str]] = {
    "PuTTY ESC[n~, VT400; rxvt": _tilde(0),
    "PuTTY Xterm R6; xterm, tmux, screen": _finals("\x1bO", "PQRS") + _tilde(4),
    "PuTTY Linux; Linux console": _finals("\x1b[[", "ABCDE") + _tilde(5),
    "PuTTY VT100+": _finals("\x1bO", "PQRSTUVWXYZ["),
    "PuTTY SCO": _finals("\x1b[", "MNOPQRSTUVWX"),
    "eight bits": [f"\x9b{code}~" for code in TILDE],
}
"""By dialect, F1 to F12 in order."""

SHIFTED_AND_MORE: dict[str, list[str]] = {
    "PuTTY SCO": _finals("\x1b[", "YZabcdefghijklmnopqrstuvwxyz@[\\]^_`{"),
    "rxvt": [f"\x1b[{code}{final}" for code in [*TILDE, "25", "34"] for final in "^$@"],
    "xterm": [f"\x1b[{code};{held}~" for code in TILDE for held in range(2, 9)]
    + [f"\x1b[1;{held}{final}" for final in "PQRSABCDHF" for held in range(2, 9)],
    "Linux console, PuTTY": [f"\x1b[{code}~" for code in (25, 26, 28, 29, 31, 32, 33, 34)],
    "PuTTY with Alt": [f"\x1b\x1b[{code}~" for code in TILDE if code not in ("20", "24")],
    "rxvt's keypad and Ctrl": _finals("\x1bO", "abcd"),
    "not known to anybody": ["\x1b[009q", "\x1b[235z", "\x1b[<1;2;3M", "\x1b[>0;10;1c", "\x1b[?6c"],
}
"""Sequences that stop nothing and type nothing."""

REPORTS = {
    "a cursor": "\x1b[12;40R",
    "a mode": "\x1b[?2026;2$y",
    "its size": "\x1b[48;24;80;480;800t",
}
"""Sequences that Textual expects."""

REPLIES = {
    "attributes": "\x1b[?62;22;52c",
    "more attributes": "\x1b[>41;370;0c",
    "well": "\x1b[0n",
    "color": "\x1b]11;rgb:0000/0000/0000\x1b\\",
    "color, ended by a bell": "\x1b]11;rgb:0000/0000/0000\x07",
    "version": "\x1bP>|tmux 3.3a\x1b\\",
    "cursor's shape": "\x1bP1$r2 q\x1b\\",
    "picture": "\x1b_Gi=31;EINVAL: bad r v\x1b\\",
    "focus": "\x1b[I",
    "no focus": "\x1b[O",
    "keyboard": "\x1b[?0u",
}
"""Sequences that no program expects."""

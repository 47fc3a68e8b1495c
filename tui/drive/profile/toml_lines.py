"""Line of each table, key and list element of a TOML text.

The text must be valid TOML: this only finds places in it.
"""

from __future__ import annotations

import re

TomlPath = tuple[str | int, ...]
"""Keys and indices from the top of a file, such as ("parameters", 3, "scale")."""

_BLANK = re.compile(r"(?:[ \t\r\n,]|#[^\n]*)*")
_KEY = re.compile(r"""[ \t]*(?:([\w-]+)|"((?:[^"\\]|\\.)*)"|'([^']*)')[ \t]*""")
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}|' + r"'''.*?'{3,5}" + r"""|"(?:[^"\\]|\\.)*"|'[^']*'""", re.DOTALL
)
_OTHER = re.compile(r"[^,\]}#\n]+")


def toml_lines(text: str) -> dict[TomlPath, int]:
    """Return line numbers, from 1, by path."""
    return _Scan(text).lines


class _Scan:
    """One walk through a text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[TomlPath, int] = {(): 1}
        self._counted = (0, 1)
        self._lists: dict[TomlPath, int] = {}
        self._whole()

    def _line(self) -> int:
        before, line = self._counted
        self._counted = (self.at, line + self.text.count("\n", before, self.at))
        return self._counted[1]

    def _note(self, path: TomlPath) -> None:
        self.lines.setdefault(path, self._line())

    def _blank(self) -> str:
        """Return the character after blanks, commas and comments; empty at the end."""
        if found := _BLANK.match(self.text, self.at):
            self.at = found.end()
        return self.text[self.at : self.at + 1]

    def _keys(self) -> list[str]:
        """Read a key; return its parts."""
        parts: list[str] = []
        while found := _KEY.match(self.text, self.at):
            parts.append(found[1] or found[2] or found[3] or "")
            self.at = found.end()
            if self.text[self.at : self.at + 1] != ".":
                break
            self.at += 1
        return parts

    def _whole(self) -> None:
        table: TomlPath = ()
        while sign := self._blank():
            if sign == "[":
                table = self._header()
            elif not self._pair(table):
                return

    def _header(self) -> TomlPath:
        several = self.text.startswith("[[", self.at)
        start = self.at
        self.at += 2 if several else 1
        parts = self._keys()
        end, self.at = self.at, start
        path: TomlPath = ()
        for place, part in enumerate(parts):
            path = (*path, part)
            last = place == len(parts) - 1
            if last and several:
                self._note(path)
                self._lists[path] = self._lists.get(path, -1) + 1
            if path in self._lists:
                path = (*path, self._lists[path])
            self._note(path)
        self.at = end + (2 if several else 1)
        return path

    def _pair(self, table: TomlPath) -> bool:
        """Read a key with its value; return False if there is no key."""
        start = self.at
        parts = self._keys()
        if not parts:
            return False
        end, self.at = self.at, start
        for length in range(1, len(parts) + 1):
            self._note((*table, *parts[:length]))
        self.at = end + 1  # after the equals sign
        while self.text[self.at : self.at + 1] in (" ", "\t"):
            self.at += 1
        self._value((*table, *parts))
        return True

    def _value(self, path: TomlPath) -> None:
        sign = self.text[self.at : self.at + 1]
        if sign == "[":
            self.at += 1
            index = 0
            while (inner := self._blank()) and inner != "]":
                self._note((*path, index))
                self._value((*path, index))
                index += 1
            self.at += 1
        elif sign == "{":
            self.at += 1
            while (inner := self._blank()) and inner != "}":
                if not self._pair(path):
                    return
            self.at += 1
        else:
            found = _STRING.match(self.text, self.at) or _OTHER.match(self.text, self.at)
            self.at = found.end() if found else len(self.text)

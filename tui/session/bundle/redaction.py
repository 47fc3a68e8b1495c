"""Texts without user names, host names, home folders and passwords. Pure, but for `local_names`.

Names and passwords that one text reveals are removed from all of them: first `learn` every text,
then `clean` each.
"""

from __future__ import annotations

import ipaddress
import json
import os
import re
import socket
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

from tui.drive.small_file import read_small

USER, HOST, HOME, SECRET = "[user]", "[host]", "~", "[omitted]"
OMITTED_KINDS = {
    USER: "user names",
    HOST: "host names",
    HOME: "home folders",
    SECRET: "passwords, tokens and credentials in URLs",
}
"""Kinds of omitted data, by the text that replaces them."""
COMMON_NAMES = frozenset(
    {
        "root", "admin", "administrator", "user", "guest", "pi",
        "localhost", "host", "drivepanel", "service", "operator",
        "broker", "ubuntu", "debian", "node", "vagrant",
    }
)  # fmt: skip
"""Names that many computers have: they identify nobody."""
SHORTEST_SECRET = 4
PASSWORD_VARIABLE = re.compile(r"PASS(WORD|WD|PHRASE)|SECRET|TOKEN|CREDENTIAL|API_?KEY", re.I)
"""Pattern in the names of environment variables that contain a password."""
_SECRET_WORD = (
    r"(?:pass(?:word|wd|phrase)|secret|credentials?|(?:auth|access|api)[_-]?(?:token|key)|token)"
)
_IN_URL = re.compile(r"\b([a-z][a-z0-9+.-]*://)([^\s\"'<>]*)@", re.I)
_ASSIGNED = re.compile(
    rf"(\b[\w.-]*{_SECRET_WORD}[\"']?\s*[:=]\s*)"
    r"(\"(?:[^\"\\\n]|\\.)*\"|'(?:[^'\\\n]|\\.)*'|[^\s,;)\]}]+)",
    re.I,
)
_OPTION = re.compile(rf"(--(?:[a-z]+-)*{_SECRET_WORD}[ =])(\"[^\"\n]*\"|'[^'\n]*'|\S+)", re.I)
_HEADER = re.compile(r"(\b(?:Basic|Bearer)\s+)([A-Za-z0-9+/=._~-]{8,})")
_LINE_HOST = re.compile(
    r"\b(?:rtu-tcp|tcp|mqtts?):(?://)?(?:[^\s\"'<>]*@)?([A-Za-z0-9_][\w.-]*)", re.I
)
_NAMED = re.compile(
    r"\b(user(?:name)?|login|host(?:name)?)[\"']?\s*[:=]\s*[\"']([^\"'\n]+)[\"']", re.I
)
_HOME_PATH = re.compile(r"(?:/home|/Users|[A-Za-z]:\\{1,2}Users)[/\\]{1,2}([^/\\\s\"':,;()\]]+)")


class Names(NamedTuple):
    """Names that must not leave this computer."""

    users: frozenset[str] = frozenset()
    hosts: frozenset[str] = frozenset()
    homes: frozenset[str] = frozenset()
    secrets: frozenset[str] = frozenset()


class Redaction:
    """Removes names and passwords from texts, and counts what it has removed."""

    def __init__(self, names: Names) -> None:
        self._users = {user for user in names.users if _is_own(user)}
        self._hosts = {host for host in names.hosts if _is_own(host)}
        self._homes = {home.rstrip("/\\") for home in names.homes if len(home.rstrip("/\\")) > 1}
        self._secrets = {secret for secret in names.secrets if len(secret) >= SHORTEST_SECRET}
        self._pattern: re.Pattern[str] | None = None
        self._instead: dict[str, str] = {}
        self.counts: Counter[str] = Counter()
        """Number of removals, by the text that replaces them."""

    def learn(self, content: object) -> None:
        """Record the names and passwords that a text, or the texts of a JSON document, reveal."""
        self._pattern = None
        for text in _texts(content):
            for match in _IN_URL.finditer(text):
                user, _, password = match[2].partition(":")
                self._users |= {user} if _is_own(user) else set()
                found_in_url = {password, unquote(password)}
                self._secrets |= {
                    any_type for any_type in found_in_url if len(any_type) >= SHORTEST_SECRET
                }
            for pattern in (_ASSIGNED, _OPTION, _HEADER):
                found = (match[2].strip("\"'") for match in pattern.finditer(text))
                self._secrets |= {any_type for any_type in found if _is_secret(any_type)}
            for kind, name in _NAMED.findall(text):
                names = self._hosts if kind.casefold().startswith("host") else self._users
                names |= {name} if _is_own(name) else set()
            for host in _LINE_HOST.findall(text):
                self._hosts |= {item for item in (host, host.partition(".")[0]) if _is_own(item)}
            self._users |= {item for item in _HOME_PATH.findall(text) if _is_own(item)}

    def clean(self, content: Any) -> Any:
        """Return a text, or a JSON document, without them; the keys of a document stay."""
        if isinstance(content, str):
            return self._clean_text(content)
        if isinstance(content, Mapping):
            return {key: self.clean(item) for key, item in content.items()}
        if isinstance(content, (list, tuple)):
            return [self.clean(item) for item in content]
        return content

    def _clean_text(self, text: str) -> str:
        for pattern, suffix in ((_IN_URL, "@"), (_ASSIGNED, ""), (_OPTION, ""), (_HEADER, "")):
            text = pattern.sub(self._omit(suffix), text)
        text = _HOME_PATH.sub(self._replace(HOME), text)
        if self._pattern is None:
            self._pattern = self._made()
        return self._pattern.sub(lambda match: self._known(match[0]), text)

    def _omit(self, suffix: str) -> Any:
        def omit(match: re.Match[str]) -> str:
            if match[2].strip("\"'") == SECRET:
                return match[0]
            self.counts[SECRET] += 1
            quote = match[2][:1] if match[2][:1] in "\"'" else ""
            return f"{match[1]}{quote}{SECRET}{quote}{suffix}"

        return omit

    def _replace(self, by: str) -> Any:
        def replace(_: re.Match[str]) -> str:
            self.counts[by] += 1
            return by

        return replace

    def _known(self, found: str) -> str:
        by = self._instead.get(found.casefold(), SECRET)
        self.counts[by] += 1
        return by

    def _made(self) -> re.Pattern[str]:
        """Return one pattern of all known secrets, the longest first: a host may contain a user."""
        self._instead = {}
        for by, names in ((USER, self._users), (HOST, self._hosts), (HOME, self._homes)):
            self._instead |= {name.casefold(): by for name in names}
        secrets = {form for secret in self._secrets for form in _forms(secret)}
        known = self._users | self._hosts | self._homes | secrets
        parts = [
            rf"(?-i:{re.escape(text)})" if text in secrets else _part(text)
            for text in sorted(known, key=len, reverse=True)
        ]
        return re.compile("|".join(parts) or r"(?!)", re.IGNORECASE)


def _forms(secret: str) -> Iterator[str]:
    """Yield a secret as plain text, and as JSON, Python and URLs write it."""
    yield secret
    yield json.dumps(secret)[1:-1]
    yield repr(secret)[1:-1]
    yield quote(secret, safe="")


def _part(name: str) -> str:
    """Return a pattern of a name; a short one only as a whole word."""
    escaped = re.escape(name)
    return escaped if len(name) > 4 else rf"(?<![A-Za-z0-9]){escaped}(?![A-Za-z0-9])"


def _is_secret(text: str) -> bool:
    """True if other texts do not contain a value as a plain word, such as None or required."""
    is_word = text.isalpha() and text in (text.lower(), text.capitalize())
    return len(text) >= SHORTEST_SECRET and text != SECRET and not is_word


def is_address(text: str) -> bool:
    """True for an IP address, which names no one."""
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return re.fullmatch(r"[\d.]+", text) is not None
    return True


def _is_own(name: str) -> bool:
    """True for a name that may identify someone: no address, no common name."""
    return (
        len(name) > 1
        and name != SECRET
        and name.casefold() not in COMMON_NAMES
        and not is_address(name)
    )


def _texts(content: object) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, Mapping):
        for item in content.values():
            yield from _texts(item)
    elif isinstance(content, (list, tuple)):
        for item in content:
            yield from _texts(item)


def local_names(more_users: Iterable[str] = ()) -> Names:
    """The names and passwords of this computer and this user; reads files of the system."""
    environment = os.environ
    users = {environment.get(key, "") for key in ("USER", "LOGNAME", "USERNAME", "SUDO_USER")}
    users |= set(more_users) | set(_accounts())
    host = socket.gethostname()
    hosts = {host, host.partition(".")[0], environment.get("HOSTNAME", "")}
    hosts.add(environment.get("COMPUTERNAME", ""))
    homes = {environment.get("HOME", ""), os.path.realpath(environment.get("HOME", "") or "/")}
    with suppress(RuntimeError):
        homes.add(str(Path.home()))
    secrets = {text for key, text in environment.items() if PASSWORD_VARIABLE.search(key)}
    return Names(frozenset(users), frozenset(hosts), frozenset(homes), frozenset(secrets))


def _accounts() -> Iterator[str]:
    """Account names and real names of the people with an account on this computer."""
    with suppress(OSError):
        for row in read_small(Path("/etc/passwd")).decode("utf-8", "replace").splitlines():
            name, _, number, _, real_name, *_ = (*row.split(":"), "", "", "", "", "")
            if number.isdecimal() and 1000 <= int(number) < 60_000:
                yield name
                yield real_name.partition(",")[0]
            elif number == str(getattr(os, "getuid", lambda: -1)()):
                yield name

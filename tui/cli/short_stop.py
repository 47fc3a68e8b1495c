"""The short way of `drivepanel stop`: the stop reaches the holder of the line before the imports.

It is a shot in front. The command follows in full, whether it arrives or not: it repeats the stop,
follows the motor to standstill, and reports. So nothing here prints, raises or waits for long. It
takes a command line only if each word of it is understood, and stops no other drive than the
command. An import costs more than all the rest: what is here needs none but sockets and a digest,
and the settings file for a line's name.
"""

from __future__ import annotations

import _thread
import os
import sys

_SENT_WITHIN = 0.25
"""Seconds for all of it: the disk that has the lock files may take nothing, and give nothing."""
_ANSWER_WITHIN = 0.1
"""Seconds for the connection, and for the answer."""
_LONGEST_FILE = 1 << 16
_LONGEST_SOCKET_ADDRESS = 100
"""Bytes of a path that the system takes for a socket."""
_FLAGS = ("--json", "--arm", "--accept-line")
_VERBOSE = ("-v", "-vv", "-vvv", "--verbose")
_UNITS = {("tcp", "unit=255"), ("tcp", "unit=0")}
_ADDRESSES = {str(device): device for device in range(1, 248)}
_HOST = frozenset("abcdefghijklmnopqrstuvwxyz0123456789.-_")
_DEVICE_LINKS = "/dev/serial"
_HOSTS_FILE = "/etc/hosts"

STARTS: list[str] = []
"""The starts on record when the stop was given. The holder of the line removes that of a motor that
it has stopped, and the family of the drive is known by nothing else if it does not identify itself.
"""


def stop_at_once(words: list[str]) -> None:
    """Give the stop of a command line to the holder of the line, if there is one."""
    if sys.platform != "linux":
        return
    late: list[bool] = []
    under_way = _thread.allocate_lock()
    under_way.acquire()

    def give() -> None:
        try:
            if (stop := parse_stop(words)) is not None:
                line, devices = stop
                # the command has stopped it since, and it may have been started again
                if (address := holder_address(line)) and not late:
                    _send(address, " ".join(map(str, devices)) or "all")
        except Exception:
            # the command itself follows
            pass
        finally:
            under_way.release()

    try:
        _thread.start_new_thread(give, ())
        under_way.acquire(timeout=_SENT_WITHIN)
        late.append(True)
    except KeyboardInterrupt:
        os._exit(130)
    except Exception:
        pass


# What was typed


def parse_stop(words: list[str]) -> tuple[str, tuple[int, ...]] | None:
    """The line and the devices that a command line stops, none for all of them.

    None unless all is understood.
    """
    if "--" in words or os.environ.get("_DRIVEPANEL_COMPLETE"):
        return None
    rest = [word for word in words if word not in _VERBOSE]
    if rest[:1] != ["stop"]:
        return None
    rest.reverse()
    rest.pop()
    lines: list[str] = []
    typed: list[str] = []
    every = False
    while rest:
        word = rest.pop()
        option, value = _option(word, rest)
        if option == "-d":
            typed.append(value)
        elif option == "--all":
            every = True
        elif option == "":
            lines.append(word)
        elif option not in _FLAGS and not (option == "-p" and value[:1] not in ("", "-")):
            return None
    line = lines[0] if lines else os.environ.get("DRIVEPANEL_LINE")
    if not line or len(lines) > 1 or (every and typed):
        return None
    if any(text not in _ADDRESSES for text in typed):
        return None
    line, usual = _written_out(line)
    devices = tuple(dict.fromkeys(_ADDRESSES[text] for text in typed)) or (usual,)
    return (line, () if every else devices) if line else None


def _option(word: str, rest: list[str]) -> tuple[str, str]:
    """An option by its short name with its value; an empty name for a word that is none.

    `rest` are the words after it, the next one last.
    """
    for short, long in (("-d", "--device"), ("-p", "--profile")):
        if word in (short, long):
            return short, rest.pop() if rest else ""
        if word.startswith(f"{long}="):
            return short, word[len(long) + 1 :]
        if word.startswith(short) and word[1] != "-":
            return short, word[2:]
    return (word, "") if word[:1] in ("", "-") else ("", word)


def _written_out(line: str) -> tuple[str, int]:
    """The line of a name with the address of its drive, else a line as it is, and 1."""
    if not line.replace("-", "").replace("_", "").isalnum():
        return line, 1
    # a third of the imports of the command
    from tui.session.connect.named_lines import line_to_stop

    named = line_to_stop(line)
    return (named.line, named.device or 1) if named is not None else ("", 1)


# The line, as tui.session.connect.line_key knows it


def line_keys(text: str) -> tuple[list[str], str]:
    """Keys that a line may have, and the real path of its port; no key unless all is understood."""
    kind, colon, rest = text.partition(":")
    kind = kind.lower() if colon else ""
    link, *settings = (rest if kind else text).split(",")
    if settings and _is_timeout(settings[-1]):
        settings.pop()
    if kind in ("tcp", "rtu-tcp") and (not settings or (kind, *settings) in _UNITS):
        return [",".join((key, *settings)) for key in _network_keys(kind, link)], ""
    bare = not kind and link.startswith("/")
    if not (kind == "serial" or bare) or not link or " " in text or not _are_serial(settings):
        return [], ""
    if bare and not link.startswith("/dev/") and not os.path.exists(link):
        return [], ""
    real = os.path.realpath(link)
    return [f"serial:{path}" for path in (real, *_links_to(real))], real


def _is_timeout(setting: str) -> bool:
    name, _, value = setting.partition("=")
    digits = value.replace(".", "", 1)
    return name == "timeout" and _is_number(digits) and 0.02 <= float(value) <= 30.0


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) <= 9


def _are_serial(settings: list[str]) -> bool:
    """True for settings of a serial line: a baud rate, then a format."""
    baud, form, *more = (*settings, *("19200", "8E1")[len(settings) :])
    form = form.upper()
    known = len(form) == 3 and form[0] == "8" and form[1] in "NEO" and form[2] in "12"
    return not more and known and _is_number(baud) and 50 <= int(baud) <= 4_000_000


def _links_to(real: str) -> list[str]:
    """The lasting names that lead to a port at present."""
    folders = [f"{_DEVICE_LINKS}/{kind}" for kind in ("by-id", "by-path")]
    folders = [folder for folder in folders if os.path.isdir(folder)]
    links = [f"{folder}/{name}" for folder in folders for name in os.listdir(folder)]
    return [link for link in links if os.path.realpath(link) == real]


def _network_keys(kind: str, link: str) -> list[str]:
    host, colon, port = link.partition(":")
    if not colon and kind == "tcp":
        port = "502"
    host = host.lower()
    if not (_HOST.issuperset(host) and _is_number(port) and 1 <= int(port) <= 65535):
        return []
    host = _host_number(host.rstrip("."))
    return [f"{kind}:{host}:{int(port)}"] if host else []


def _host_number(name: str) -> str:
    """The number of a host of the hosts file, else its name; empty for one in another spelling."""
    numbers = [name] if name[:1].isdigit() else []
    for line in [] if numbers else _content(_HOSTS_FILE).splitlines():
        number, *called = line.partition("#")[0].split() or [""]
        if name in [text.lower().rstrip(".") for text in called]:
            numbers.append(number)
    if not numbers:
        return name
    number = next((text for text in numbers if ":" not in text), "")
    parts = number.split(".")
    plain = all(_is_number(part) and part == str(int(part)) and int(part) <= 255 for part in parts)
    return number if plain and len(parts) == 4 else ""


# Who holds it, as tui.session.connect.share_place and tui.bus.share.place know it


def holder_address(line: str) -> str:
    """The socket of the process that holds a line; empty unless it is surely the one."""
    keys, real = line_keys(line)
    if not keys or os.environ.get("DRIVEPANEL_SHARE_GROUP"):
        return ""
    group = _group_folder()
    found: set[str] = set()
    for key in keys:
        name = _lock_name(key)
        lock = f"{group}/{name}"
        if shared := os.access(lock, os.R_OK | os.W_OK):
            user = -1
        else:
            lock, user = f"{_state_folder()}/lines/{name}", os.getuid()
        if os.access(lock, os.R_OK):
            owner = _content(lock)
            address, held = _field(owner, "socket"), _field(owner, "line")
            if _is_held(held, real) and _is_socket(address, group if shared else "", user):
                found.add(address)
    return found.pop() if len(found) == 1 else ""


def _is_held(held: str, real: str) -> bool:
    """True for a line as its holder names it that leads to this port, or to a host."""
    kind, _, rest = held.partition(":")
    if kind != "serial":
        return bool(held) and not real
    return os.path.realpath(rest.partition(",")[0]) == real


def _state_folder() -> str:
    if folder := os.environ.get("DRIVEPANEL_STATE"):
        return folder
    folder = os.environ.get("XDG_STATE_HOME", "")
    if not folder.startswith("/"):
        folder = os.path.expanduser("~/.local/state")
    return f"{folder}/drivepanel" if folder.startswith("/") else os.devnull


def _starts() -> list[str]:
    """The records of starts, as tui.session.starts.files writes them; none that cannot be read."""
    found: list[str] = []
    for folder in (f"{_state_folder()}/starts", f"{_group_folder()}/starts"):
        for name in os.listdir(folder) if os.access(folder, os.R_OK | os.X_OK) else ():
            try:
                if name.endswith(".json"):
                    found.append(_content(f"{folder}/{name}"))
            except (OSError, ValueError):
                continue
    return found


def _group_folder() -> str:
    return os.environ.get("DRIVEPANEL_SHARE_FOLDER") or "/run/drivepanel"


def _lock_name(key: str) -> str:
    readable = "".join(text if text.isascii() and text.isalnum() else "-" for text in key)
    readable = "-".join(filter(None, readable.split("-")))[-24:]
    return f"{readable}-{_digest(key)[:12]}.lock"


def _digest(text: str) -> str:
    for name in ("_sha2", "_sha256"):  # of Python 3.12, and before
        try:
            return str(__import__(name).sha256(text.encode()).hexdigest())
        except ImportError:
            continue
    from hashlib import sha256

    return sha256(text.encode()).hexdigest()


def _content(path: str) -> str:
    # never one that waits: a pipe of this name has no end
    file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        return os.read(file, _LONGEST_FILE).decode()
    finally:
        os.close(file)


def _field(document: str, name: str) -> str:
    """A text of a JSON object; inside of texts such a beginning would have backslashes."""
    before, _, rest = document.partition(f'"{name}":"')
    text, end, _ = rest.partition('"')
    return text if before and end and "\\" not in text else ""


def _is_socket(address: str, folder: str, user: int) -> bool:
    """True for a socket of this user, or of a group in its folder."""
    if not os.path.exists(address) or (
        folder and os.path.dirname(address) != os.path.abspath(folder)
    ):
        return False
    found = os.stat(address)
    return found.st_mode & 0o170000 == 0o140000 and (folder != "" or found.st_uid == user)


def _send(address: str, devices: str) -> None:
    """Send the stop in its plain form, see tui.bus.share.beside; wait until it is taken."""
    from _socket import AF_UNIX, socket

    folder = -1
    connection = socket(AF_UNIX)
    try:
        connection.settimeout(_ANSWER_WITHIN)
        if len(os.fsencode(address)) > _LONGEST_SOCKET_ADDRESS:
            folder = os.open(os.path.dirname(address), os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            address = f"/proc/self/fd/{folder}/{os.path.basename(address)}"
        connection.connect(address)
        connection.send(f"STOP {devices}\n".encode())
        STARTS[:] = _starts()
        connection.recv(len("GIVEN\n"))
    finally:
        connection.close()
        if folder >= 0:
            os.close(folder)

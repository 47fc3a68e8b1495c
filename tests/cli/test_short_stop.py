"""The short stop before `drivepanel stop`: it parses like the command, or does nothing."""

from __future__ import annotations

import os
import shutil
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import click
import pytest
from hypothesis import example, given
from hypothesis import strategies as some

from tests.line_events import on_event
from tui.bus.errors import LinkSyntaxError
from tui.bus.line_events import DevicesStopped
from tui.bus.link import RtuTcpLink, SerialLink, TcpLink, label, parse_link
from tui.bus.program import KEEPER, Program
from tui.bus.share.messages import VERSION
from tui.bus.share.place import Owner, OwnerLock, SharePlace, short_path
from tui.cli import short_stop
from tui.cli.main import main
from tui.cli.short_stop import holder_address, line_keys, parse_stop, stop_at_once
from tui.session.connect import line_key as line_keys_module
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.line_key import line_key
from tui.session.connect.named_lines import is_name
from tui.session.connect.open_line import open_line
from tui.session.connect.share_place import share_place
from tui.session.paths import state_folder
from tui.session.starts.starts import Starts
from tui.simulator import DriveSpec, Simulation

LINE = "serial:/dev/ttyX0"
KEEPER_PROGRAM = Program("keeper", KEEPER, os.getpid(), 'a"socket":"/x"', 'x\\"socket":"/y')

# What was typed

OPTIONS = (
    "-d", "-d2", "-d=2", "-d 2", "--device", "--device=3", "--device=", "--dev=3", "-p", "-patv71",
    "--profile", "--profile=atv31", "--all", "--al", "--all=1", "--addresses", "--addresses=1-3",
    "--quick", "--freewheel", "--give-back", "--arm", "--read-only", "--json", "-v", "-vv", "-vd2",
    "--verbose", "-h", "--help", "--version", "--", "-", "--accept-line", "--share-group", "-x",
    "--rated-current", "--rated-current=3", "--force-profile", "--pro=1", "-ad2",
)  # fmt: skip
VALUES = (
    "1", "2", "247", "248", "0", "-1", "+2", "02", " 2", "2 ", "1,2", "2_0", "\u0662", "", "1.0",
    "0x2", "1e1", "999999", "2\n", "stop", "run", "atv71", LINE, "tcp:10.0.0.5", "pump",
)  # fmt: skip
WORDS = some.one_of(
    some.sampled_from(OPTIONS), some.sampled_from(VALUES), some.text("-d=1 2ap,\n", max_size=5)
)
LIKELY = some.lists(
    some.sampled_from(
        [("-d", "2"), ("-d3",), ("--device=4",), ("--all",), ("--json",), ("-p", "atv71"), ("-v",)]
    ),
    max_size=4,
).map(lambda parts: [word for part in parts for word in part])


def clicked(words: list[str]) -> dict[str, Any] | None:
    """The parameters that the command itself takes; None for a usage error, or help."""
    with suppress(SystemExit, click.exceptions.Exit, click.ClickException):
        context = main.make_context("drivepanel", list(words))
        name, command, rest = main.resolve_command(
            context, [*context._protected_args, *context.args]
        )
        assert command is not None
        assert name == "stop"
        return command.make_context(name, rest, parent=context).params
    return None


@given(some.one_of(some.lists(WORDS, max_size=7), LIKELY), some.booleans(), some.booleans())
@example(["-d", "2", "-d", "2"], True, False)
@example(["--all", "-d", "2"], True, False)
@example(["--", "-d", "2"], True, False)
@example(["-p", "-v", "-d", "2"], True, False)
@example(["-p", "-d", "-d", "2"], True, False)
def test_short_stop_parses_like_the_command(words: list[str], with_line: bool, first: bool) -> None:
    typed = [LINE] if with_line else []
    words = ["stop", *typed, *words] if first else ["stop", *words, *typed]
    taken = parse_stop(words)
    if taken is None:
        return
    parameters = clicked(words)
    assert parameters is not None
    line, devices = taken
    assert line == parameters["line_text"]
    assert parameters["every"] == (devices == ())
    if devices:
        assert devices == tuple(dict.fromkeys(parameters["device"]))
    for unwanted in ("addresses", "quick", "freewheel", "give_back", "read_only"):
        assert not parameters[unwanted]


@pytest.mark.parametrize(
    ("words", "devices"),
    [
        ((), (1,)),
        (("-d", "2"), (2,)),
        (("-d2", "--device", "3", "--device=4", "-d", "2"), (2, 3, 4)),
        (("--all",), ()),
        (("--all", "-p", "atv71", "--json", "-v"), ()),
        (("--arm", "--accept-line", "-patv71", "--profile=atv71"), (1,)),
    ],
)
def test_short_stop_handles_the_usual_forms(
    words: tuple[str, ...], devices: tuple[int, ...]
) -> None:
    assert parse_stop(["stop", LINE, *words]) == (LINE, devices)
    assert parse_stop(["-v", "stop", *words, LINE]) == (LINE, devices)


@pytest.mark.parametrize(
    "words",
    [
        "--quick", "--freewheel", "--give-back", "--read-only", "--help", "-h", "--addresses 1-3",
        "--all -d 2", "-d 0", "-d 248", "-d 1,2", "-d", "-p", "--share-group g", "another", "--",
    ],
)  # fmt: skip
def test_short_stop_leaves_other_forms_to_the_command(words: str) -> None:
    assert parse_stop(["stop", LINE, *words.split()]) is None


def test_short_stop_without_a_line_uses_the_environment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert parse_stop(["stop", "-d", "2"]) is None
    monkeypatch.setenv("DRIVEPANEL_LINE", "tcp:10.0.0.5")
    assert parse_stop(["stop", "-d", "2"]) == ("tcp:10.0.0.5", (2,))
    assert parse_stop(["stop", LINE]) == (LINE, (1,))
    parameters = clicked(["stop", "-d", "2"])
    assert parameters is not None
    assert parameters["line_text"] == "tcp:10.0.0.5"
    monkeypatch.setenv("DRIVEPANEL_LINE", "")
    assert parse_stop(["stop", "-d", "2"]) is None
    monkeypatch.setenv("_DRIVEPANEL_COMPLETE", "bash_source")
    assert parse_stop(["stop", LINE]) is None


SETTINGS = """
[lines]
pump = "serial:/dev/ttyX1,9600"
[lines.Fan-2]
line = "tcp:10.0.0.5"
device = 5
profile = "atv71"
"""


@pytest.mark.parametrize("broken", ["", "\n[lines.more\n", "\n[other]\n"])
@pytest.mark.parametrize("words", ["", "-d 3", "--all", "-p atv31 -d 5 -d 6"])
@pytest.mark.parametrize("name", ["pump", "PUMP", "fan-2", "more", "factory", "x", "5", "_"])
def test_short_stop_of_a_named_line_parses_like_the_command(
    name: str, words: str, broken: str, own_folders: Path
) -> None:
    (own_folders / "config").mkdir()
    (own_folders / "config" / "settings.toml").write_text(SETTINGS + broken)
    typed = ["stop", name, *words.split()]
    try:
        taken = parse_stop(typed)
    except LinkSyntaxError:
        taken = None
    if name.casefold() in ("pump", "fan-2"):
        parameters = clicked(typed)
        assert parameters is not None
        devices = () if parameters["every"] else parameters["device"]
        assert taken == (parameters["line_text"], devices)
    else:
        assert taken is None or not line_keys(taken[0])[0]


@pytest.mark.parametrize("words", [[], ["run", LINE, "stop"], ["status", "stop"], [LINE], ["-v"]])
def test_short_stop_ignores_other_commands(words: list[str]) -> None:
    assert parse_stop(words) is None


# Which line

HOSTS = """
127.0.0.1 localhost
::1 localhost ip6-localhost
10.0.0.5 Pump pump.plant.   # the old one
10.0.0.6 pump
fe80::1 six
fe80::2 both
10.0.0.7 both
127.1 short
"""
TEXTS = some.one_of(
    some.builds(
        lambda *parts: "".join(parts),
        some.sampled_from(["serial:", "Serial:", "", "tcp:", "TCP:", "rtu-tcp:", "x:", " "]),
        some.sampled_from(
            ["/dev/ttyX0", "/dev/null", "/dev/", "/", "a", "null", "./null", "10.0.0.5",
             "localhost", "PUMP", "pump.plant", "six", "both", "short", "010.0.0.5", "127.1",
             "10.0.0.5.", "256.0.0.1", "[::1]", "other.host", "e", "under_score", "", "a b", "1",
             "\xe9"]
        ),
        some.sampled_from(["", ":502", ":0", ":00502", ":65536", ":x", ":", ":502:1"]),
        some.sampled_from(
            ["", ",19200", ",9600,8N1", ",9600,8n2", ",9600,7E1", ",40", ",x", ",", ",9600,8N1,",
             ", 9600", ",9600,8E1,1", ",8E1", ",\u0661\u0660\u0660\u0660"]
        ),
        some.sampled_from(
            ["", ",timeout=2", ",timeout=0.001", ",timeout=", ",timeout=31", ",TIMEOUT=2",
             ",unit=255", ",unit=0", ",unit=1", ",unit=255,timeout=2", ",timeout=2,unit=0",
             ",timeout=2.5", ",timeout=.5", ",timeout=1e1", ",timeout=2,9600", " "]
        ),
    ),
    some.text("serialtcp:/dv,0192.8EN", max_size=20),
)  # fmt: skip


@pytest.fixture(scope="module")
def hosts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A hosts file of the test."""
    path = tmp_path_factory.mktemp("hosts") / "hosts"
    path.write_text(HOSTS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(line_keys_module, "HOSTS", path)
        patch.setattr(short_stop, "_HOSTS_FILE", str(path))
        yield


@given(TEXTS)
@example("serial:/dev/null,9600,8N1,timeout=2")
@example("tcp:both")
@example("rtu-tcp:PUMP:00502")
@pytest.mark.usefixtures("hosts")
def test_short_stop_line_is_the_line_of_the_command(text: str) -> None:
    keys, real = line_keys(text)
    if not keys:
        return
    assert line_key(text) in keys
    assert not is_name(text)
    link = parse_link(text)
    if isinstance(link, SerialLink):
        assert real == os.path.realpath(link.path)
    else:
        assert not real
        assert len(keys) == 1


@pytest.mark.parametrize(
    "text",
    [
        "/dev/null", "serial:/dev/null,9600", "SERIAL:/dev/null,9600,8n1,timeout=2.5", "tcp:pump",
        "tcp:10.0.0.5", "tcp:10.0.0.5:1502,timeout=2", "rtu-tcp:both:4001", "tcp:other.host",
        "tcp:LOCALHOST.", "tcp:10.0.0.5,unit=255", "tcp:pump:1502,unit=0,timeout=2",
    ],
)  # fmt: skip
@pytest.mark.usefixtures("hosts")
def test_short_stop_handles_the_usual_lines(text: str) -> None:
    assert line_key(text) in line_keys(text)[0]


@pytest.mark.usefixtures("hosts")
def test_short_stop_leaves_other_spellings_to_the_command() -> None:
    texts = ("sim:atv71", "pump", "tcp:[::1]", "tcp:six", "tcp:127.1", "tcp:short", "null", "COM3")
    assert [text for text in texts if line_keys(text)[0]] == []


def test_short_stop_knows_a_port_by_its_lasting_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    links = tmp_path / "serial"
    for kind in ("by-id", "by-path"):
        (links / kind).mkdir(parents=True)
        (links / kind / "one").symlink_to("/dev/null")
        (links / kind / "another").symlink_to("/dev/zero")
    monkeypatch.setattr(short_stop, "_DEVICE_LINKS", str(links))
    expected = ["/dev/null", f"{links}/by-id/one", f"{links}/by-path/one"]
    for typed in (*expected, f"{expected[1]},9600,8E1"):
        keys, real = line_keys(f"serial:{typed}")
        assert keys == [f"serial:{path}" for path in expected]
        assert real == "/dev/null"


# Who holds it


@contextmanager
def held(place: SharePlace, line: str, folder: Path | None = None) -> Iterator[socket.socket]:
    """A lock file as the owner of a line leaves it, and its socket, which listens."""
    lock = OwnerLock(place)
    assert lock.take()
    path = (folder or place.lock_folder) / "one.sock"
    listening = socket.socket(socket.AF_UNIX)
    with closing(listening):
        listening.bind(str(path))
        listening.listen()
        lock.tell(Owner(VERSION, KEEPER_PROGRAM, str(path), 1.5, {3: 2.5}, line, (1.0,)))
        yield listening
        lock.give_back()


def place_of(text: str) -> SharePlace:
    place = share_place(text)
    assert place is not None
    return place


@pytest.mark.parametrize(
    "link", [SerialLink("/dev/null"), TcpLink("10.0.0.5"), RtuTcpLink("other.host", 4001)]
)
def test_short_stop_finds_the_socket_of_the_holder(link: SerialLink | TcpLink | RtuTcpLink) -> None:
    text = label(link)
    assert holder_address(text) == ""
    with held(place_of(text), text) as listening:
        assert holder_address(text) == listening.getsockname()
        assert holder_address("tcp:10.0.0.99") == ""


def test_short_stop_ignores_the_socket_of_a_changed_port(tmp_path: Path) -> None:
    with held(place_of("/dev/null"), "serial:/dev/zero,19200,8E1"):
        assert holder_address("/dev/null") == ""


def test_short_stop_ignores_sockets_of_other_users(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with held(place_of("/dev/null"), "serial:/dev/null,19200,8E1") as listening:
        path = Path(listening.getsockname())
        monkeypatch.setattr("os.getuid", lambda: path.stat().st_uid + 1)
        assert holder_address("/dev/null") == ""
        monkeypatch.undo()
        path.unlink()
        path.touch()
        assert holder_address("/dev/null") == ""


def test_short_stop_finds_the_holder_for_a_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "group"
    folder.mkdir()
    place = SharePlace(line_key("/dev/null"), folder, (folder,), os.getgid())
    with held(place, "serial:/dev/null,19200,8E1") as listening:
        assert stat.S_IMODE(place.lock_path.stat().st_mode) == 0o660
        assert share_place("/dev/null") == place
        assert holder_address("/dev/null") == listening.getsockname()
        monkeypatch.setenv("DRIVEPANEL_SHARE_GROUP", "any")
        assert holder_address("/dev/null") == ""
    # no program can make the lock of a group name another socket
    place.lock_path.unlink()
    with held(place, "serial:/dev/null,19200,8E1", tmp_path):
        monkeypatch.delenv("DRIVEPANEL_SHARE_GROUP")
        assert holder_address("/dev/null") == ""


@pytest.mark.parametrize(
    "environment",
    [
        {}, {"DRIVEPANEL_STATE": "/a"}, {"DRIVEPANEL_STATE": "a"}, {"XDG_STATE_HOME": "/x"},
        {"XDG_STATE_HOME": "x"}, {"XDG_STATE_HOME": ""}, {"HOME": "/h"}, {"XDG_STATE_HOME": "/x/"},
        {"HOME": "/h/"},
    ],
    ids=str,
)  # fmt: skip
def test_short_stop_finds_the_state_folder(
    environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DRIVEPANEL_STATE", "XDG_STATE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert Path(short_stop._state_folder()) == state_folder()


@given(some.text(max_size=60))
def test_short_stop_finds_the_lock_by_its_name(key: str) -> None:
    with suppress(UnicodeEncodeError):
        assert short_stop._lock_name(key) == SharePlace(key, Path("x"), ()).lock_path.name


# The shot


def test_short_stop_reaches_the_holder() -> None:
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        line = f"serial:{simulation.serve_pty()},19200,8N1"
        with closing(open_line(line, wait=10, program="panel")) as opened:
            heard: list[tuple[tuple[int, ...], str]] = []
            on_event(
                opened.line.facts,
                DevicesStopped,
                lambda event: heard.append((event.devices, event.by)),
            )
            stop_at_once(["stop", line, "-d", "2", "-d", "3"])
            # the program of its process, here the panel, is named
            assert heard == [((2, 3), "a direct stop")]


@pytest.mark.parametrize("group", [False, True])
def test_short_stop_remembers_the_starts_that_the_holder_removes(
    group: bool, tmp_path: Path
) -> None:
    if group:
        (tmp_path / "group").mkdir()
    drive = DriveIdentity(1, "", "", "", "", None, ())
    with Simulation([DriveSpec("proxidrive", 1)]) as simulation:
        line = f"serial:{simulation.serve_pty()},19200,8N2"
        starts = Starts()
        starts.begin(starts.record(line, drive, "proxidrive", "forward", program="run"))
        if group:
            shutil.rmtree(starts.folder)
        else:
            (starts.folder / "damaged.json").write_text("{")
            (starts.folder / "a-binary.json").write_bytes(b"\xff")
            (starts.folder / "a-removed.json").symlink_to("nowhere")
        with closing(open_line(line, wait=10, program="panel")):
            stop_at_once(["stop", line])
        starts.note_stop(line, 1)
        assert starts.close()
        assert Starts().newest(line) == {}
        assert Starts().newest(line, short_stop.STARTS)[1].profile == "proxidrive"


@pytest.mark.parametrize("closes", [False, True])
def test_short_stop_without_an_answer_ends_soon(closes: bool) -> None:
    """A holder under SIGSTOP takes the connection, and nothing more."""
    with held(place_of("/dev/null"), "serial:/dev/null,19200,8E1") as listening:
        if closes:
            listening.close()
        begun = time.monotonic()
        stop_at_once(["stop", "/dev/null", "--all"])
        assert time.monotonic() - begun < 5.0
        if not closes:
            connection, _ = listening.accept()
            with closing(connection):
                assert connection.recv(100) == b"STOP all\n"


def test_short_stop_reaches_a_socket_with_a_long_path(tmp_path: Path) -> None:
    folder = tmp_path / ("x" * 100)
    folder.mkdir()
    with closing(socket.socket(socket.AF_UNIX)) as listening:
        with short_path(folder / "one.sock") as address:
            listening.bind(address)
        listening.listen()
        with pytest.raises(TimeoutError):
            short_stop._send(str(folder / "one.sock"), "2")
        connection, _ = listening.accept()
        with closing(connection):
            assert connection.recv(100) == b"STOP 2\n"


@pytest.mark.parametrize("fault", [OSError, ValueError, RecursionError])
def test_short_stop_failure_is_silent(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], fault: type[Exception]
) -> None:
    def fails(_text: str) -> str:
        raise fault

    monkeypatch.setattr(short_stop, "holder_address", fails)
    stop_at_once(["stop", LINE])
    assert capfd.readouterr() == ("", "")


def test_short_stop_imports_no_slow_module() -> None:
    script = (
        "import sys; before = set(sys.modules)\n"
        "from tui.__main__ import main\n"
        "from tui.cli.short_stop import stop_at_once, _digest\n"
        "_digest('x'); import _socket\n"
        "print(*sorted(set(sys.modules) - before))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    allowed = {"__future__", "tui", "tui.__main__", "tui.cli", "tui.cli.short_stop", "_socket"}
    assert set(done.stdout.split()) <= allowed | {"_sha2", "_sha256"}


def test_short_stop_does_not_block_on_a_pipe_instead_of_a_lock(tmp_path: Path) -> None:
    pipe = tmp_path / "line.lock"
    os.mkfifo(pipe)
    assert short_stop._content(str(pipe)) == ""

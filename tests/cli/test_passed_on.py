"""Arguments as commands pass them on, complete: to the panel, a run, a gateway, profiles.

The part that would do the work is replaced, so nothing is opened or drawn.
"""

from __future__ import annotations

import signal
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.cli.commands import invoked
from tests.session import test_changes as records
from tui.cli.commands.run import RunOptions
from tui.cli.plant.publish_options import PublishOptions
from tui.cli.running.serving import GatewayWish, OpenedLine, ServedAt
from tui.cli.shared.options import Target
from tui.session.gateway.rules import GatewayRules
from tui.terminal.abilities import UTF_8

COMMANDS = "tui.cli.commands"

# The panel, and the replay


class Panel:
    """Replaces the panel; keeps its arguments."""

    given: dict[str, Any] = {}

    def __init__(self, **given: Any) -> None:
        self.given.update(given)
        self.return_code = 0

    def run(self) -> None:
        pass


WITHOUT = {
    "read_only": False, "low_bandwidth": False, "leave_running": False, "mouse": False,
    "bell": True,
}  # fmt: skip
WITH = {"low_bandwidth": True, "mouse": True, "bell": False}
ALL = ("--low-bandwidth", "--mouse", "--no-bell", "--ascii")
LEFT = ("--on-hangup", "leave-running")


@pytest.mark.parametrize(
    ("words", "expected", "ascii_only"),
    [
        ((), {"start": None, "device": None, **WITHOUT}, False),
        (("tcp:h", "-d", "3"), {"start": "tcp:h", "device": 3, **WITHOUT}, False),
        (
            ("tcp:h", "--read-only", *LEFT, *ALL),
            {"start": "tcp:h", "device": None, "read_only": True, "leave_running": True, **WITH},
            True,
        ),
        (("demo",), {"start": "demo", "device": None, **WITHOUT}, False),
        (
            ("demo", *LEFT, *ALL),
            {"start": "demo", "device": None, "read_only": False, "leave_running": True, **WITH},
            True,
        ),
    ],
)
def test_options_of_the_panel(
    words: tuple[str, ...],
    expected: dict[str, Any],
    ascii_only: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.stderr", SimpleNamespace(encoding=UTF_8))
    monkeypatch.setattr(f"{COMMANDS}.panel.terminal_trouble", str)
    monkeypatch.setattr("tui.app.DrivePanelApp", Panel)
    done = invoked(*words)
    assert done.exit_code == 0, done.output
    assert {name: Panel.given[name] for name in expected} == expected
    assert (Panel.given["abilities"].encoding == "ascii") is ascii_only


def test_panel_without_a_terminal_or_a_line_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    done = invoked("-d", "3")
    assert (done.exit_code, done.stdout) == (2, "")
    assert "A device is on a line: write LINE -d ADDRESS." in done.stderr
    monkeypatch.setattr(f"{COMMANDS}.panel.terminal_trouble", lambda: "No terminal.")
    assert invoked("tcp:h").stderr == "drivepanel: No terminal.\n"


def test_port_is_opened_with_the_settings_of_its_last_use(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[tuple[Any, ...]] = []
    monkeypatch.setattr(f"{COMMANDS}.panel.run_panel", lambda *words, **_: given.append(words))
    monkeypatch.setattr(f"{COMMANDS}.panel.recent_lines", lambda: ["serial:/dev/x,9600,8N1"])
    named = {"pump": SimpleNamespace(line="serial:/dev/x")}
    for known in ({}, named):
        monkeypatch.setattr(
            "tui.session.connect.named_lines.named_lines", lambda known=known: known
        )
        invoked("serial:/dev/x", "-d", "2")
    assert given == [("serial:/dev/x,9600,8N1", 2), ("serial:/dev/x", 2)]


def test_replay_is_a_line_of_the_panel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        f"{COMMANDS}.replay.run_panel", lambda *words, **how: given.append((*words, how))
    )
    monkeypatch.chdir(tmp_path)
    records.write(Path(), [records.row(second, 3202, 10) for second in range(9)], name="pump")
    (file,) = Path().glob("*.sqlite")
    at = "2024-10-04T22:00:03"
    for words in ((), ("--at", at, "-d", "1", *ALL)):
        done = invoked("replay", str(file), *words)
        assert done.exit_code == 0, done.output
    how = {"low_bandwidth": False, "mouse": False, "bell": True, "ascii": None}
    place = f"replay:{tmp_path / file.name}"
    assert given == [
        (place, None, how),
        (f"{place},at={at}", 1, {"low_bandwidth": True, "mouse": True, "bell": False,
                                 "ascii": True}),
    ]  # fmt: skip
    done = invoked("replay", str(file), "-d", "2")
    assert done.stderr == "drivepanel: Drive 2 is not in the record. Its drives: 1.\n"
    assert done.exit_code == 2
    assert len(given) == 2


# A run


@pytest.mark.parametrize(
    ("words", "options", "read_only"),
    [
        ((), RunOptions("forward", None, None, False, False, False, False), False),
        (
            ("--reverse", "--reference", "20Hz", "--for", "3", "--json", "--read-only"),
            RunOptions("reverse", "20Hz", 3.0, False, False, True, False),
            True,
        ),
        (("--leave-running",), RunOptions("forward", None, None, True, False, False), False),
        (("--unrecorded",), RunOptions("forward", None, None, False, True, False), False),
        (("--take-control",), RunOptions("forward", None, None, False, False, False, True), False),
    ],
)
def test_options_of_a_run(
    words: tuple[str, ...],
    options: RunOptions,
    read_only: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given: list[Any] = []

    def on_line(target: Target, work: Callable[[str], None], *, read_only: bool) -> None:
        given.append((target, read_only))
        work("the line")

    monkeypatch.setattr(f"{COMMANDS}.run.on_line", on_line)
    monkeypatch.setattr(f"{COMMANDS}.run.run_motor", lambda *words: given.append(words))
    done = invoked("run", "sim:atv71@2", "-d", "2", "-p", "atv71", "--arm", *words)
    assert done.exit_code == 0, done.output
    target = Target("sim:atv71@2", 2, "atv71")
    assert given == [(target, read_only), ("the line", target, options)]


# A service


def served(
    words: Sequence[str], places: ServedAt, monkeypatch: pytest.MonkeyPatch, ended_by: int
) -> tuple[int, str, dict[str, Any]]:
    """Exit status and output of `serve`, and what it would serve."""
    given: dict[str, Any] = {}

    async def serves(
        opened: list[OpenedLine], wish: GatewayWish | None, plant: PublishOptions | None,
        _: object, ready: Callable[[ServedAt], str],
    ) -> int:  # fmt: skip
        given.update(opened=opened, wish=wish, plant=plant, status=ready(places))
        return ended_by

    monkeypatch.setattr(f"{COMMANDS}.serve.served_until_signal", serves)
    done = invoked("serve", *words)
    return done.exit_code, done.output, given


GATEWAY = ServedAt("tcp:127.0.0.1:1502", None, None)


@pytest.mark.parametrize(
    ("words", "rules", "text"),
    [
        ((), GatewayRules(0.0, frozenset(), commands=False), "reads only"),
        (
            ("--allow-writes", "HSP,ACC", "--fresh", "2"),
            GatewayRules(2.0, frozenset({"ACC", "HSP"}), commands=False),
            "reads and writes of ACC, HSP",
        ),
        (("--allow-commands",), GatewayRules(0.0, frozenset(), commands=True),
         "reads and commands"),
        (
            ("--allow-writes", "all", "--allow-commands"),
            GatewayRules(0.0, frozenset({"all"}), commands=True),
            "reads, writes of all and commands",
        ),
    ],
)  # fmt: skip
def test_rules_of_a_gateway(
    words: tuple[str, ...], rules: GatewayRules, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    typed = ("sim:atv71@1,atv312@2", "--tcp", "127.0.0.1:1502", "--map", "7=1@2", *words)
    status, output, given = served(typed, GATEWAY, monkeypatch, signal.SIGTERM)
    assert status == 0
    reached = f"sim:atv71@1,atv312@2; Modbus TCP at tcp:127.0.0.1:1502, {text}"
    assert (given["status"], output) == (reached, f"Ready: {reached}. Ctrl-C ends it.\n")
    assert given["wish"] == GatewayWish("127.0.0.1", 1502, {7: (0, 2)}, rules)
    assert given["plant"] is None
    assert [(line.name, line.drives) for line in given["opened"]] == [("sim:atv71@1,atv312@2", [])]


def test_places_of_a_service_that_publishes(monkeypatch: pytest.MonkeyPatch) -> None:
    places = ServedAt(None, "http://127.0.0.1:9/metrics", "mqtt://b:1883/plant")
    words = [
        "sim:atv71@1,atv312@2", "sim:atv31@4", "--metrics", ":9", "--mqtt", "mqtt://b/plant",
        "--every", "2",
    ]  # fmt: skip
    status, output, given = served(words, places, monkeypatch, signal.SIGINT)
    assert status == 130
    assert output == (
        "Ready: sim:atv71@1,atv312@2, sim:atv31@4; metrics at http://127.0.0.1:9/metrics;"
        " values to mqtt://b:1883/plant. Ctrl-C ends it.\n"
    )
    assert given["wish"] is None
    assert (given["plant"].metrics, given["plant"].every) == (("127.0.0.1", 9), 2.0)
    assert given["plant"].broker.root == "plant"
    drives = [[target.device for target in line.drives] for line in given["opened"]]
    assert drives == [[1, 2], [4]]


@pytest.mark.parametrize("ended_by", [signal.SIGINT, signal.SIGHUP])
def test_document_of_a_service(ended_by: int, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("sim:atv71", "--tcp", ":1502", "--allow-writes", "HSP,ACC", "--allow-commands")
    status, output, _ = served((*words, "--json"), GATEWAY, monkeypatch, ended_by)
    assert status == 128 + ended_by
    assert output == (
        '{"schema": 1, "command": "serve", "event": "ready", "lines": ["sim:atv71"],'
        ' "tcp": "tcp:127.0.0.1:1502", "metrics": null, "mqtt": null,'
        ' "writes": ["ACC", "HSP"], "commands": true}\n'
    )


@pytest.mark.parametrize("as_json", [False, True])
def test_drives_and_codes_that_are_published(
    as_json: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Any] = []

    @asynccontextmanager
    async def published_to(lines: Any, broker: Any, changes: Any) -> AsyncIterator[str]:
        given.extend((lines, broker.host, changes))
        yield "mqtt://b:1883/plant"

    @asynccontextmanager
    async def reading(lines: Any) -> AsyncIterator[None]:
        given.append(lines)
        yield

    async def at_once() -> None:
        pass

    monkeypatch.setattr("tui.cli.plant.drives.PlantDrive", lambda *found: found)
    monkeypatch.setattr("tui.cli.plant.publishing.published_to", published_to)
    monkeypatch.setattr("tui.cli.plant.publishing.reading", reading)
    ever = SimpleNamespace(Event=lambda: SimpleNamespace(wait=at_once))
    monkeypatch.setattr(f"{COMMANDS}.publish.asyncio", ever)
    words = ("sim:atv71@1", "sim:atv31@4,atv312@5", "RFR", "--mqtt", "mqtt://b", "--every", "2")
    done = invoked("publish", *words, *(("--json",) if as_json else ()))
    assert done.exit_code == 0, done.output
    assert done.stdout == (
        '{"schema": 1, "command": "publish", "event": "ready", "mqtt": "mqtt://b:1883/plant"}\n'
        if as_json
        else "Ready: values to mqtt://b:1883/plant. Ctrl-C ends it.\n"
    )
    lines, host, changes, read = given
    assert (host, read) == ("b", lines)
    assert [line.name for line in lines] == ["sim:atv71@1", "sim:atv31@4,atv312@5"]
    drives = [
        (opened.text, target.device, codes, every, changed is changes)
        for line in lines
        for opened, target, codes, every, changed in line.drives
    ]
    assert drives == [
        ("sim:atv71@1", 1, ("RFR",), 2.0, True),
        ("sim:atv31@4,atv312@5", 4, ("RFR",), 2.0, True),
        ("sim:atv31@4,atv312@5", 5, ("RFR",), 2.0, True),
    ]


# Profiles, and the page for the customer


PROFILE_RUNS = {
    ("--check", "a", "b", "c", "--json"): ("check_files", [Path("a"), Path("b"), Path("c")], True),
    ("--prove", "a", "b"): ("prove_files", [Path("a"), Path("b")], False),
    ("--prove", "a", "--line", "L", "--arm", "-d", "4", "--json"): (
        "prove_on_line", Path("a"), (), Target("L", 4, None), "accept_test", True,
        {"without_motor": False},
    ),
    ("--prove", "a", "b", "--line", "L", "--arm", "--without-motor"): (
        "prove_on_line", Path("a"), ("b",), Target("L", 1, None), "accept_test", False,
        {"without_motor": True},
    ),
    ("new", "mine", "--from", "atv71"): (
        "begin_profile", ("mine",), "atv71", None, None, (), False,
    ),
    ("new", "mine", "--from-csv", "t", "--address-rule", "x", "--address-rule", "y", "--json"): (
        "begin_profile", ("mine",), None, Path("t"), None, ("x", "y"), True,
    ),
    ("new", "mine", "--from-eds", "e"): (
        "begin_profile", ("mine",), None, None, Path("e"), (), False,
    ),
    ("confirm", "atv71", "L", "ACC", "DEC", "-d", "4"): (
        "confirm_profile", Target("L", 4, "atv71"), ["ACC", "DEC"], None,
        {"force": False, "as_json": False},
    ),
    ("confirm", "atv71", "L", "--to", "new", "--force", "--json"): (
        "confirm_profile", Target("L", 1, "atv71"), [], Path("new"),
        {"force": True, "as_json": True},
    ),
}  # fmt: skip
"""By the words of `profiles`: the function that does the work, and its arguments."""


@pytest.mark.parametrize("words", PROFILE_RUNS, ids=" ".join)
def test_arguments_of_profiles(words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []

    def function(name: str) -> Callable[..., int]:
        def take(*found: Any, **how: Any) -> int:
            plain = ["accept_test" if callable(item) else item for item in found]
            given.extend((name, *plain, *([how] if how else [])))
            return 3

        return take

    places = {"new_profile": ["begin_profile"], "confirming": ["confirm_profile"],
              "profile_proof": ["check_files", "prove_files", "prove_on_line"]}  # fmt: skip
    for module, names in places.items():
        for name in names:
            monkeypatch.setattr(f"tui.cli.running.{module}.{name}", function(name))
    done = invoked("profiles", *words)
    assert tuple(given) == PROFILE_RUNS[words], done.output
    assert done.exit_code == (3 if words[0] == "confirm" else 0)


PAGES = {
    ("a.md", "--page"): (Target("L", 1, None), Path("a.md"), None, False, None, False, False),
    ("a.HTM", "-d", "2", "-d", "3", "--tests", ".", "--force", "--json"): (
        Target("L", 2, None, others=(3,)), Path("a.HTM"), Path("."), False, None, True, True,
    ),
    ("a.html", "--all", "--addresses", "1-3", "-p", "atv71"): (
        Target("L", 1, "atv71"), Path("a.html"), None, True, "1-3", False, False,
    ),
}  # fmt: skip


@pytest.mark.parametrize("words", PAGES, ids=" ".join)
def test_arguments_of_a_page(words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []

    def writer(*found: Any) -> Any:
        given.append(found)
        return SimpleNamespace(write=lambda: 4)

    monkeypatch.setattr("tui.cli.running.customer_page.PageWriter", writer)
    done = invoked("report", "L", *words)
    assert given == [PAGES[words]], done.output
    assert done.exit_code == 4

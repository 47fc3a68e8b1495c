"""`drivepanel watch` over several lines: the line of each value, and the effect of one line on
others.
"""

from __future__ import annotations

import csv
import json
import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
import pytest

from tests.programs import DRIVEPANEL, end_keepers, port_of, served, simulated
from tui.cli.commands.watch import watch
from tui.cli.shared.options import Target
from tui.cli.shared.several_lines import LineWish, further_lines, lines_wished, split_addresses
from tui.session.connect.named_lines import settings_file

from .commands import ended, refused, run, tcp_line

pytestmark = pytest.mark.long

SHORT = ("--every", "0.1", "--count")
NOBODY = "tcp:127.0.0.1:9,timeout=0.2"


@pytest.fixture
def named() -> Iterator[tuple[str, str]]:
    """The lines `pump`, with the drives 1 and 2, and `fan`, whose drive is 5; written out."""
    with ExitStack() as stack:
        pump = stack.enter_context(tcp_line("atv71@1", "atv312@2"))
        fan = stack.enter_context(tcp_line("atv71@1", "atv71@5"))
        settings(pump, fan)
        yield pump, fan


def settings(pump: str, fan: str) -> None:
    path = settings_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    text = f'[lines]\npump = "{pump}"\n[lines.fan]\nline = "{fan}"\ndevice = 5\nprofile = "atv71"\n'
    path.write_text(text, "utf-8")


def objects(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


def sockets() -> list[str]:
    """Sockets and notes of stops in the state folder."""
    state = Path(os.environ["DRIVEPANEL_STATE"])
    return [path.name for path in state.rglob("*.s*") if path.suffix in (".sock", ".stop")]


# Where a value is from


def test_every_output_names_the_line_of_a_value(named: tuple[str, str], tmp_path: Path) -> None:
    pump, fan = named
    file = tmp_path / "run.csv"
    watched = ("watch", "pump@1,2", "fan", "ETA", *SHORT, "1")
    reported = objects(run(0, *watched, "--json", "--csv", file))
    drives = [(pump, 1, "atv71"), (pump, 2, "atv312"), (fan, 5, "atv71")]
    assert sorted((item["line"], item["device"], item["profile"]) for item in reported) == sorted(
        drives
    )
    with file.open(newline="", encoding="utf-8") as opened:
        rows = list(csv.DictReader(opened))
    assert sorted((row["line"], row["device"], row["ETA"]) for row in rows) == [
        ("fan", "5", "16#0250"), ("pump", "1", "16#0250"), ("pump", "2", "16#0240"),
    ]  # fmt: skip
    text = run(0, *watched)
    for who in ("pump  device 1", "pump  device 2", "fan  device 5"):
        assert text.count(who) == 1


def test_same_address_on_two_lines_is_two_drives(named: tuple[str, str]) -> None:
    reported = objects(run(0, "watch", "pump@1", "fan@1", "ETA", *SHORT, "2", "--json"))
    assert sorted(row["line"] for row in reported) == sorted(2 * named)
    assert {row["device"] for row in reported} == {1}


def test_simulated_lines_are_watched_with_all_their_drives() -> None:
    reported = objects(
        run(0, "watch", "sim:atv71@3", "sim:atv312@2,atv71@7", *SHORT, "1", "--json")
    )
    assert sorted((row["line"], row["device"]) for row in reported) == [
        ("sim:atv312@2,atv71@7", 2), ("sim:atv312@2,atv71@7", 7), ("sim:atv71@3", 3),
    ]  # fmt: skip


# What one line costs the others


def test_missing_line_is_reported_and_does_not_affect_others(
    named: tuple[str, str],
) -> None:
    done = ended(3, "watch", NOBODY, "fan", "ETA", *SHORT, "2", "--json")
    missing, *cycles = objects(done.stdout)
    assert (missing["line"], missing["device"], missing["status"]) == (NOBODY, 1, 3)
    assert f"drivepanel: {NOBODY}: Device 1: " in done.stderr
    assert [(cycle["line"], cycle["error"]) for cycle in cycles] == 2 * [(named[1], None)]


def test_absent_drive_is_reported_with_its_line(named: tuple[str, str]) -> None:
    done = ended(3, "watch", "pump@1,9", "fan", "ETA", *SHORT, "1")
    assert "drivepanel: pump: Device 9 did not answer" in done.stderr
    assert "pump  device 1" in done.stdout
    assert "fan  device 5" in done.stdout


@pytest.mark.sweep
def test_lost_line_does_not_stop_others_and_ctrl_c_ends_all() -> None:
    with simulated("atv71@1", "--tcp", "127.0.0.1:0") as first, tcp_line("atv71@5") as fan:
        settings(f"tcp:127.0.0.1:{port_of(first.ready)},timeout=0.2", fan)
        command = ("watch", "pump", "fan", "ETA", "--every", "0.1", "--json")
        with served([*DRIVEPANEL, *command], ready='"error": null') as watching:
            assert watching.process.stdout is not None
            assert len(sockets()) == 2
            first.end()
            lost, going_on = 0, 0
            while lost < 3 or going_on < 3:
                reported = json.loads(watching.process.stdout.readline())
                lost += reported["error"] is not None and reported["device"] == 1
                going_on += lost > 0 and reported["error"] is None and reported["device"] == 5
            status, output = watching.end(signal.SIGINT)
    assert status == 130
    assert "drivepanel: pump: " in output
    assert "Ended by Ctrl-C after" in output
    assert "Traceback" not in output
    end_keepers()
    assert sockets() == []


# Which words are LINEs, and which drives are meant


def wished(*words: str) -> list[LineWish]:
    """Drives that `watch` is to watch."""
    context = watch.make_context("watch", list(words))
    with context:
        params = context.params
        first, *others = params["device"]
        target = Target(params["line_text"], first, params["profile_id"], others=tuple(others))
        return lines_wished(target, further_lines(params["codes"])[0])


def drives(wishes: list[LineWish]) -> list[tuple[str, list[int], list[str | None]]]:
    return [
        (wish.name, [d.device for d in wish.drives], [d.profile_id for d in wish.drives])
        for wish in wishes
    ]


@pytest.mark.parametrize(
    ("words", "intended"),
    [
        (("pump",), [("pump", [1], [None])]),
        (("fan",), [("fan", [5], ["atv71"])]),
        (("pump", "fan"), [("pump", [1], [None]), ("fan", [5], ["atv71"])]),
        # -d and -p override a name; an address at a LINE overrides -d
        (("pump", "fan", "-d", "3"), [("pump", [3], [None]), ("fan", [3], [None])]),
        (("pump@1-2,7", "fan", "-d", "3"), [("pump", [1, 2, 7], 3 * [None]), ("fan", [3], [None])]),
        (("pump", "fan", "-p", "atv31"), [("pump", [1], ["atv31"]), ("fan", [5], ["atv31"])]),
        (("fan@5", "pump"), [("fan", [5], ["atv71"]), ("pump", [1], [None])]),
        # a line that is named twice is opened once, the profile holds for its own drive alone
        (("fan", "FAN@2,5"), [("fan", [5, 2], ["atv71", None])]),
        (("tcp:127.0.0.1@4",), [("tcp:127.0.0.1", [4], [None])]),
        (("tcp:[::1]:502,timeout=2@4",), [("tcp:[::1]:502,timeout=2", [4], [None])]),
    ],
)  # fmt: skip
def test_drives_are_selected_by_line_and_address(
    words: tuple[str, ...], intended: list[tuple[str, list[int], list[str | None]]]
) -> None:
    settings("tcp:10.0.0.1", "tcp:10.0.0.2")
    assert drives(wished(*words)) == intended


def test_line_with_an_address_overrides_the_environment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings("tcp:10.0.0.1", "tcp:10.0.0.2")
    monkeypatch.setenv("DRIVEPANEL_LINE", "pump@4")
    assert drives(wished("ETA")) == [("pump", [4], [None])]
    assert drives(wished("fan@2", "ETA")) == [("fan", [2], [None])]


def test_lines_come_before_codes() -> None:
    settings("tcp:10.0.0.1", "tcp:10.0.0.2")
    assert further_lines(["fan", "/dev/ttyUSB0@3", "ETA", "fan"]) == (
        ("fan", "/dev/ttyUSB0@3"), ("ETA", "fan")
    )  # fmt: skip
    assert further_lines(["ETA", "1.05", "16#FD00"]) == ((), ("ETA", "1.05", "16#FD00"))
    with pytest.raises(click.UsageError, match="before the first CODE"):
        further_lines(["ETA", "tcp:10.0.0.3"])


def test_file_named_like_a_code_is_not_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ETA").touch()
    assert further_lines(["ETA"]) == ((), ("ETA",))


def test_at_sign_in_a_port_or_simulated_line_is_not_an_address(tmp_path: Path) -> None:
    port = tmp_path / "tty@1"
    port.touch()
    for line in (str(port), f"{port},9600", "sim:atv71@2", "tcp:host", "pump@x"):
        assert split_addresses(line) == (line, "")
    assert split_addresses(f"{port}@4") == (str(port), "4")


def test_impossible_line_opens_no_line_and_exits_with_2(named: tuple[str, str]) -> None:
    assert "1 to 247" in refused(2, "watch", "pump@300", "fan", *SHORT, "1")
    refused(2, "watch", "pump", "tcp:host:port", *SHORT, "1")
    assert "no parameter 'NOSUCH'" in refused(2, "watch", "pump", "fan", "NOSUCH", *SHORT, "1")

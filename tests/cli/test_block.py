"""Indirect blocks and scanner on the command line: output, writes, and exit statuses."""

from __future__ import annotations

import asyncio
import json
import re
import signal
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from tests.sweeps import kept
from tui.bus.errors import LineLost
from tui.drive.profile.schema import Parameter
from tui.session.settings.write import Writer

from . import commands
from .commands import tcp_line

pytestmark = pytest.mark.long

LONELY = ["atv31", "atv312", "powerdrive", "proxidrive", "varmeca"]


@pytest.fixture
def line() -> Iterator[str]:
    """A simulated Altivar 71 at address 2 that several commands in turn can reach."""
    with tcp_line("atv71@2") as line:
        yield line


def run(status: int, *arguments: str | Path) -> str:
    """Run `block` to this exit status; return its standard output."""
    return commands.run(status, "block", *arguments)


def refused(status: int, *arguments: str | Path) -> str:
    """Standard error of `block`; errors of an assignment come before the refusal."""
    output = commands.ended(status, "block", *arguments).stderr
    assert "drivepanel: " in output
    return output


def slots(text: str) -> dict[str, Any]:
    return {slot["slot"]: slot for b in json.loads(text)["blocks"] for slot in b["slots"]}


def test_block_is_set_shown_verified_saved_loaded_and_reset(line: str, tmp_path: Path) -> None:
    drive, file = ("-d", "2"), tmp_path / "scanner.toml"
    shown = run(0, line, *drive)
    assert re.search(r"NMA1 +ETA", shown)
    assert re.search(r"NMA3 to NMA8 +unused", shown)
    assert "W8604" in shown
    assert "8604 (16#219C)" in shown
    assert "Request: 02 03 31 C5 00 02" in shown
    dry = run(0, line, "set", "NMA3=LCR", "nma1=w8604", "NMA2=3201", "--dry-run", *drive)
    assert "write  NMA1: ETA -> RFRD" in dry
    assert slots(run(0, line, "--json", *drive))["NMA1"]["code"] == "ETA"
    done = run(0, line, "set", "NMA3=LCR", "nma1=w8604", "NMA2=3201", "--arm", *drive)
    assert "Wrote NMA1, NMA2, NMA3, all verified." in done
    assert "Lost at power-off until saved" in done
    found = slots(run(0, line, "verify", "--json", *drive))
    assert [found[s]["code"] for s in ("NMA1", "NMA2", "NMA3", "NMA4")] == [
        "RFRD", "ETA", "LCR", None,
    ]  # fmt: skip
    assert found["NMA2"]["direct"]["raw"] == found["NMA2"]["raw"]
    assert {s["verdict"] for s in found.values()} <= {"same", "moving", "unused"}
    assert "16 slots" in run(0, line, "save", file, *drive)
    assert 'NMA3 = "LCR"  # W3204' in file.read_text()
    refused(2, line, "save", file, *drive)
    assert "NMA1, NMA2, NMA3" in run(0, line, "factory", "--arm", *drive)
    assert "Nothing to change" in run(0, line, "factory", "--arm", *drive)
    assert "NMA1, NMA2, NMA3" in run(0, line, "load", file, "--arm", *drive)
    assert slots(run(0, line, "--json", *drive))["NMA3"]["code"] == "LCR"


def test_json_after_a_write_is_one_document(line: str) -> None:
    done = run(0, line, "set", "NCA3=ACC", "--arm", "--json", "-d", "2")
    reported = json.loads(done)
    assert {b["id"] for b in reported["blocks"]} == {"scanner-read", "scanner-write"}
    assert slots(done)["NCA3"]["code"] == "ACC"
    costs = reported["monitoring_us"]
    assert 0 < costs["with_blocks"] <= costs["direct"]


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (("set", "NMA3=LCR"), 5, "Not armed"),
        (("factory",), 5, "Not armed"),
        (("set", "NMA9=LCR", "--arm"), 2, "no slot"),
        (("set", "NCA3=ETA", "--arm"), 2, "can only be read"),
        (("set", "NCA3=CMD", "--arm"), 2, "already in NCA1"),
        (("set", "NCA3=CMD", "--dry-run"), 2, "already in NCA1"),
        (("set", "NMA3=LCR", "--arm", "--read-only"), 5, "read-only"),
        (("set", "NMA3=NOPE", "--arm"), 2, "no parameter"),
        (("set", "NMA3", "--arm"), 2, "SLOT=CODE"),
        (("set", "--arm"), 2, "set needs"),
        (("show", "NMA3"), 2, "no further words"),
        (("load", "no-such-file.toml", "--arm"), 2, "cannot be read"),
        (("look",), 2, "look"),
    ],
)
def test_refusal_has_its_exit_status(arguments: tuple[str, ...], status: int, says: str) -> None:
    assert says in refused(status, "sim:atv71", *arguments)


def test_bad_file_is_refused_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    run(0, "sim:atv71", "save", file)
    text = file.read_text()
    file.write_text(text.replace('NMA2 = "RFRD"', 'NMA2 = "NOPE"'))
    number = next(n for n, x in enumerate(text.splitlines(), 1) if x.startswith("NMA2"))
    assert f"bad.toml:{number}: NMA2" in refused(2, "sim:atv71", "load", file, "--arm")


def test_drive_that_does_not_answer_exits_with_3() -> None:
    assert "answer" in refused(3, "sim:atv71@2", "-d", "9", "-p", "atv71")


def test_running_motor_keeps_its_assignment() -> None:
    with tcp_line("atv71@2", "--run", "30") as line:
        output = refused(5, line, "set", "NMA3=LCR", "--arm", "-d", "2")
        assert "only with the motor stopped" in output
        assert "Nothing was written" in output


def test_write_cut_by_signal_is_reported_by_slot(
    line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Slots written by then were not reported."""
    came = nullcontext([signal.SIGTERM])
    monkeypatch.setattr("tui.cli.shared.signals.cancelled_by_signal", lambda _: came)
    fail_write(monkeypatch, "NMA4", asyncio.CancelledError())
    output = refused(143, line, "set", "NMA3=LCR", "NMA4=OTR", "NMA5=THD", "--arm", "-d", "2")
    assert "Slots written and verified: NMA3. NMA4 may have been written too: look at it." in output


def test_line_lost_during_a_write_is_not_a_refusal(
    line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    fail_write(monkeypatch, "NMA4", LineLost("The owner ended."))
    output = refused(3, line, "set", "NMA3=LCR", "NMA4=OTR", "--arm", "-d", "2")
    assert "NMA4 was not accepted: The owner ended. Already written: NMA3." in output


def fail_write(monkeypatch: pytest.MonkeyPatch, code: str, error: BaseException) -> None:
    """Let the writing of one parameter end in an error, before anything is sent."""
    honest = Writer.write_parameter

    async def failing(self: Writer, parameter: Parameter, raw: int, **how: Any) -> None:
        if parameter.code == code:
            raise error
        await honest(self, parameter, raw, **how)

    monkeypatch.setattr(Writer, "write_parameter", failing)


def test_indirect_block_takes_effect_after_a_reset() -> None:
    with tcp_line("atv21@1") as line:
        done = run(0, line, "set", "F875=FD01", "F876=FD00", "--arm", "-p", "atv21")
        assert "Takes effect after the drive's next reset" in done
        found = slots(run(1, line, "verify", "--json", "-p", "atv21"))
        assert found["F875"]["force"] == "pending"
        assert found["F875"]["verdict"] in ("differs", "no value")
        assert "cannot be read" in run(0, line, "-p", "atv21")


@pytest.mark.parametrize("family", kept(LONELY, *LONELY[:2]))
def test_family_without_blocks_says_so_and_shows_neighbors(family: str) -> None:
    line = f"sim:{family}"
    text = run(0, line, "-p", family)
    assert "neither an indirect block nor a communication scanner" in text
    assert "words from" in text
    reported = json.loads(run(0, line, "--json", "-p", family))
    assert reported["blocks"] == []
    assert all(r["us"] < r["one_by_one_us"] and r["count"] >= 2 for r in reported["reads"])
    refused(5, line, "verify", "-p", family)
    refused(5, line, "factory", "--arm", "-p", family)

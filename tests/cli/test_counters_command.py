"""`drivepanel counters`: its output, its status, and its limits."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tui.bus.errors import DeviceException, LineError, NoAnswer
from tui.session.counters.watch import CounterWatch

from .commands import ended, tcp_line


def counted(status: int, *words: str) -> Any:
    return json.loads(ended(status, "counters", *words, "--json").stdout)


def test_good_line_exits_with_0() -> None:
    reported = counted(0, "sim:atv71", "--frames", "7")
    assert reported["test"] == {"frames": 7, "answered": 7}
    assert reported["agree"] is True
    assert reported["differences"] == []
    names = {item["name"]: item for item in reported["drive"]}
    assert names["function 8"]["counts_this_line"] is True
    assert names["Modbus network"]["counts_this_line"] is True
    assert names["Keypad port"]["frames"] == 0
    assert (
        sum(item["count"] for item in reported["ours"]["turnarounds"])
        == reported["ours"]["replies"]
    )
    assert reported["since_opened"]["frames"] > reported["ours"]["frames"]
    minutes = reported["last_minute"]
    assert minutes["line"]["share"] == minutes["device"]["share"] == 1.0
    assert minutes["device"]["good"] == reported["since_opened"]["replies"]
    assert (minutes["line"]["foreign"], minutes["line"]["strays"]) == (0, 0)


def test_lost_replies_are_reported_and_exit_with_1() -> None:
    with tcp_line("atv71@2", "--line-fault", "lost=0.2", "--seed", "3") as line:
        reported = counted(1, line, "-d", "2", "--frames", "10")
        (found,) = reported["differences"]
        assert found["kind"] == "not-answered"
        assert found["count"] >= 1
        assert found["text"].startswith("The drive received ")
        own = reported["last_minute"]["device"]
        assert own["lost"] + own["silent"] >= 1
        assert own["share"] < 1.0


def test_drive_without_counters_is_not_compared() -> None:
    done = ended(0, "counters", "sim:atv312", "--frames", "3")
    assert "reports no counters of its own" in done.stdout
    assert counted(0, "sim:atv312", "--frames", "3")["agree"] is None


@pytest.mark.parametrize(
    ("error", "status"), [(NoAnswer(1, 8, 0, "No answer."), 3), (DeviceException(1, 8, 0, 1), 4)]
)
def test_counters_that_cannot_be_read_are_no_difference(
    error: LineError, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def fail(watch: CounterWatch) -> None:
        raise error

    monkeypatch.setattr(CounterWatch, "_look_by_diagnostics", fail)
    found = counted(status, "sim:atv71", "--frames", "1")
    assert found["agree"] is None
    assert found["trouble"]


def test_counters_of_a_drive_are_reset_only_if_armed_and_available() -> None:
    with tcp_line("atv71@2") as line:
        assert "Not armed" in ended(5, "counters", line, "-d", "2", "--reset-drive").stderr
        before = counted(0, line, "-d", "2")["drive"][0]["frames"]
        after = counted(0, line, "-d", "2", "--reset-drive", "--arm", "--frames", "0")
        assert after["drive"][0]["frames"] < before
        assert after["reset"] is True
        (entry,) = json.loads(ended(0, "journal", "--json").stdout)["entries"]
        assert (entry["kind"], entry["code"], entry["answer"]) == ("reset", "function 8, 0A", "ok")
        assert "function 8, 0A: the drive's own counters" in ended(0, "journal").stdout
        refused = ended(5, "counters", line, "-d", "2", "--reset-drive", "--arm", "--read-only")
        assert "read-only" in refused.stderr
    lacking = ended(5, "counters", "sim:atv312", "--reset-drive", "--arm")
    assert "no such command" in lacking.stderr

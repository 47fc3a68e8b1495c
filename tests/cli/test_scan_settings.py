"""A scan at several settings of a line: which are tried, and what is reported in that time."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import pytest

from tui.bus.errors import PortRefused
from tui.bus.fake import FakeLine
from tui.bus.link import SerialLink
from tui.bus.program import Program
from tui.cli.running.scan_telling import ScanTelling
from tui.cli.running.scanning import Scan
from tui.drive.finding import LineSetting
from tui.session.connect.open_line import OpenLine

FIRST, SECOND = LineSetting(19200, "8E1"), LineSetting(9600, "8N1")
LISTENING = "drivepanel: Listening for 0.01 s before the first request."
HIT = "  3  {}   answers, but does not identify itself"
ACTS = "Device 3: its timeout reaction is not known."
HELD_BACK = (
    "No other setting is tried: polling of these drives would stop. Use --yes to try anyway."
    f"\n{ACTS}"
)
BUSY = "No other setting is tried: panel (pid 7) uses the line now."


def line_at(link: SerialLink) -> FakeLine:
    """A line with an unknown drive that answers at any setting."""
    line = FakeLine({3: {1: 0}}, link=link)
    line.fail_identify(3, 1)
    return line


@pytest.mark.parametrize(
    ("settings", "options", "tried", "held_back", "notes"),
    [
        ([FIRST], "", [FIRST], "", []),
        ([FIRST, SECOND], "", [FIRST], HELD_BACK, [HELD_BACK]),
        ([FIRST, SECOND], "yes", [FIRST, SECOND], "",
         [f"At other settings these drives are not polled.\n{ACTS}"]),
        ([FIRST, SECOND], "yes refused", [FIRST], "",
         [f"At other settings these drives are not polled.\n{ACTS}",
          "9600 8N1 is not tried: /dev/null cannot be opened: the port refused"]),
        ([FIRST, SECOND], "yes busy", [FIRST], BUSY, [BUSY]),
    ],
    ids=["one setting", "a drive may react", "confirmed", "refused by the port", "line in use"],
)  # fmt: skip
async def test_other_settings_are_tried_only_if_no_drive_may_react(
    settings: list[LineSetting], options: str, tried: list[LineSetting], held_back: str,
    notes: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 0.01)
    monkeypatch.setattr("tui.session.diagnosis.asking.FRAMES_COME_WITHIN", 0.01)

    def again(link: SerialLink) -> FakeLine:
        if "refused" in options:
            raise PortRefused("/dev/null", "the port refused")
        return line_at(link)

    link = SerialLink("/dev/null", 19200, "8E1")
    opened = OpenLine("/dev/null", line_at(link), again=again)
    listens = "busy" not in options
    if not listens:
        opened.line.facts.programs += (Program("id", "panel", 7),)
    scan = Scan(
        opened, "/dev/null", [2, 3], ScanTelling("/dev/null", as_json=False), [*settings],
        yes="yes" in options,
    )  # fmt: skip
    await scan.run()
    assert (scan.tried, scan.held_back, scan.done) == (tried, held_back, True)
    assert scan.setting == tried[-1]
    assert [(hit.setting, hit.identity.device) for hit in scan.hits] == [(s, 3) for s in tried]
    output = capsys.readouterr()
    assert output.out.splitlines() == [HIT.format(f"{setting!s:<9}") for setting in tried]
    families, *reported = output.err.splitlines()
    assert families.startswith("drivepanel: Drives of these families start")
    expected = [LISTENING, *(f"drivepanel: {note}" for note in notes)][not listens :]
    assert "\n".join(reported) == "\n".join(expected)


@pytest.mark.parametrize("before", [[FIRST], [FIRST, SECOND]])
async def test_slow_settings_are_announced_once_before_the_first_of_them(
    before: list[LineSetting], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 0.01)
    monkeypatch.setattr("tui.session.diagnosis.asking.FRAMES_COME_WITHIN", 0.01)
    slow_ones = [LineSetting(baud, "8N1") for baud in (600, 300, 110)]
    settings = [*before, *slow_ones]
    announced: list[tuple[list[LineSetting], str]] = []

    def before_slow(later: list[LineSetting], key: str) -> str:
        announced.append(([*later], key))
        return "These are slow."

    costs: Any = SimpleNamespace(before_slow=before_slow, seconds=lambda later: 10.0 * len(later))
    opened = OpenLine(
        "/dev/null",
        FakeLine({}, link=SerialLink("/dev/null", 19200, "8E1")),
        again=lambda link: FakeLine({}, link=link),
    )
    telling = ScanTelling("/dev/null", as_json=True)
    scan = Scan(opened, "/dev/null", [2, 3], telling, [*settings], costs)
    await scan.run()
    assert (scan.tried, scan.hits, scan.held_back) == (settings, [], "")
    assert announced == [(slow_ones, "Ctrl-C")]
    output = capsys.readouterr()
    assert output.err.count("drivepanel: These are slow.") == 1
    _, slow = map(json.loads, output.out.splitlines())
    assert (slow["event"], slow["seconds"], slow["text"]) == ("slow", 30.0, "These are slow.")
    assert [(each["baud"], each["format"]) for each in slow["settings"]] == [
        (600, "8N1"), (300, "8N1"), (110, "8N1"),
    ]  # fmt: skip

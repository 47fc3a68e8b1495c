"""The command and status words of a drive in `status`."""

from __future__ import annotations

import json
from dataclasses import replace

from tests.ui.fakes import NOW, readings_of
from tui.cli.shared.status_words import word_fields, word_rows
from tui.drive.profile import library
from tui.session.shown import Quality

from .commands import run

PROFILE = library.load("atv71")
RAWS = {"CMD": 0x000F, "CMI": 0, "ETA": 0x0637}
DRIVE = ("-p", "powerdrive")


def test_status_shows_each_word_with_its_bits() -> None:
    lines = run(0, "status", "sim:atv71").splitlines()
    [word] = [line for line in lines if line.startswith("ETA ")]
    assert word.split()[:4] == ["ETA", "16#0250", "Status", "word:"]
    assert "Switch on disabled" in word
    [command] = [line for line in lines if line.startswith("CMD ")]
    assert command.endswith("16#0000  Command word: no bit set")


def test_word_with_unnamed_bits_only_is_not_called_empty() -> None:
    rows = dict(word_rows(PROFILE, readings_of(PROFILE, {**RAWS, "CMI": 1 << 14}, NOW)))
    assert rows["CMI"].endswith("Extended command word: no named bit set")


def test_bit_that_means_the_opposite_of_its_name_is_shown_by_its_meaning() -> None:
    profile = library.load("atv31")
    for raw, meaning in ((0x0240, "Switch on disabled, No forced local"), (0, "Forced local")):
        rows = dict(word_rows(profile, readings_of(profile, {"ETA": raw}, NOW)))
        assert rows["ETA"].endswith(f"Status word: {meaning}")
    for raw, meaning in ((0x0002, "Enable voltage, Quick stop"), (0, "no bit set")):
        rows = dict(word_rows(PROFILE, readings_of(PROFILE, {"CMD": raw}, NOW)))
        assert rows["CMD"].endswith(f"Command word: {meaning}")


def test_json_has_the_words_of_each_family_by_quantity() -> None:
    words = json.loads(run(0, "status", "sim:atv71", "--json"))["words"]
    assert words["status_word"] == {
        "code": "ETA", "address": 3201, "raw": 0x0250, "text": "16#0250",
        "bits": ["Power section supplied", "Switch on disabled", "Remote"],
        "texts": [
            "Power section supplied", "Switch on disabled",
            "Remote: command or reference from Modbus",
        ],
    }  # fmt: skip
    assert words["command_word"]["code"] == "CMD"
    own = json.loads(run(0, "status", "sim:powerdrive", *DRIVE, "--json"))["words"]
    assert {quantity: word["code"] for quantity, word in own.items()} == {
        "command_word": "6.42", "status_word": "10.40",
    }  # fmt: skip


def test_word_that_was_not_read_is_never_shown_as_current() -> None:
    readings = readings_of(PROFILE, RAWS, NOW)
    readings["CMD"] = replace(readings["CMD"], quality=Quality.STALE)
    rows = dict(word_rows(PROFILE, readings))
    assert rows["CMD"] == rows["ETI"] == "-----"
    assert rows["ETA"].startswith("16#0637  Status word: ")
    fields = word_fields(PROFILE, readings)
    assert fields["command_word"] is None
    assert fields["extended_status_word"] is None
    assert fields["status_word"] is not None

"""`drivepanel profiles ID --wiring`, and the model of a drive in `identify`."""

from __future__ import annotations

import json

import pytest

from .commands import refused, run, tcp_line

FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]


@pytest.mark.parametrize("family", FAMILIES)
def test_wiring_page_of_a_family_has_its_sections(family: str) -> None:
    text = run(0, "profiles", family, "--wiring")
    for part in ("Warnings", "Before you open the drive", "Pins: ", "Addresses", "Command words"):
        assert f"\n{part}" in text
    assert max(map(len, text.splitlines())) <= 100


def test_wiring_page_is_printed_as_json() -> None:
    reported = json.loads(run(0, "profiles", "atv71", "--wiring", "--json"))
    assert (reported["id"], reported["name"]) == ("atv71", "Altivar 71")
    titles = [section["title"] for section in reported["sections"]]
    assert titles[:2] == ["Warnings", "Before you open the drive"]
    rows = {row["head"]: row["text"] for s in reported["sections"] for row in s["rows"]}
    assert rows["D0"].startswith("EIA/TIA-485: A or A'")
    assert rows["16#000F"] == "Enable operation, forward"


def test_wiring_page_without_a_family_is_refused() -> None:
    assert "name its ID" in run_usage("profiles", "--wiring")
    assert "There is no profile" in refused(2, "profiles", "nosuch", "--wiring")


def run_usage(*arguments: str) -> str:
    from .commands import ended

    return ended(2, *arguments).stderr


@pytest.mark.parametrize(
    ("code", "text"),
    [(6, "ATV21HU15M3X, 200 V, 1.5 kW"), (999, "code 999, not in the profile")],
)
def test_model_is_read_from_the_drive(code: int, text: str) -> None:
    with tcp_line("atv21@3", "--set", f"FB05={code}", "--set", "FB72=0") as line:
        reported = json.loads(run(0, "identify", line, "-d", "3", "--json"))
        assert (reported["model"]["code"], reported["model"]["text"]) == (code, text)
        assert reported["reference"] == "ATV21H075M3X"
        assert f"Model      {text}" in run(0, "identify", line, "-d", "3")


def test_drive_with_an_unreadable_model_is_still_identified() -> None:
    with tcp_line("atv21@3", "--protect", "FB05", "--protect", "FB72") as line:
        reported = json.loads(run(0, "identify", line, "-d", "3", "--json"))
    assert reported["profile"] == "atv21"
    assert reported["model"] is None


def test_family_without_a_model_word_has_no_model() -> None:
    with tcp_line("atv312@3") as line:
        assert json.loads(run(0, "identify", line, "-d", "3", "--json"))["model"] is None

"""Output of `--json`: the form that scripts rely on, and nothing else."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

import pytest

from tests.programs import drivepanel
from tui.drive.profile import library
from tui.session.monitor.rates import monitoring_codes

from .commands import ended, tcp_line

pytestmark = pytest.mark.long

LINE = ("sim:atv71@2", "-d", "2")
HEAD = {"schema", "command"}
VALUE_KEYS = {"address", "raw", "value", "unit", "text", "taught", "quality"}


def reported(*arguments: str, status: int = 0) -> Any:
    """The one JSON document on standard output."""
    done = ended(status, *arguments, "--json")
    if status == 0:
        assert done.stderr == ""
    return json.loads(done.stdout)


def test_read_prints_values_as_json() -> None:
    read = reported("read", *LINE, "ETA", "ACC", "LFT")
    assert set(read) == {*HEAD, "line", "device", "profile", "timeout", "values"}
    assert (read["line"], read["device"], read["profile"]) == ("sim:atv71@2", 2, "atv71")
    assert list(read["values"]) == ["ETA", "ACC", "LFT"]
    for value in read["values"].values():
        assert set(value) == VALUE_KEYS
        assert value["quality"] == "good"
        assert type(value["raw"]) is int
        assert type(value["value"]) in (int, float)
    profile = library.load("atv71")
    acceleration = read["values"]["ACC"]
    assert acceleration["address"] == profile["ACC"].address
    assert acceleration["unit"] == "s"
    assert acceleration["value"] == pytest.approx(acceleration["raw"] / 10)


@pytest.mark.parametrize("typed", ["acc", "Acc", "w9001", "W9001", "16#2329", "0x2329", "9001"])
def test_read_accepts_any_notation_in_any_case(typed: str) -> None:
    assert list(reported("read", *LINE, typed)["values"]) == ["ACC"]


def test_refused_parameter_is_null_and_others_have_values() -> None:
    with tcp_line("atv71@2", "--protect", "ACC") as line:
        read = reported("read", line, "-d", "2", "ETA", "ACC", status=4)
    refused = read["values"]["ACC"]
    assert (refused["raw"], refused["value"], refused["quality"]) == (None, None, "bad")
    assert read["values"]["ETA"]["quality"] == "good"


def test_watch_prints_one_object_per_cycle() -> None:
    done = drivepanel("watch", *LINE, "RFR", "ETA", "--every", "0.1", "--count", "3", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    cycles = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(cycles) == 3
    for cycle in cycles:
        keys = {"time", "line", "device", "profile", "values", "state", "direction", "error"}
        assert set(cycle) == HEAD | keys | {"timeout", "contact", "cycle"}
        assert (cycle["contact"], cycle["cycle"]["wished"]) == ("answers", 0.1)
        assert list(cycle["values"]) == ["RFR", "ETA"]
        assert all(
            set(value) == VALUE_KEYS | {"time", "error"} for value in cycle["values"].values()
        )
    times = [datetime.fromisoformat(cycle["time"]) for cycle in cycles]
    assert all(time.tzinfo is not None for time in times)
    assert times == sorted(times)
    assert len(set(times)) == 3


def test_watch_uses_the_monitoring_set_of_the_profile() -> None:
    done = drivepanel("watch", *LINE, "--every", "0.1", "--count", "1", "--json")
    assert done.returncode == 0, done.stderr
    watched = json.loads(done.stdout)["values"]
    assert set(watched) == set(monitoring_codes(library.load("atv71")))


def test_identify_prints_the_identity_as_json() -> None:
    who = reported("identify", *LINE)
    keys = {
        "line",
        "device",
        "vendor",
        "reference",
        "version",
        "name",
        "profile",
        "model",
        "candidates",
    }
    assert set(who) == HEAD | keys | {"timeout"}
    assert (who["device"], who["profile"]) == (2, "atv71")
    assert who["reference"].startswith("ATV71")


def test_profiles_are_listed_as_json() -> None:
    listed = reported("profiles")
    assert [set(item) for item in listed] == [
        {*HEAD, "id", "name", "vendor", "parameters", "own", "file", "remark"}
    ] * len(listed)
    folder = library.packaged_folder()
    packaged = {path.stem for at in (folder, folder / library.PUBLIC) for path in at.glob("*.toml")}
    assert {item["id"] for item in listed} == packaged
    for item in listed:
        assert item["parameters"] == len(library.load(item["id"]).parameters)


def test_one_profile_is_printed_as_json() -> None:
    shown = reported("profiles", "atv71")
    assert shown["profile"]["id"] == "atv71"
    assert {p["code"] for p in shown["parameters"]} >= {"ETA", "ACC"}


def test_ports_are_listed_as_json() -> None:
    for port in reported("ports"):
        assert set(port) >= {"path", "description"}

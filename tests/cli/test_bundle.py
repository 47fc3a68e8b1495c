"""`drivepanel bundle`: its content, on a good line and on a dead one, and what it never has."""

from __future__ import annotations

import json
import os
import stat
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

from tests.bus.peer import PtyPeer, silent
from tui.bus.fake import FakeLine
from tui.bus.link import SerialLink
from tui.drive.profile.library import packaged_folder
from tui.session.connect.known_line import KnownLine
from tui.session.journal import Entry, Journal, entry_time
from tui.session.logs import log_file

from .commands import ended, run, tcp_line
from .printed import form_of
from .test_nothing_written import counted

pytestmark = pytest.mark.long

posix = pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")


def bundled(file: Path, *words: str) -> tuple[dict[str, Any], dict[str, bytes]]:
    """JSON of a bundle, and its files by their names without the folder."""
    report: dict[str, Any] = json.loads(
        run(0, "bundle", *words, "--output", str(file), "--force", "--json")
    )
    with zipfile.ZipFile(file) as opened:
        assert opened.testzip() is None
        names = opened.namelist()
        files = {name.partition("/")[2]: opened.read(name) for name in names}
    assert len({name.partition("/")[0] for name in names}) == 1
    assert report["files"] == [*files]
    return report, files


@pytest.mark.sweep
def test_bundle_of_two_drives_is_complete_and_writes_nothing(tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    with counted("atv71") as served:
        report, files = bundled(file, served.line)
        assert served.writes == []
    report, files = bundled(file, "sim:atv71@2,atv312@3")
    assert set(report["missing"]) == {"screens", "log.txt"}
    for device, family in ((2, "atv71"), (3, "atv312")):
        folder = f"drive-{device}"
        why, counts = (json.loads(files[f"{folder}/{text}.json"]) for text in ("why", "counters"))
        for document in (why, counts):
            form_of(document)
            assert (document["device"], document["profile"]) == (device, family)
        assert why["answers"] is True
        assert counts["test"] == {"frames": 20, "answered": 20}
        settings = tomllib.loads(files[f"{folder}/settings.toml"].decode())
        assert settings["end"]["parameters"] == settings["set"]["parameters"] > 100
        assert files[f"{folder}/report.md"].startswith(b"# ")
        profile = packaged_folder() / f"{family}.toml"
        assert files[f"profiles/{family}.toml"].decode() == profile.read_text("utf-8")
    assert [load["faults"] for load in json.loads(files["profiles/check.json"])] == [[], []]
    assert json.loads(files["versions.json"])["libraries"]["pymodbus"]
    assert files["frames.pcapng"][:4] == b"\x0a\x0d\x0d\x0a"
    readme = files["README.txt"].decode()
    assert all(name in readme for name in {*files, *report["missing"]} - {"README.txt"})


@posix
def test_bundle_without_a_port_has_all_parts_that_need_no_line(tmp_path: Path) -> None:
    port = tmp_path / "ttyUSB7"
    report, files = bundled(tmp_path / "a.zip", f"serial:{port}", "-d", "2", "-d", "5")
    assert json.loads(files["drive-2/why.json"])["rung"] == "no-port"
    assert json.loads(files["line.json"])["port"]["there"] is False
    assert {"journal.json", "versions.json"} <= files.keys()
    for device in (2, 5):
        assert "does not exist" in report["missing"][f"drive-{device}/settings.toml"]
    assert "does not exist" in " ".join(files["README.txt"].decode().split()), "it is wrapped"


@posix
def test_silent_drive_is_diagnosed_by_its_remembered_profile(tmp_path: Path) -> None:
    with PtyPeer(silent) as peer:
        KnownLine(FakeLine({2: {}}, link=SerialLink(peer.path))).note(None, 2, "atv71")
        report, files = bundled(tmp_path / "a.zip", peer.path, "-d", "2")
        assert {request[1] for request in peer.requests} <= {3, 4, 8, 17, 43}
    assert json.loads(files["drive-2/why.json"])["rung"] == "silence"
    assert "profiles/atv71.toml" in files
    assert len(files["frames.raw.pcapng"]) > 200
    missing = report["missing"]
    assert {"drive-2/counters.json", "drive-2/settings.toml"} <= missing.keys()
    assert "did not answer" in missing["drive-2/settings.toml"]


@pytest.mark.sweep
def test_unidentified_drive_needs_its_profile(tmp_path: Path) -> None:
    with tcp_line("powerdrive@2") as line:
        report, _ = bundled(tmp_path / "a.zip", line, "-d", "2")
        assert "-p" in report["missing"]["drive-2/settings.toml"]
        _, files = bundled(tmp_path / "a.zip", line, "-d", "2", "-p", "powerdrive")
        assert "drive-2/settings.toml" in files


PEOPLE = "/".join(("", "home"))
PLANTED = ("erna.muster", "Erna Muster", "press7-pc", "Tr0ub4dor&3", "S3cr3t+pw", "gw9.factory.lan")


def test_bundle_has_no_planted_name_or_password(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = tmp_path / "people" / "erna.muster"
    monkeypatch.setenv("USER", "erna.muster")
    monkeypatch.setenv("DRIVEPANEL_STATE", str(state))
    monkeypatch.setenv("DRIVEPANEL_MQTT_PASSWORD", "S3cr3t+pw")
    monkeypatch.setattr("socket.gethostname", lambda: "press7-pc.factory.lan")
    state.mkdir(parents=True)
    line = "sim:atv71@2"
    log_file().write_text(
        "Erna Muster is erna.muster\n"
        "publishing to mqtts://erna.muster:Tr0ub4dor&3@gw9.factory.lan:8883/plant\n"
        "Traceback (most recent call last):\n"
        f'  File "{PEOPLE}/erna.muster/tool.py", line 3\n'
        "ValueError: bad login 'Tr0ub4dor&3' on PRESS7-PC and gw9.factory.lan, not S3cr3t+pw\n",
        "utf-8",
    )
    journal = Journal()
    journal.add(
        Entry(
            entry_time(None), line, 2, "atv71", "ACC", 9001, 1, "0.1 s", 2, "0.2 s",
            "ok", 2, "by erna.muster with password=S3cr3t+pw on press7-pc",
        )
    )  # fmt: skip
    journal.close()
    monkeypatch.setattr(
        "tui.session.bundle.redaction.read_small",
        lambda _: b"erna.muster:x:1000:1000:Erna Muster,,,:/nowhere:/bin/sh\n",
    )
    _, files = bundled(tmp_path / "a.zip", line)
    monkeypatch.undo()
    assert "0.2 s" in files["journal.json"].decode()
    assert "Traceback" in files["log.txt"].decode()
    for name, data in files.items():
        for planted in PLANTED:
            assert planted.casefold().encode() not in data.lower(), (name, planted)
    report = files["README.txt"].decode()
    assert "user names: 0" not in report
    assert "passwords, tokens and credentials in URLs: 0" not in report


def test_other_lines_and_old_entries_are_not_in_the_journal(tmp_path: Path) -> None:
    journal = Journal()
    for when, line in ((0.0, "sim:atv71@2"), (None, "sim:atv71@9"), (None, "sim:atv71@2")):
        journal.add(
            Entry(entry_time(when), line, 2, "atv71", "ACC", 1, 1, "a", 2, "b", "ok", 2, "test")
        )
    journal.close()
    _, files = bundled(tmp_path / "a.zip", "sim:atv71@2")
    (entry,) = json.loads(files["journal.json"])["entries"]
    assert entry["line"] == "sim:atv71@2"


@posix
def test_file_is_private_and_replaced_by_force_only(tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    file.write_bytes(b"before")
    assert "Choose another name" in ended(2, "bundle", "sim:atv312", "--output", file).stderr
    assert file.read_bytes() == b"before"
    ended(0, "bundle", "sim:atv312", "--output", file, "--force")
    assert zipfile.is_zipfile(file)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert [path.name for path in tmp_path.glob("*.part")] == []
    assert "no folder" in ended(2, "bundle", "sim:atv312", "--output", tmp_path / "x" / "a").stderr


def test_default_name_has_line_and_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ended(0, "bundle", "sim:atv312")
    (file,) = tmp_path.glob("*.zip")
    assert file.name.startswith("drivepanel-sim-2")


def test_interrupted_bundle_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tui.session.bundle.work.collect_parts", interrupted)
    ended(130, "bundle", "sim:atv312", "--output", tmp_path / "a.zip")
    assert [path for path in tmp_path.iterdir() if path.suffix in (".zip", ".part")] == []

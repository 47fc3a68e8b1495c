"""`drivepanel listen`: its output and files, on a line polled by a simulated PLC."""

from __future__ import annotations

import os
import signal
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.programs import DRIVEPANEL, served, wait_until
from tui.session.connect.named_lines import settings_file
from tui.simulator import DriveSpec, PlcOnLine, Simulation
from tui.wire.frames import is_whole

from .commands import ended, refused, run
from .printed import documents

pytestmark = pytest.mark.long

TWO = "sim:atv71@1,atv312@2"


def blocks(path: Path) -> list[tuple[int, bytes]]:
    """The blocks of a pcapng file, each whole: its kind and body."""
    data, found, at = path.read_bytes(), [], 0
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        assert struct.unpack_from("<I", data, at + length - 4) == (length,)
        found.append((kind, data[at + 8 : at + length - 4]))
        at += length
    return found


def packets(path: Path) -> list[bytes]:
    """The packets of a pcapng file."""
    found = [body for kind, body in blocks(path) if kind == 6]
    return [body[20 : 20 + struct.unpack_from("<I", body, 12)[0]] for body in found]


def reported(*arguments: str | Path) -> list[dict[str, Any]]:
    """The objects that `listen --json` prints; all fit the schema."""
    return documents(run(0, "listen", *arguments, "--json"))


@contextmanager
def plc(*requests: str, profile: str = "atv71") -> Iterator[PlcOnLine]:
    """A master that asks a simulated drive at 2 these requests, as soon as it is started."""
    with Simulation([DriveSpec(profile, 2)]) as simulation:
        master = PlcOnLine(
            simulation, [bytes.fromhex(request) for request in requests], pause=0.005
        )
        try:
            yield master
        finally:
            master.stop()


READ_ETA, WRITE_LFR, NOBODY, NO_WORD = "030c810001", "0621360000", "09030c810001", "0300010001"
CYCLE = tuple(f"02{pdu}" for pdu in (READ_ETA, WRITE_LFR, NO_WORD))


def test_text_output_has_a_line_per_exchange_and_a_summary() -> None:
    text = run(0, "listen", TWO, "--for", "1")
    lines = text.splitlines()
    assert lines[0].startswith("Listening at /dev/pts/")
    assert "Device 1: Altivar 71 (reported by the drive)" in lines
    assert any(line[12:] == "    1 read   RFR 0.0 Hz" for line in lines)
    assert any(line[12:] == "    2 write  LFr ← 0.0 Hz" for line in lines)
    assert text.count("commanded by the master") == 2
    assert lines[-1].startswith("Heard ")


def test_json_output_has_an_object_per_exchange_and_a_summary() -> None:
    *exchanges, summary = reported(TWO, "--for", "0.8")
    assert {exchange["event"] for exchange in exchanges} == {"exchange"}
    read = next(
        exchange
        for exchange in exchanges
        if exchange["device"] == 1 and "RFR" in exchange["values"]
    )
    assert (read["function"], read["answer"], read["how"]) == (3, "ok", "identified")
    assert read["values"]["RFR"] == {
        "address": 3202, "raw": 0, "value": 0.0, "unit": "Hz", "text": "0.0", "written": False,
    }  # fmt: skip
    written = next(
        exchange for exchange in exchanges if exchange["device"] == 2 and exchange["function"] == 6
    )
    assert written["values"]["LFr"]["written"] is True
    assert [item["device"] for item in summary["drives"]] == [1, 2]
    first = summary["drives"][0]
    assert first["commanded"] is True
    assert first["timeout"]["known"] == "factory"
    assert first["shorter"]["requests_now"] == 3
    assert len(first["shorter"]["requests"]) == 1
    assert summary["silences"]["judged"] is False


def test_profile_options_apply_to_all_drives_or_one() -> None:
    *exchanges, _ = reported(TWO, "--for", "0.5", "-p", "atv31", "-p", "2=atv71")
    taken = {(exchange["device"], exchange["profile"], exchange["how"]) for exchange in exchanges}
    assert taken == {(1, "atv31", "named"), (2, "atv71", "named")}


@pytest.mark.sweep
def test_summaries_are_printed_periodically() -> None:
    found = reported(TWO, "--for", "2.5", "--every", "1")
    assert [row["event"] for row in found].count("summary") == 3


def test_capture_file_has_frames_in_modbus_tcp_form(tmp_path: Path) -> None:
    path = tmp_path / "frames.pcapng"
    *exchanges, summary = reported(TWO, "--for", "0.8", "--pcap", path)
    found = packets(path)
    assert len(found) == summary["frames"]
    mbap = [packet[40:] for packet in found]
    assert {data[6] for data in mbap} == {1, 2}
    whole = [exchange for exchange in exchanges if exchange["answer"] == "ok"]
    assert [data[7:].hex() for data in mbap[: 2 * len(whole)]] == [
        pdu for row in whole for pdu in (row["request"], row["reply"])
    ]


def test_capture_file_of_raw_frames_says_how_to_read_it(tmp_path: Path) -> None:
    path = tmp_path / "frames.pcapng"
    text = run(0, "listen", TWO, "--for", "0.5", "--pcap", path, "--raw")
    assert all(is_whole(packet) for packet in packets(path))
    assert "mbrtu" in text
    assert f"-r {path}" in text


def test_existing_file_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "frames.pcapng"
    path.write_bytes(b"mine")
    assert "--force" in refused(2, "listen", TWO, "--for", "0.2", "--pcap", path)
    assert path.read_bytes() == b"mine"
    ended(0, "listen", TWO, "--for", "0.3", "--pcap", path, "--force")
    assert packets(path)
    nowhere = tmp_path / "none" / "x.pcapng"
    assert "cannot be written" in refused(2, "listen", TWO, "--for", "0.2", "--pcap", nowhere)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("tcp:127.0.0.1",), "is not a serial port"),
        (("rtu-tcp:127.0.0.1:5020",), "is not a serial port"),
        ((TWO, "--raw"), "--pcap"),
        ((TWO, "-p", "300=atv71"), "ADDRESS=ID"),
        ((TWO, "-p", "nosuch"), "no profile"),
        ((TWO, "-p", "atv71", "-p", "atv31"), "one profile"),
    ],
)
def test_line_that_cannot_be_monitored_is_refused(words: tuple[str, ...], why: str) -> None:
    assert why in refused(2, "listen", *words, "--for", "0.1")


def test_missing_port_exits_with_3(tmp_path: Path) -> None:
    assert "does not exist" in refused(3, "listen", f"serial:{tmp_path}/none", "--for", "0.1")


def test_ctrl_c_leaves_a_complete_file_and_prints_the_summary(tmp_path: Path) -> None:
    path = tmp_path / "frames.pcapng"
    with plc(*CYCLE) as master:
        words = ["listen", master.path, "--pcap", str(path), "-p", "atv71"]
        with served([*DRIVEPANEL, *words], ready="Listening at") as listening:
            master.start()
            wait_until(lambda: path.stat().st_size > 5000, "frames in the file")
            listening.process.send_signal(signal.SIGINT)
            out, err = listening.process.communicate(timeout=60)
    assert listening.process.returncode == 130
    assert "Device 2: Altivar 71 (set by -p)" in out
    assert "refused" in out
    found = packets(path)
    assert len(found) > 30
    assert f"{len(found)} packets written to {path}" in err


def test_kill_leaves_a_readable_file(tmp_path: Path) -> None:
    path = tmp_path / "frames.pcapng"
    with plc(*CYCLE) as master:
        words = ["listen", master.path, "--pcap", str(path)]
        with served([*DRIVEPANEL, *words], ready="Listening at") as listening:
            master.start()
            wait_until(lambda: path.stat().st_size > 5000, "frames in the file")
            listening.end(signal.SIGKILL)
    assert len(packets(path)) > 30


def test_unanswered_and_refused_requests_are_reported() -> None:
    with plc(*CYCLE, NOBODY) as master:
        master.start()
        *exchanges, summary = reported(master.path, "--for", "2")
    answers = {
        (exchange["device"], exchange["function"], exchange["answer"]) for exchange in exchanges
    }
    assert {(2, 3, "ok"), (2, 6, "ok"), (2, 3, "exception"), (9, 3, "none")} <= answers
    two, nine = summary["drives"]
    assert two["exceptions"] == {"2": two["exceptions"]["2"]}
    assert (nine["answered"], nine["unanswered"] > 2) == (0, True)
    refusal = next(exchange for exchange in exchanges if exchange["answer"] == "exception")
    assert refusal["exception"] == 2
    assert refusal["values"] == {}
    assert refusal["asked"] == ["1"]


def test_text_from_the_wire_does_not_control_terminal() -> None:
    """A drive whose name is an escape sequence, identified by another master."""
    spec = DriveSpec("atv71", 2, identity={6: "\x1b[2J\x07"})
    with Simulation([spec]) as simulation:
        master = PlcOnLine(simulation, [bytes.fromhex("022b0e0100")])
        try:
            master.start()
            text = run(0, "listen", master.path, "--for", "0.5")
            found = run(0, "listen", master.path, "--for", "0.5", "--json")
        finally:
            master.stop()
    assert "␛[2J␇" in text
    assert not {"\x1b", "\x07"} & set(text + found)


def test_named_line_sets_the_profile_of_its_drive() -> None:
    path = settings_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f'[lines.fan]\nline = "{TWO}"\ndevice = 2\nprofile = "atv71"\n', encoding="utf-8"
    )
    *exchanges, _ = reported("fan", "--for", "0.5")
    assert {
        (exchange["device"], exchange["profile"], exchange["how"]) for exchange in exchanges
    } == {
        (1, "atv71", "identified"),
        (2, "atv71", "named"),
    }


def test_lost_port_ends_with_the_summary(tmp_path: Path) -> None:
    path = tmp_path / "frames.pcapng"
    with plc(*CYCLE) as master:
        words = ["listen", master.path, "--pcap", str(path)]
        with served([*DRIVEPANEL, *words], ready="Listening at") as listening:
            master.start()
            wait_until(lambda: path.stat().st_size > 5000, "frames in the file")
            master.stop()
            out, err = listening.process.communicate(timeout=60)
    assert listening.process.returncode == 3
    assert "disappeared" in err
    assert "Listened " in out
    assert len(packets(path)) > 30


def test_silent_line_reports_that_nothing_was_received() -> None:
    ours, theirs = os.openpty()
    try:
        text = run(0, "listen", os.ttyname(theirs), "--for", "0.3")
        assert "Nothing was received" in text
    finally:
        os.close(ours)
        os.close(theirs)

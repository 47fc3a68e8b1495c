"""Every command's JSON against its schema."""

from __future__ import annotations

import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.programs import DRIVEPANEL, PATIENCE, drivepanel, free_port, port_of, served
from tui.cli.command_index import COMMANDS
from tui.cli.derived import commands_of, documents_schema
from tui.cli.running.scan_telling import ScanTelling
from tui.cli.shared.drive_status import status_document
from tui.cli.shared.output import json_text
from tui.drive.finding import LineSetting
from tui.session.connect.identify import ScanResult
from tui.simulator import Simulation, parse_drives

from ..session.test_ghost_record import record_of_one_reply
from . import test_fault_status as fault_status
from .commands import ended, invoked, tcp_line
from .printed import documents, form_of, forms, forms_of

pytestmark = pytest.mark.long

SCHEMA = Path(__file__).resolve().parents[2] / "docs" / "cli.schema.json"
NO_JSON = {"demo", "replay"}
"""Commands that print nothing: the panel."""
DRIVE = ("sim:atv71@2", "-d", "2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a set of an Altivar 71, and one of its blocks."""
    return make_files(tmp_path_factory.mktemp("sets"))


def make_files(folder: Path) -> Path:
    """Write the files that the commands read."""
    ended(0, "backup", *DRIVE, folder / "set.toml")
    ended(0, "block", DRIVE[0], "save", folder / "slots.toml", *DRIVE[1:])
    text = (folder / "set.toml").read_text("utf-8")
    (folder / "other.toml").write_text(
        text.replace('ACC = { raw = 30, value = "3.0 s"', 'ACC = { value = "4.5 s"'), "utf-8"
    )
    (folder / "line.toml").write_bytes((SCHEMA.parent / "plan" / "hall-2.toml").read_bytes())
    (folder / "scan.json").write_text('{"command": "scan", "event": "hit", "device": 2}', "utf-8")
    return folder


RUNS: dict[str, tuple[int, tuple[str, ...], set[str]]] = {
    "a value": (0, ("read", *DRIVE, "ACC", "ETA"), {"ReadDocument"}),
    "two drives": (3, ("read", *DRIVE, "-d", "9", "ACC"), {"ReadDocument", "ErrorDocument"}),
    "why not": (3, ("why", "sim:atv71@2", "-d", "9"), {"WhyDocument"}),
    "who it is": (0, ("identify", *DRIVE), {"IdentityDocument"}),
    "who is there": (0, ("scan", DRIVE[0], "--addresses", "2-3"),
                     {"ScanFamiliesDocument", "ScanHitDocument", "ScanEndDocument"}),
    "what it does": (0, ("status", *DRIVE), {"StatusDocument"}),
    "its counters": (0, ("counters", *DRIVE, "--frames", "5"), {"CountersDocument"}),
    "cycles": (0, ("watch", *DRIVE, "--every", "0.1", "--count", "2"), {"CycleDocument"}),
    "a recording": (0, ("record", *DRIVE, "RFR", "--out", "FOLDER/new.sqlite", "--for", "0.3"),
                    {"RecordDocument"}),
    "a reference": (0, ("reference", *DRIVE, "20", "--arm"), {"CommandDocument"}),
    "stops": (0, ("stop", DRIVE[0], "--all"), {"StopDocument"}),
    "a stop": (0, ("stop", *DRIVE), {"StopDocument"}),
    "a write": (0, ("write", *DRIVE, "ACC=4", "--arm"), {"WriteDocument"}),
    "a write that would be": (0, ("write", *DRIVE, "ACC=4", "--dry-run"), {"WriteDocument"}),
    "a write that is refused": (5, ("write", *DRIVE, "BIR=1", "--arm"), {"WriteDocument"}),
    "a backup": (0, ("backup", *DRIVE, "FOLDER/new.toml"), {"BackupDocument"}),
    "a report": (0, ("report", *DRIVE, "FOLDER/new.md"), {"ReportDocument"}),
    "a page": (0, ("report", *DRIVE, "FOLDER/new.html"), {"ReportDocument"}),
    "a bundle": (0, ("bundle", DRIVE[0], "--output", "FOLDER/new.zip"), {"BundleDocument"}),
    "a plan": (0, ("restore", DRIVE[0], "FOLDER/other.toml", "--dry-run", *DRIVE[1:]),
               {"RestoreDocument"}),
    "a restoring": (0, ("restore", DRIVE[0], "FOLDER/other.toml", "--arm", *DRIVE[1:]),
                    {"RestoreDocument"}),
    "the journal": (0, ("journal", "--since", "1h"), {"JournalDocument"}),
    "a comparison": (1, ("compare", "FOLDER/set.toml", "FOLDER/other.toml"), {"CompareDocument"}),
    "blocks": (0, ("block", *DRIVE), {"BlocksDocument"}),
    "blocks compared": (0, ("block", DRIVE[0], "verify", *DRIVE[1:]), {"BlocksDocument"}),
    "no blocks": (0, ("block", "sim:atv312"), {"BlocksDocument"}),
    "a block that would be": (
        0, ("block", DRIVE[0], "set", "NMA3=LCR", "--dry-run", *DRIVE[1:]), {"BlockChangeDocument"},
    ),
    "a block that is": (0, ("block", DRIVE[0], "set", "NMA3=LCR", "--arm", *DRIVE[1:]),
                        {"BlocksDocument"}),
    "a block in a file": (0, ("block", DRIVE[0], "save", "FOLDER/more.toml", *DRIVE[1:]),
                          {"BlockFileDocument"}),
    "what is taught": (0, ("teach", "sim:powerdrive", "-p", "powerdrive"), {"TaughtDocument"}),
    "a lesson": (0, ("teach", "sim:powerdrive", "-p", "powerdrive", "1.21", "90", "rpm"),
                 {"LessonDocument"}),
    "what is forgotten": (
        0, ("teach", "sim:powerdrive", "-p", "powerdrive", "1.21", "--forget"),
        {"TeachChangeDocument"},
    ),
    "profiles": (0, ("profiles",), {"ProfileDocument"}),
    "a profile": (0, ("profiles", "atv312"), {"ProfileShown"}),
    "its wiring": (0, ("profiles", "atv312", "--wiring"), {"WiringDocument"}),
    "its folder": (0, ("profiles", "path"), {"ProfileFolder"}),
    "a new one": (0, ("profiles", "new", "mine", "--from", "atv312"), {"ProfileBegun"}),
    "a proof": (2, ("profiles", "--prove", "FOLDER/set.toml"), {"ProofDocument"}),
    "a drive's evidence": (
        0,
        ("profiles", "confirm", "powerdrive", "sim:powerdrive", "--to", "FOLDER/evidence.json"),
        {"ConfirmDocument"},
    ),
    "a check": (2, ("profiles", "--check", "FOLDER/set.toml"), {"CheckDocument"}),
    "ports": (0, ("ports",), set()),
    "names of lines": (0, ("lines",), {"LinesDocument"}),
    "what others say": (0, ("listen", "sim:atv71@2", "--for", "0.5"),
                        {"HeardExchangeDocument", "HeardSummaryDocument"}),
    "a list of statuses": (0, ("status", "sim:atv71@1,atv312@2", "--all"), {"StatusDocument"}),
    "a line on paper": (0, ("plan", "FOLDER/line.toml"), {"PlanDocument"}),
    "its beginning": (0, ("plan", "FOLDER/new-line.toml", "--from-scan", "FOLDER/scan.json"),
                      {"PlanBegunDocument"}),
    "how it is simulated": (0, ("simulate", "--about", "atv21"), {"SimulatedBehaviorDocument"}),
    "no such code": (2, ("read", *DRIVE, "NOSUCH"), {"ErrorDocument"}),
}  # fmt: skip
"""By name: exit status, words, and the forms of the documents. FOLDER is that of the fixture."""
ELSEWHERE = {
    "RunDocument", "HoldDocument", "ProveDocument", "AcceptDocument", "RecipesDocument",
    "ExportDocument", "SimulationReady",
    "InputsDocument", "BenchDocument", "BenchWaitsDocument", "BenchRefusedDocument",
    "GhostDocument",
    "ServeReady", "PublishReady", "ScanSlowDocument", "ScanUnclearDocument", "PortDocument",
}  # fmt: skip
"""Forms of the tests below; this computer may have no port."""


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.sweep
def test_printed_documents_fit_the_schema(name: str, folder: Path) -> None:
    status, words, expected = RUNS[name]
    typed = [word.replace("FOLDER", str(folder)) for word in words]
    text = ended(status, *typed, "--json").stdout
    assert all(row["command"] == words[0] for row in documents(text))
    assert forms_of(text) == expected or name == "ports"


def test_every_document_is_printed_by_a_run() -> None:
    printed = set().union(*(expected for _, _, expected in RUNS.values()))
    assert printed | ELSEWHERE == {form.__name__ for form in forms()}
    assert not printed & ELSEWHERE


def test_every_document_names_a_command_and_every_command_has_one() -> None:
    named = {command for form in forms() for command in commands_of(form)}
    assert named == set(COMMANDS) - NO_JSON


@pytest.mark.sweep
def test_run_and_stop_print_their_documents() -> None:
    done = drivepanel("run", *DRIVE, "--reference", "20Hz", "--for", "2", "--arm", "--json")
    assert done.returncode == 0, done.stderr
    assert forms_of(done.stdout) == {"RunDocument"}
    events = [document["event"] for document in documents(done.stdout)]
    assert {"reference", "order", "state", "stopping", "stopped"} <= set(events)


def test_hold_prints_its_document() -> None:
    with served([*DRIVEPANEL, "hold", *DRIVE, "--json"], ready="{") as holding:
        (reported,) = documents(holding.ready)
    assert form_of(reported) == "HoldDocument"
    assert (reported["event"], reported["timeout"]["seconds"]) == ("holding", 10.0)


def test_first_stop_word_is_reported() -> None:
    (reported,) = documents(ended(0, "stop", *DRIVE, "--json").stdout)
    (first,) = reported["first"]
    assert (first["address"], first["word"], first["answer"]) == (8501, 7, "ok")
    assert "atv71" in first["families"]
    assert reported["timeout"]["begun"] is True


def test_prove_prints_its_document() -> None:
    with tcp_line("atv312@1", "--set", "ttO=5", "--any-settings") as line:
        (reported,) = documents(ended(0, "prove", line, "--arm", "--reset", "--json").stdout)
    assert form_of(reported) == "ProveDocument"
    assert reported["as_set"] is True
    assert reported["not_before_ms"] < 500 < reported["not_after_ms"]
    assert reported["reset"] is True


async def test_status_of_a_fault_prints_its_document() -> None:
    async with fault_status.line("atv71") as opened:
        fault_status.provoke(opened, "ObF")
        status = await fault_status.status_of(opened, "atv71")
    (row,) = documents(json_text(status_document("demo", status)))
    assert form_of(row) == "StatusDocument"
    assert row["fault"]["look_at"]
    assert row["fault"]["reset"]


BENCH_LINES = {
    "2: trip OCF": "BenchDocument",
    "2: LI1=0": "InputsDocument",
    "in 3600s: 2: clear": "BenchWaitsDocument",
    "2: trip": "BenchRefusedDocument",
}
"""Lines to the socket of `simulate`, and the forms of the answers."""


def test_simulate_prints_its_documents(tmp_path: Path) -> None:
    place = str(tmp_path / "bench")
    simulate = [*DRIVEPANEL, "simulate", "atv71@2", "--tcp", "127.0.0.1:0", "--json"]
    simulate += ["--socket", place]
    with served(simulate, ready="{", stdin=subprocess.PIPE) as simulation:
        (reported,) = documents(simulation.ready)
        process = simulation.process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write("2: LI1=1\n")
        process.stdin.flush()
        assert forms_of(process.stdout.readline()) == {"InputsDocument"}
        with socket.socket(socket.AF_UNIX) as bench, bench.makefile("r") as answers:
            bench.settimeout(PATIENCE)
            bench.connect(place)
            for line, form in BENCH_LINES.items():
                bench.sendall(f"{line}\n".encode())
                assert forms_of(answers.readline()) == {form}
    assert form_of(reported) == "SimulationReady"
    assert port_of(reported["line"])
    assert reported["drives"] == [{"profile": "atv71", "device": 2}]


@pytest.mark.sweep
def test_ghost_prints_its_documents(tmp_path: Path) -> None:
    place = f"{record_of_one_reply(tmp_path)}@2"
    simulate = [*DRIVEPANEL, "simulate", "--from", place, "--tcp", "127.0.0.1:0", "--json"]
    with served(simulate, ready="{") as simulation:
        (reported,) = documents(simulation.ready)
        assert form_of(reported) == "SimulationReady"
        (ghost,) = reported["ghosts"]
        assert (ghost["device"], ghost["profile"], ghost["repeats"]) == (2, "atv71", True)
        line = reported["line"]
        assert drivepanel("read", line, "-d", "2", "-p", "atv71", "ACC").returncode != 0
        assert simulation.process.stdout is not None
        assert forms_of(simulation.process.stdout.readline()) == {"GhostDocument"}


def test_serve_prints_its_documents() -> None:
    options = ["--tcp", ":0", "--allow-writes", "all", "--metrics", ":0", "--json"]
    with served([*DRIVEPANEL, "serve", "sim:atv71@2", *options], ready="{") as program:
        (reported,) = documents(program.ready)
    assert form_of(reported) == "ServeReady"
    assert port_of(reported["tcp"])
    assert (reported["lines"], reported["writes"], reported["commands"]) == (
        ["sim:atv71@2"],
        ["all"],
        False,
    )
    assert reported["metrics"].startswith("http://127.0.0.1:")
    assert reported["mqtt"] is None


def test_publish_prints_its_documents() -> None:
    url = f"mqtt://127.0.0.1:{free_port()}/plant"
    with served([*DRIVEPANEL, "publish", *DRIVE, "--mqtt", url, "--json"], ready="{") as program:
        (reported,) = documents(program.ready)
    assert form_of(reported) == "PublishReady"
    assert reported["mqtt"] == url


def test_rare_scan_events_have_their_documents(capsys: pytest.CaptureFixture[str]) -> None:
    telling = ScanTelling("/dev/ttyUSB0", as_json=True)
    telling.slow([LineSetting(1200, "8E1")], 12.34, "It takes 12 s.")
    telling.unclear(LineSetting(1200, "8E1"), ScanResult(3, None, "Damaged."))
    telling.unclear(None, ScanResult(3, None, "Damaged."))
    assert [form_of(row) for row in documents(capsys.readouterr().out)] == [
        "ScanSlowDocument", "ScanUnclearDocument", "ScanUnclearDocument",
    ]  # fmt: skip


def test_reset_prints_its_document() -> None:
    with Simulation(parse_drives("atv71@1")) as simulation:
        host, port = simulation.serve_tcp()
        simulation.drive(1).provoke("ObF")
        done = ended(0, "reset", f"tcp:{host}:{port}", "--arm", "--json")
    assert forms_of(done.stdout) == {"CommandDocument"}


def test_every_command_has_json() -> None:
    tried = {words[0] for _, words, _ in RUNS.values()} | {
        "run",
        "reset",
        "serve",
        "publish",
        "simulate",
        "hold",
        "prove",
        "accept",
        "export",
    }
    assert tried == set(COMMANDS) - NO_JSON
    for name in tried:
        assert "--json" in invoked(name, "--help").stdout


def test_committed_schema_is_up_to_date() -> None:
    assert SCHEMA.read_text("utf-8") == documents_schema()


WRONG: dict[str, Any] = {
    "another version": {"schema": 2},
    "a field that is not told": {"more": 1},
    "a field that is missing": {"values": None},
}


@pytest.mark.parametrize("change", WRONG.values(), ids=WRONG.keys())
def test_wrong_document_fails_the_check(change: dict[str, Any]) -> None:
    (reported,) = documents(ended(0, "read", *DRIVE, "ACC", "--json").stdout)
    with pytest.raises(ValueError, match="ReadDocument"):
        form_of({**reported, **change})


def test_document_without_a_version_fails_the_check() -> None:
    (reported,) = documents(ended(0, "read", *DRIVE, "ACC", "--json").stdout)
    del reported["schema"]
    with pytest.raises(ValueError, match="a field is missing"):
        form_of(reported)


def test_document_names_are_unique() -> None:
    assert len({form.__name__ for form in forms()}) == len(forms())

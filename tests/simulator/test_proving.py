"""`profiles --prove`: a profile is tested on the drive that is simulated from it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from click.testing import CliRunner

from tui.cli.main import main
from tui.cli.running.profile_proof import untested
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import ProfileData
from tui.simulator.charts.own import OwnChart
from tui.simulator.proving.drive_steps import drive_steps
from tui.simulator.proving.proof_bench import ProofBench
from tui.simulator.proving.proof_steps import command_steps, prove_profile
from tui.simulator.registers import Registers

from .exchange import Exchange
from .test_chart_own import pump, words

pytestmark = pytest.mark.long

KINDS = Path(__file__).parents[1] / "line" / "profiles"
MS300 = KINDS / "ms300-kind.toml"
FAST = ("atv21", "powerdrive")
OUTPUT = "output_frequency"
SLOW = ("atv31", "atv312", "atv71", "proxidrive", "varmeca")


def failed(profile: Profile) -> dict[str, str]:
    return {step.title: step.fault for step in prove_profile(profile) if step.fault}


@pytest.mark.parametrize("id", [*FAST, *(pytest.param(id, marks=pytest.mark.sweep) for id in SLOW)])
def test_packaged_profiles_pass(id: str) -> None:
    assert failed(library.load(id)) == {}


@pytest.mark.parametrize("path", sorted(KINDS.glob("*.toml")), ids=lambda path: path.stem)
def test_profiles_of_other_makes_pass(path: Path) -> None:
    assert failed(library.load_file(path)) == {}


def test_no_packaged_profile_is_left_out() -> None:
    packaged = library.packaged_folder().glob("*.toml")
    assert {path.stem for path in packaged} == {*FAST, *SLOW}


def test_stop_that_does_not_stop_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OwnChart, "_end", lambda *_: None)
    found = failed(library.load_file(MS300))
    for title in ("stop (Stop) leads to its state", "stop stops from reverse"):
        assert found[title].startswith("it does not stop: after 30 s the drive shows Running at")


def test_stop_that_only_slows_fails(tmp_path: Path) -> None:
    """Its word leads from one running state to another."""
    text = MS300.read_text("utf-8").replace(
        '{ id = "running", name = "Running", kind = "running", mask = 0x0010, value = 0x0010 },',
        '{ id = "running", name = "Running", kind = "running", mask = 0x0030, value = 0x0010 },\n'
        '  { id = "slow", name = "Slow", kind = "running", mask = 0x0030, value = 0x0030 },',
    )
    text = text.replace(
        "orders = [",
        """transitions = [
  { source = "ready", target = "running", command = 0x0012 },
  { source = "running", target = "slow", command = 0x0001 },
  { source = "slow", target = "ready", command = 0x0001 },
]
orders = [""",
        1,
    )
    path = tmp_path / "own.toml"
    path.write_text(text, "utf-8")
    done = CliRunner().invoke(main, ["profiles", "--prove", str(path)])
    assert done.exit_code == 1, done.output
    line = text[: text.index('id = "stop"')].count("\n") + 1
    place = f"FAILED  {path}:{line}: stop stops from forward: it does not stop"
    assert place in done.output


PLANTED = {
    "a feedback that is no feedback": (
        'kind = "frequency"',
        'kind = "frequency"\nfeedback = "FMAX"',
    ),
    "a reference that ends too low": (
        'scale = "0.01"\nmax = 59900\naccess = "rw"\nstorage = "ram"',
        'scale = "0.01"\nmax = 3000\naccess = "rw"\nstorage = "ram"',
    ),
}


@pytest.mark.parametrize("name", PLANTED)
def test_wrong_reference_fails(tmp_path: Path, name: str) -> None:
    right, wrong = PLANTED[name]
    text = MS300.read_text("utf-8")
    assert text.count(right) == 1
    path = tmp_path / "own.toml"
    path.write_text(text.replace(right, wrong), "utf-8")
    [(title, fault)] = failed(library.load_file(path)).items()
    assert title.startswith("FREQCMD and")
    if "feedback =" in wrong:
        assert (
            "FMAX is max_frequency, which does not follow the motor. Give it frequency_reference"
            in fault
        )


def test_reset_that_has_no_effect_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OwnChart, "reset_fault", lambda _: None)
    found = failed(library.load_file(MS300))
    assert found["reset (Fault reset) leads to its state"] == "the fault is still present after it"


def test_reset_of_one_word_fails_at_a_second_trip(tmp_path: Path) -> None:
    """Its bit stays set, so the second time it has no edge."""
    path, text = tmp_path / "own.toml", MS300.read_text("utf-8")
    right = 'parameter = "RESET", words = [0x0002]'
    for sequence, fault in (
        ("[0x0081]", "a second trip: the fault is still present after it. Its words have no edge"),
        ("[0x0001, 0x0081, 0x0001]", ""),
    ):
        path.write_text(text.replace(right, f"words = {sequence}"), "utf-8")
        found = {step.title: step.fault for step in command_steps(library.load_file(path))}
        assert found["reset (Fault reset) leads to its state"].startswith(fault)
        assert bool(found["reset (Fault reset) leads to its state"]) == bool(fault)


def test_setting_that_is_not_held_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    profile, written = library.load_file(MS300), Registers.write_word

    def keep_fmax(registers: Registers, address: int, word: int) -> None:
        if address != profile["FMAX"].address:
            written(registers, address, word)

    monkeypatch.setattr(Registers, "write_word", keep_fmax)
    found = {step.title: step.fault for step in drive_steps(profile)}
    assert found["setting FMAX (Settings) is written and read back"].startswith("it is ")
    assert found["setting 09-02 (Communication) is written and read back"] == ""


def test_run_of_the_wrong_way_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.simulator.body.Body.directed", lambda _, hz: -hz)
    assert "forward (Run forward) leads to its state" in failed(library.load_file(MS300))


def test_drive_that_ignores_its_limits_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.simulator.body.Body.unlimited", property(lambda _: True))
    assert "values beyond limits are refused" in failed(library.load_file(MS300))


LOCAL = ("orders = [", 'local = { parameter = "STATUS", bit = 9, value = 0 }\norders = [')
LOCK = (
    "orders = [",
    'interlocks = [{ parameter = "STATUS", mask = 0x100, values = [0x100], text = "Open." }]\n'
    "orders = [",
)


@pytest.mark.parametrize(
    ("change", "title"),
    [(LOCAL, "local control blocks a start"), (LOCK, "the interlock of STATUS blocks a start")],
)
def test_local_control_and_interlocks_are_proved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: tuple[str, str], title: str
) -> None:
    path = tmp_path / "own.toml"
    path.write_text(MS300.read_text("utf-8").replace(*change, 1), "utf-8")
    profile = library.load_file(path)
    steps = command_steps(profile)
    assert {step.title: step.fault for step in steps if step.title == title or step.fault} == {
        title: ""
    }
    monkeypatch.setattr(ProofBench, "blocked", lambda *_: None)
    assert [step.title for step in command_steps(profile) if step.fault] == [title]


def test_result_is_printed_as_json(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(MS300.read_text("utf-8").replace("baud = 9600", "baud = 9601"), "utf-8")
    done = CliRunner().invoke(main, ["profiles", "--json", "--prove", str(MS300), str(wrong)])
    assert done.exit_code == 2
    right, faulty = json.loads(done.output)
    assert right["passed"] is True
    assert len(right["steps"]) > 10
    assert (faulty["passed"], faulty["steps"], len(faulty["faults"])) == (False, [], 1)
    assert right["not_tested"][-1].startswith("Addresses and word order: there are no [[frames]]")
    assert faulty["not_tested"] == []
    printed = CliRunner().invoke(main, ["profiles", "--prove", str(MS300)]).output.splitlines()
    assert printed[-1] == f"not tested: {right['not_tested'][-1]}"


def _without_role(tables: dict[str, Any], role: str) -> None:
    for row in tables["parameters"]:
        if row.get("quantity") == role:
            del row["quantity"]


def _without_reverse(tables: dict[str, Any]) -> None:
    orders = tables["charts"][0]["orders"]
    orders[:] = [order for order in orders if order["id"] != "reverse"]


def _without_references(tables: dict[str, Any]) -> None:
    del tables["references"]
    _without_role(tables, "command_frequency")


LACKS: dict[str, tuple[Callable[[dict[str, Any]], None], set[str]]] = {
    "nothing": (lambda tables: None, set()),
    "commands": (
        lambda tables: tables["charts"][0].pop("orders"),
        {"Commands and stops", "References"},
    ),
    "reverse": (_without_reverse, {"Reverse"}),
    "references": (_without_references, {"References"}),
    "the output": (lambda tables: _without_role(tables, OUTPUT), {"The output frequency"}),
    "codes": (lambda tables: tables["faults"].pop("codes"), {"Fault numbers"}),
    "loss": (lambda tables: tables.pop("communication_fault"), {"Communication loss"}),
    "save": (lambda tables: tables.pop("memory"), {"Saving"}),
    "frames": (lambda tables: tables.pop("frames"), {"Addresses and word order"}),
}


@pytest.mark.parametrize("lack", LACKS)
def test_claims_that_the_file_lacks_are_not_tested(lack: str) -> None:
    """The example of the page makes every claim."""
    tables = msgspec.to_builtins(pump().data)
    remove, expected = LACKS[lack]
    remove(tables)
    profile = Profile(msgspec.convert(tables, ProfileData))
    found = untested(profile, list(prove_profile(profile)))
    assert {text.partition(":")[0] for text in found} == expected


# Reset of the simulated drive

RESET = {"id": "reset", "name": "Reset", "words": [0x80, 0], "states": ["fault"]}
ORDERS = [
    {"id": "forward", "name": "Forward", "words": [0x12], "states": ["stop", "run"]},
    {"id": "stop", "name": "Stop", "words": [0]},
    RESET,
]


def test_last_word_of_a_reset_is_not_the_stop() -> None:
    Exchange(words(orders=ORDERS, interlocks=[])).play("""
        ! OC
        > 02 06 2000 0080
        > 02 06 2000 0000
        > 02 03 2100 0002
        < 02 03 04 0000 0000
    """)


def test_reset_by_the_extended_command_word_ends_a_communication_fault() -> None:
    """Its bit 1 saves the settings of an Altivar; here it resets."""
    rig = Exchange(library.load_file(MS300), {"09-02": 2, "09-03": 10})
    rig.play("""
        > 02 03 2226 0001
        . 1.2
        > 02 03 2226 0001
        < 02 03 02 0008
        > 02 03 2100 0001
        < 02 03 02 0001                # a fault without a name, but not none
        > 02 06 2002 0002
        > 02 03 2226 0001
        < 02 03 02 0004
        > 02 03 2100 0001
        < 02 03 02 0000
    """)


def test_reaction_without_a_trip_lets_the_motor_run() -> None:
    rig = Exchange(library.load_file(MS300), {"09-02": 0, "09-03": 10}, run_hz=20.0)
    rig.play("> 02 03 2226 0001\n. 9")
    assert rig.drive.motor.frequency == pytest.approx(20.0, abs=0.1)


def test_saving_word_of_any_make_saves_its_settings() -> None:
    pump = library.load_file(Path(__file__).parents[1] / "drive" / "pump.toml")
    rig = Exchange(pump)
    mode = pump["MODE"]
    saved = [rig.drive.registers.present(mode)]
    rig.drive.registers.put(mode, 2)
    rig.play("> 02 06 00CB 0001\n. 1")
    assert rig.word("KEEP") == 0
    rig.drive.power_cycle()
    saved.append(rig.drive.registers.present(mode))
    assert saved == [0, 2]

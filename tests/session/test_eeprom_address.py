"""Settings with an address in RAM and one in EEPROM: writes go to RAM, a save to EEPROM."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from tests.mixer import HERTZ, MIXER, installed_mixer, mixer_text
from tests.session.sets_bench import Bench, bench
from tui.bus.errors import NoAnswer
from tui.cli.main import main
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.settings.memory_orders import MemoryRefused, eeprom_copy, save_effect
from tui.session.drive import UnsavedSettings
from tui.session.eeprom_counts import EepromWrite
from tui.session.journal import Journal
from tui.session.read.reader import Reader
from tui.session.settings.eeprom import save_to_eeprom
from tui.session.settings.wear import ASK_FROM
from tui.session.settings.write import NotTaken
from tui.simulator import DriveSpec, SimulatedDrive, Simulation
from tui.simulator.proving.drive_steps import drive_steps

RULE = 'summary = "An invented drive for tests of references."\n'
ROW = """
[[parameters]]
code = "ACC"
name = "Acceleration"
number = "16#0007"
address = "16#1000 + number"
unit = "s"
scale = "0.1"
min = 1
max = 6000
factory = 30
access = "rw"
storage = "ram-until-saved"
group = "Settings"
quantity = "acceleration"
source = "guide"
confidence = "manual"
"""
DEC = (
    ROW.replace("ACC", "DEC")
    .replace("0007", "0008")
    .replace("Acc", "Dec")
    .replace('"acceleration"', '"deceleration"')
)
BY_RULE = RULE, RULE + 'eeprom_address = "16#5000 + number"\n'
RAM, EEPROM = 0x1007, 0x5007


def installed() -> Profile:
    return installed_mixer(HERTZ, ROW + DEC, BY_RULE)


def test_rule_gives_both_addresses() -> None:
    profile = installed()
    assert (profile["ACC"].address, profile["ACC"].eeprom_address) == (RAM, EEPROM)
    assert profile["KEY"].eeprom_address is None
    copy = eeprom_copy(profile["ACC"])
    assert copy is not None
    assert (copy.code, copy.address, copy.storage) == ("ACC", EEPROM, "eeprom")


def test_simulated_drive_loses_what_is_in_ram_only() -> None:
    drive = SimulatedDrive(installed(), DriveSpec(MIXER, 1))

    def ask(function: int, address: int, word: int) -> int:
        reply = drive.line_side.answer(1, struct.pack(">BHH", function, address, word))
        assert reply is not None
        return int.from_bytes(reply[-2:], "big")

    ask(6, RAM, 50)
    assert (ask(3, RAM, 1), ask(3, EEPROM, 1)) == (50, 30)
    drive.power_cycle()
    assert ask(3, RAM, 1) == 30
    ask(6, EEPROM, 50)
    assert (ask(3, RAM, 1), ask(3, EEPROM, 1)) == (50, 50)
    drive.power_cycle()
    assert ask(3, RAM, 1) == 50
    refused = drive.line_side.answer(1, struct.pack(">BHH", 6, EEPROM, 6001))
    assert refused == bytes([0x86, 3])


def test_profile_is_proved_with_its_eeprom_addresses() -> None:
    assert [(step.title, step.fault) for step in drive_steps(installed())] == [
        ("setting ACC (Settings) is written and read back", ""),
        ("settings are saved at their EEPROM addresses", ""),
    ]


async def written(made: Bench, **typed: str) -> None:
    done = await made.write(await made.stage(**typed))
    assert all(result.done for result in done.results), done.results


def eeprom_writes(made: Bench) -> dict[str, int]:
    session = made.session
    place = session.line_text, session.device, MIXER, session.known_identity.text
    counts = made.journal.eeprom.counts_of(*place)
    assert not counts.saves.count
    return {code: count.count for code, count in counts.writes.items()}


async def test_save_writes_unsaved_settings_to_eeprom_and_counts_only_these_writes() -> None:
    installed()
    with bench(MIXER) as made:
        await written(made, ACC="5", DEC="6")
        await written(made, DEC="7")
        assert await asyncio.to_thread(made.journal.flush)
        assert eeprom_writes(made) == {}
        assert made.session.unsaved == {"ACC", "DEC"}
        assert "ACC, DEC" in save_effect(made.profile, made.session.unsaved)
        text = await save_to_eeprom(made.session, made.journal, made.permit())
        assert text == "Example mixer: saved 2 settings to EEPROM (ACC, DEC), all verified."
        assert made.session.unsaved == frozenset()
        assert await asyncio.to_thread(made.journal.flush)
        assert eeprom_writes(made) == {"ACC": 1, "DEC": 1}
        assert [entry.address for entry in list(made.journal.recent)[-2:]] == [EEPROM, EEPROM + 1]
        with pytest.raises(MemoryRefused, match="Nothing to save"):
            await save_to_eeprom(made.session, made.journal, made.permit())
        made.drive.power_cycle()
        assert (made.drive.raw("ACC"), made.drive.raw("DEC")) == (50, 70)
        # frequent writes of one setting are refused, and then nothing is written
        session = made.session
        place = session.line_text, session.device, MIXER, session.known_identity.text
        now = time.time()
        times = [EepromWrite(*place, "DEC", now - n) for n in reversed(range(ASK_FROM))]
        made.journal.eeprom.add(times)
        await written(made, ACC="8", DEC="9")
        with pytest.raises(MemoryRefused, match="Not written: DEC would go to EEPROM again"):
            await save_to_eeprom(session, made.journal, made.permit())
        made.drive.power_cycle()
        assert (made.drive.raw("ACC"), made.drive.raw("DEC")) == (50, 70)


def test_restore_with_a_frequent_save_is_refused_before_anything_is_written(
    tmp_path: Path,
) -> None:
    installed()
    with Simulation([DriveSpec(MIXER, 1)]) as simulation:
        line = "tcp:{}:{}".format(*simulation.serve_tcp())
        words = (str(tmp_path / "set.toml"), "-p", MIXER)
        CliRunner().invoke(main, ["backup", line, *words])
        simulation.drive(1).set("ACC", 50)
        counts, now = Journal().eeprom, time.time()
        counts.add(
            [EepromWrite(line, 1, MIXER, "", "ACC", now - n) for n in reversed(range(ASK_FROM))]
        )
        done = CliRunner().invoke(main, ["restore", line, *words, "--arm", "--save"])
        assert done.exit_code == 5, done.output
        assert "ACC would go to EEPROM again" in done.output
        assert simulation.drive(1).raw("ACC") == 50, "not in RAM either"


async def test_save_is_refused_while_the_motor_runs_and_without_arming() -> None:
    installed()
    with bench(MIXER) as made:
        await written(made, ACC="5")
        made.drive.run(20.0)
        with pytest.raises(MemoryRefused, match="Stop the motor first"):
            await save_to_eeprom(made.session, made.journal, made.permit())
        made.drive.halt()
        permit = made.permit()
        made.session.arming.disarm()
        with pytest.raises(DriveError):
            await save_to_eeprom(made.session, made.journal, permit)
        assert made.session.unsaved == {"ACC"}


@pytest.mark.parametrize("taken", [True, False])
async def test_save_without_a_reply_leaves_the_setting_unsaved(taken: bool) -> None:
    installed()
    with bench(MIXER) as made:
        await written(made, ACC="5")
        honest = made.session.line.write

        async def silent(device: int, address: int, words: Sequence[int], **how: Any) -> float:
            if taken:
                await honest(device, address, words, **how)
            raise NoAnswer(device, 6, address)

        made.session.line.write = silent  # type: ignore[assignment, method-assign]
        with pytest.raises(NoAnswer):
            await save_to_eeprom(made.session, made.journal, made.permit())
        assert made.session.unsaved == {"ACC"}
        # the value in RAM does not show if the EEPROM has it
        made.session.take(await Reader(made.session).read(["ACC"]))
        assert await asyncio.to_thread(made.journal.flush)
        assert {entry.kind for entry in made.journal._recent} == {"write"}


async def test_save_that_the_eeprom_does_not_hold_is_an_error() -> None:
    installed()
    with bench(MIXER) as made:
        await written(made, ACC="5")
        honest = made.session.line.write

        async def forgetful(device: int, address: int, words: Sequence[int], **how: Any) -> float:
            return await honest(device, RAM, words, **how)

        made.session.line.write = forgetful  # type: ignore[assignment, method-assign]
        with pytest.raises(
            NotTaken, match=r"ACC was written as 5\.0 s, but the drive holds 3\.0 s"
        ):
            await save_to_eeprom(made.session, made.journal, made.permit())
        assert made.session.unsaved == {"ACC"}
        reading = made.session.image.get("ACC")
        assert reading is not None
        assert reading.raw == 50


def test_saved_setting_is_unsaved_again_after_the_next_write() -> None:
    unsaved = UnsavedSettings()
    unsaved.note_write("ACC", 30, 50)
    unsaved.note_saved("ACC", 50)
    assert not unsaved.codes
    unsaved.note_write("ACC", 50, 60)
    assert unsaved.codes == {"ACC"}
    unsaved.note_write("ACC", 60, 50)
    assert not unsaved.codes


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            'storage = "ram-until-saved"',
            'storage = "eeprom"\neeprom_address = 20480',
            "needs a whole word",
        ),
        ('access = "rw"\n', 'access = "r"\neeprom_address = 20480\n', "needs a whole word"),
        ('access = "rw"\n', 'access = "rw"\neeprom_address = 100\n', "100 also belongs to STAT"),
        ('access = "rw"\n', 'access = "rw"\neeprom_address = 4103\n', "4103 also belongs to ACC"),
        ('access = "rw"\n', 'access = "rw"\neeprom_address = 70000\n', "65535"),
        ('access = "rw"\n', 'access = "rw"\neeprom_address = "5 + item"\n', "needs item"),
    ],
)
def test_check_names_a_wrong_eeprom_address(before: str, after: str, message: str) -> None:
    row = ROW.replace(before, after)
    assert row != ROW
    path = library.user_folder() / "mixer.toml"
    path.parent.mkdir(parents=True)
    path.write_text(mixer_text() + row, encoding="utf-8")
    result = CliRunner().invoke(main, ["profiles", "--check", str(path)])
    line = (mixer_text() + row)[: (mixer_text() + row).index("eeprom_address")].count("\n") + 1
    assert message in result.output, result.output
    assert f"mixer.toml:{line}: " in result.output


def test_check_refuses_a_save_command_beside_eeprom_addresses() -> None:
    save = '[memory.save]\nparameter = "KEY"\nraw = 1\ndoes = "Saves."\n\n[monitoring]'
    with pytest.raises(DriveError, match=r"\[memory.save\] or EEPROM addresses, not both"):
        installed_mixer(HERTZ, ROW, BY_RULE, ("[monitoring]", save))

"""Settings that a drive uses only after a further word (ENTER of Yaskawa drives)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.mixer import HERTZ, MIXER, installed_mixer, mixer_text
from tests.session.sets_bench import bench
from tui.bus.errors import NoAnswer
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.session.settings.applied import EditOutcome
from tui.session.settings.eeprom import save_to_eeprom
from tui.simulator.proving.drive_steps import drive_steps

ENTER, ACC, SPARE = 0x910, 300, 301
ROWS = """
[[parameters]]
code = "ENTER"
name = "Enter to RAM"
number = "0910H"
address = 2320
access = "w"
group = "Command"
source = "guide"
confidence = "manual"

[[parameters]]
code = "SAVE"
name = "Enter to EEPROM"
number = "0900H"
address = 2304
access = "w"
group = "Command"
source = "guide"
confidence = "manual"

[[parameters]]
code = "ACC"
name = "Acceleration"
number = "0200H"
address = 300
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

[[parameters]]
code = "SPARE"
name = "Spare"
number = "0201H"
address = 301
access = "rw"
storage = "ram-until-saved"
group = "Settings"
source = "guide"
confidence = "manual"
"""
MEMORY = """
[memory.enter]
parameter = "ENTER"
raw = 0
{when}
[memory.save]
parameter = "SAVE"
raw = 0
keeps_value = true
does = "All settings are copied to EEPROM."

[monitoring]"""


def installed(when: str = "", change: tuple[str, str] = ("", "")) -> Profile:
    memory = "[monitoring]", MEMORY.format(when=when)
    return installed_mixer(HERTZ, ROWS.replace(*change) if change[0] else ROWS, memory)


async def test_each_setting_is_entered_before_it_is_read_back() -> None:
    installed()
    with bench(MIXER) as made:
        done = await made.apply(ACC="5.0", SPARE="7")
        assert all(result.done for result in done.results), done.results
        assert made.writes() == [(ACC, 50), (ENTER, 0), (SPARE, 7), (ENTER, 0)]
        assert made.drive.registers.in_force(made.profile["ACC"]) == 50
        assert [entry.code for entry in made.journal.sent].count("ENTER") == 2


async def test_setting_is_not_entered_if_the_drive_needs_no_word() -> None:
    installed('when = { parameter = "MODE", values = [0] }')
    with bench(MIXER) as made:
        made.drive.set("MODE", 1)
        await made.apply(ACC="5.0")
        assert ENTER not in [register for register, _ in made.writes()]


async def test_refused_word_leaves_the_setting_unused_and_staged() -> None:
    installed()
    with bench(MIXER) as made:
        made.refuse("ENTER")
        done = await made.apply(ACC="5.0")
        [result] = done.results
        assert result.outcome is EditOutcome.NOT_TAKEN
        assert "ACC was written, but the drive does not use it yet" in result.text
        assert "The next setting that is written enters it, too." in result.text
        assert made.drive.registers.in_force(made.profile["ACC"]) == 30
        assert any(entry.answer == "not in effect" for entry in made.journal.sent)


async def test_setting_whose_word_may_be_lost_does_not_count_as_written() -> None:
    installed()
    with bench(MIXER) as made:
        made.lose_answer("ENTER", NoAnswer(1, 6, ENTER), taken=False)
        [result] = (await made.apply(ACC="5.0")).results
        assert result.outcome is EditOutcome.NOT_TAKEN
        assert "the drive does not use it yet" in result.text


async def test_setting_is_saved_by_a_word_that_can_only_be_written() -> None:
    installed()
    with bench(MIXER) as made:
        await made.apply(ACC="5.0")
        assert "saved to EEPROM" in await save_to_eeprom(made.session, made.journal, made.permit())
        made.drive.power_cycle()
        assert made.drive.raw("ACC") == 50


def test_proof_covers_the_word() -> None:
    steps = {step.title: step.fault for step in drive_steps(installed())}
    assert steps["settings take effect when entered"] == ""
    assert steps["settings are saved"] == ""


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('parameter = "ENTER"', 'parameter = "GONE"', "'GONE'"),
        ('parameter = "ENTER"', 'parameter = "CTRL"', "CTRL is the command word of the motor"),
        ('parameter = "ENTER"', 'parameter = "ACC"', "ACC is a value in s, not a command"),
        ('parameter = "ENTER"', 'parameter = "SPARE"', "SPARE is a setting"),
        ('parameter = "ENTER"', 'parameter = "STAT"', "STAT cannot be written"),
        ("raw = 0\n\n", "raw = 70000\n\n", "70000"),
    ],
)
def test_wrong_word_is_reported(tmp_path: Path, old: str, new: str, fault: str) -> None:
    text = mixer_text().replace("[monitoring]", MEMORY.format(when="").replace(old, new, 1))
    path = tmp_path / "mixer.toml"
    path.write_text(text + ROWS, "utf-8")
    found = library.all_faults_of(path)
    assert any(fault in text for text in found), found

"""Command and reference sources of an Altivar: raw exchanges, as the manuals show."""

from __future__ import annotations

import pytest

from tui.simulator.charts.channels import ChannelPlace, channels_in_force, switch_is_on

from .exchange import Exchange

pytestmark = pytest.mark.long

COMPACT = ("atv31", "atv312")
ALL = (*COMPACT, "atv71")

ETA, RFR, ETI, LRS3 = "0C81", "0C82", "0C86", "0CB4"
CMD, LFR, CRC, CCC = "2135", "2136", "20F9", "20FA"

COMBINED_BY_LI5 = {"CHCF": 1, "FR1": 164, "FR2": 1, "RFC": 133}
"""ATV71 manual: control via Modbus or the terminals in Drivecom profile."""


@pytest.mark.parametrize("family", COMPACT)
def test_idle_drive_set_up_for_modbus_reports_it_in_eti(family: str) -> None:
    Exchange(family).play(f"""
        > 02 03 {ETA} 0001
        < 02 03 02 0240          # no forced local, switch on disabled
        > 02 03 {ETI} 0001
        < 02 03 02 4002          # bit 14 without 13: Modbus
        > 02 03 {LRS3} 0001
        < 02 03 02 0000          # channel 1 for both
    """)


def test_idle_atv71_set_up_for_modbus_reports_it_in_ccc_and_crc() -> None:
    Exchange("atv71").play(f"""
        > 02 03 {CRC} 0002
        < 02 03 04 0008 0008
        > 02 03 {ETA} 0001
        < 02 03 02 0250
    """)


@pytest.mark.parametrize("family", ALL)
def test_li5_switches_command_and_reference_to_the_terminals_and_back(family: str) -> None:
    """ATV71 manual, configuration: Fr1 = Modbus, Fr2 = AI1, rFC = LI5, combined."""
    rig = Exchange(family, COMBINED_BY_LI5)
    rig.play(f"""
        > 02 06 {LFR} 012C
        < 02 06 {LFR} 012C
        > 02 06 {CMD} 0006
        > 02 06 {CMD} 0007
        > 02 06 {CMD} 000F
        < 02 06 {CMD} 000F
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 012C
        > 02 03 {LRS3} 0001
        < 02 03 02 0000
        @ AI1=4V
        @ LI5=1
        . 0.1
        > 02 03 {LRS3} 0001
        < 02 03 02 0003          # reference and command by channel 2
        . 8
        > 02 03 {RFR} 0001
        < 02 03 02 0000          # LI1 is open: the motor has stopped
        > 02 06 {CMD} 000F
        . 3
        > 02 03 {RFR} 0001
        < 02 03 02 0000          # the line has no command
        @ LI1=1
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 00C8          # 20.0 Hz: 4 V between LSP and HSP
    """)
    assert rig.word("ETI") & 0x6000 == 0
    rig.play(f"""
        @ LI5=0
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 012C          # 16#000F stands in CMD, 30.0 Hz in LFR: both hold again
        > 02 03 {LRS3} 0001
        < 02 03 02 0000
    """)
    assert rig.word("ETI") & 0x6000 == 0x4000


def test_on_the_atv71_ccc_crc_and_lrs7_follow_li5() -> None:
    Exchange("atv71", COMBINED_BY_LI5).play(f"""
        > 02 03 {CRC} 0002
        < 02 03 04 0008 0008
        > 02 03 0CB8 0001
        < 02 03 02 0005          # LRS7: Fr1 and Cd1
        @ LI5=1
        > 02 03 {CRC} 0002
        < 02 03 04 0001 0001     # terminals
        > 02 03 0CB8 0001
        < 02 03 02 000A          # Fr2 and Cd2
        > 02 03 {ETA} 0001
        < 02 03 02 0050          # bit 9: no network
    """)


@pytest.mark.parametrize("family", ALL)
def test_with_fr1_at_ai1_and_fr2_at_modbus_rfc_gives_modbus_the_command(family: str) -> None:
    """The case in which reading Fr1 alone is misleading."""
    Exchange(family, {"CHCF": 1, "FR1": 1, "FR2": 164, "RFC": 97}).play(f"""
        > 02 03 {LRS3} 0001
        < 02 03 02 0003
        > 02 06 {LFR} 00C8
        > 02 06 {CMD} 0006
        > 02 06 {CMD} 0007
        > 02 06 {CMD} 000F
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 00C8
    """)


@pytest.mark.parametrize("family", ALL)
def test_with_fr1_at_modbus_and_rfc_at_fr2_the_line_has_no_command(family: str) -> None:
    Exchange(family, {"CHCF": 1, "FR1": 164, "FR2": 1, "RFC": 97}).play(f"""
        > 02 03 {LRS3} 0001
        < 02 03 02 0003
        > 02 06 {LFR} 00C8
        > 02 06 {CMD} 0006
        > 02 06 {CMD} 0007
        > 02 06 {CMD} 000F
        < 02 06 {CMD} 000F
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 0000
    """)


@pytest.mark.parametrize("family", ALL)
def test_separate_channels_take_the_command_from_one_and_the_reference_from_another(
    family: str,
) -> None:
    rig = Exchange(family, {"CHCF": 2, "FR1": 1, "CD1": 10, "CD2": 1, "CCS": 132})
    rig.play(f"""
        @ AI1=50%
        > 02 06 {LFR} 0064
        > 02 06 {CMD} 0006
        > 02 06 {CMD} 0007
        > 02 06 {CMD} 000F
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 00FA          # 25.0 Hz of AI1, not the 10.0 Hz of LFR
        @ LI4=1
        . 6
        > 02 03 {LRS3} 0001
        < 02 03 02 0002          # command by channel 2, reference by channel 1
        > 02 03 {RFR} 0001
        < 02 03 02 0000
    """)


@pytest.mark.parametrize("family", ALL)
def test_bit_of_the_command_word_switches_the_reference(family: str) -> None:
    """rFC = C114: bit 14 of the word that Modbus wrote."""
    rig = Exchange(family, {"CHCF": 2, "FR1": 164, "CD1": 10, "FR2": 1, "RFC": 190})
    rig.play(f"""
        @ AI1=10
        > 02 06 {LFR} 0064
        > 02 06 {CMD} 0006
        > 02 06 {CMD} 0007
        > 02 06 {CMD} 000F
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 0064
        > 02 06 {CMD} 400F
        . 6
        > 02 03 {LRS3} 0001
        < 02 03 02 0001
        > 02 03 {RFR} 0001
        < 02 03 02 01F4
    """)


def test_on_the_atv71_reference_1b_is_switched_alone() -> None:
    """ATV71 manual: control in Drivecom profile via Modbus, target switching at the terminals."""
    settings = {"CHCF": 2, "FR1": 164, "CD1": 10, "CCS": 98, "FR1B": 1, "RCB": 133}
    Exchange("atv71", settings).play(f"""
        @ AI1=20%
        > 02 06 {LFR} 012C
        > 02 06 {CMD} 0006
        > 02 06 {CMD} 000F
        @ LI5=1
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 0064
        > 02 03 {CRC} 0002
        < 02 03 04 0001 0008
        > 02 03 0CB8 0001
        < 02 03 02 0015          # channel 1 for both, by way of Fr1b
    """)


def test_io_profile_li5_switches_and_the_word_applies_again_afterwards() -> None:
    """ATV71 manual: control via Modbus or the terminals in I/O profile."""
    settings = {"CHCF": 3, "FR1": 164, "CD1": 10, "CD2": 1, "CCS": 133, "FR1B": 1, "RCB": 133}
    Exchange("atv71", settings).play(f"""
        @ AI1=20%
        > 02 06 {LFR} 012C
        > 02 06 {CMD} 0001
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 012C
        @ LI1=1
        @ LI5=1
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 0064
        > 02 03 {CRC} 0002
        < 02 03 04 0001 0001
        @ LI5=0
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 012C
    """)


@pytest.mark.parametrize("family", ALL)
@pytest.mark.parametrize(("copy", "hertz", "word"), [(0, 0, 0), (3, 300, 0x000F)])
def test_copying_channel_1_to_2_keeps_the_motor_running(
    family: str, copy: int, hertz: int, word: int
) -> None:
    """COP = ALL; without it the line's empty word stops the motor at the change."""
    rig = Exchange(family, {"CHCF": 1, "FR1": 1, "FR2": 164, "RFC": 133, "COP": copy})
    rig.play("""
        @ AI1=60%
        @ LI1=1
        . 5
        @ LI5=1
        . 5
    """)
    assert rig.word("RFR") == hertz
    assert rig.word("CMD") == word
    assert rig.word("LFR") == hertz


@pytest.mark.parametrize("family", ALL)
def test_forced_local_beats_the_channels_and_shows_in_bit_9(family: str) -> None:
    rig = Exchange(family, {"FLO": 134, "FLOC": 1})
    rig.play(f"""
        > 02 06 {LFR} 012C
        > 02 06 {CMD} 0006
        > 02 06 {CMD} 0007
        > 02 06 {CMD} 000F
        . 5
        @ LI6=1
        . 8
        > 02 03 {RFR} 0001
        < 02 03 02 0000
    """)
    assert rig.word("ETA") & 0x0200 == 0
    assert rig.word("ETI") & 0x6000 == 0
    rig.play("@ LI6=0")
    assert rig.word("ETA") & 0x0200
    assert rig.word("ETI") & 0x6000 == 0x4000


@pytest.mark.parametrize("family", ALL)
def test_communication_loss_does_not_trip_a_forced_local_drive(family: str) -> None:
    rig = Exchange(family, {"FLO": 134, "FLOC": 1, "TTO": 10, "SLL": 1})
    rig.play(f"""
        > 02 06 {LFR} 012C
        > 02 06 {CMD} 0006
        @ LI6=1
        . 3
    """)
    assert rig.drive.fault is None
    rig.play("""
        @ LI6=0
        . 12                     # the ATV71 waits for FLOT first, 10 s
    """)
    assert rig.drive.fault is not None


@pytest.mark.parametrize("family", COMPACT)
def test_bits_13_and_14_of_eti_show_display_and_canopen(family: str) -> None:
    for channel, bits in ((163, 0x2000), (167, 0x6000), (1, 0)):
        assert Exchange(family, {"FR1": channel}).word("ETI") & 0x6000 == bits


def test_three_wire_control_starts_on_a_pulse_only() -> None:
    Exchange("atv312", {"FR1": 1, "TCC": 1}).play(f"""
        @ AI1=5V
        @ LI1=1
        @ LI2=1
        @ LI2=0
        . 5
        > 02 03 {RFR} 0001
        < 02 03 02 00FA
        ! OCF
        . 2
        @ LI1=0
        @ LI1=1
        . 2
        > 02 03 {RFR} 0001
        < 02 03 02 0000
    """)


@pytest.mark.parametrize(
    ("raw", "closed", "word", "on"),
    [
        (96, (), 0, False),
        (98, (), 0, False),
        (97, (), 0, True),
        (99, (), 0, True),
        (133, ("LI5",), 0, True),
        (133, ("LI4",), 0, False),
        (142, ("LI14",), 0, True),
        (171, (), 0x0800, True),
        (187, (), 0x0800, True),
        (191, (), 0x8000, True),
        (187, (), 0x1000, False),
        (203, (), 0x0800, False),
    ],
)
def test_assignment_value_selects_an_input_or_a_bit(
    raw: int, closed: tuple[str, ...], word: int, on: bool
) -> None:
    """96 to 99 channels, from 129 inputs, from 160 bits of the line's word; 203 is CANopen's."""
    assert switch_is_on(raw, lambda name: name in closed, word) is on


def test_default_channels_are_the_terminals() -> None:
    channels = channels_in_force(lambda code, default: default, lambda raw: raw in (97, 99))
    assert (channels.command, channels.reference) == (
        ChannelPlace.TERMINALS,
        ChannelPlace.TERMINALS,
    )

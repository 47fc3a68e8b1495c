"""Which parameters may be written as settings, on every family, and why not."""

from __future__ import annotations

import pytest

from tui.drive.profile import library
from tui.drive.profile.schema import StateKind
from tui.drive.settings.writable import (
    AT_REST,
    is_order,
    is_setting,
    marks,
    needs_standstill,
    waits_for_reset,
    warning,
    write_refusal,
)

FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]


REFUSALS = [
    # family, code, state, what is wrong, what the sentence names
    ("atv71", "RFR", "stopped", "read-only", "only be read"),
    ("atv71", "CMD", "stopped", "order", "is a command"),
    ("atv71", "LFR", "stopped", "order", "is a command"),
    ("atv71", "CMI", "stopped", "order", "is a command"),
    ("atv71", "NC1", "stopped", "order", "Press X on Scanner"),
    ("atv71", "OL1R", "stopped", "order", "has no command for it"),
    ("atv71", "SCS", "stopped", "order", "saves the settings"),
    ("atv71", "FCS", "stopped", "order", "has no command for it"),
    ("atv71", "FRY", "stopped", "forbidden", "not documented"),
    ("atv71", "UNS", "running", "running", "now running"),
    ("atv71", "UNS", None, "running", "unknown"),
    ("atv71", "UNS", "unknown", "running", "with the motor stopped"),
    ("atv71", "NMA1", "running", "running", "with the motor stopped"),
    ("atv31", "CMI", "stopped", "order", "is a command"),
    ("atv31", "PISP", "stopped", "order", "has no command for it"),
    ("atv312", "LAC", "stopping", "running", "with the motor stopped"),
    ("atv21", "FA00", "stopped", "order", "is a command"),
    ("atv21", "FA50", "stopped", "order", "is a command"),
    ("atv21", "F829", "stopped", "forbidden", "ends Modbus"),
    ("atv21", "tyP", "stopped", "forbidden", "factory"),
    ("atv21", "F111", "stopped", "unverified", "16#0111"),
    ("powerdrive", "6.42", "stopped", "order", "is a command"),
    ("powerdrive", "6.32", "stopped", "order", "has no command for it"),
    ("varmeca", "10.33", "stopped", "order", "has no command for it"),
    ("proxidrive", "6.43", "running", "running", "with the motor stopped"),
    ("varmeca", "12.43", "stopped", "forbidden", "brake"),
]


@pytest.mark.parametrize(("family", "code", "state", "reason", "text"), REFUSALS)
def test_unwritable_parameter_is_refused_with_a_reason(
    family: str, code: str, state: StateKind, reason: str, text: str
) -> None:
    profile = library.load(family)
    found = write_refusal(profile, profile[code], state)
    assert found is not None
    assert found.reason == reason
    assert text in found.text
    assert found.text.startswith(code)


ALLOWED = [
    ("atv71", "ACC", "running"),
    ("atv71", "UNS", "stopped"),
    ("atv71", "UNS", "fault"),
    ("atv71", "NCA3", "ready"),
    ("atv31", "HSP", "running"),
    ("atv312", "Add", "blocked"),
    ("atv21", "F803", "running"),
    ("atv21", "F875", "running"),
    ("powerdrive", "6.43", "stopped"),
    ("powerdrive", "15.04", "running"),
]


@pytest.mark.parametrize(("family", "code", "state"), ALLOWED)
def test_writable_parameter_is_allowed(family: str, code: str, state: StateKind) -> None:
    profile = library.load(family)
    assert write_refusal(profile, profile[code], state) is None


def test_unverified_parameter_is_writable_if_confirmed() -> None:
    profile = library.load("atv21")
    assert write_refusal(profile, profile["F111"], "stopped", {"F112"}) is not None
    assert write_refusal(profile, profile["F111"], "stopped", {"F111"}) is None
    running = write_refusal(profile, profile["F111"], "running", {"F111"})
    assert running is not None
    assert running.reason == "running"


@pytest.mark.parametrize("family", FAMILIES)
def test_command_words_are_not_settings(family: str) -> None:
    """No word that can start a motor is ever taken for a setting."""
    profile = library.load(family)
    channel = profile.quantity("command_channel")
    for chart in profile.data.charts:
        words = {chart.command, *(order.parameter for order in chart.orders)} - {""}
        for code in words - {channel.code if channel else ""}:
            assert is_order(profile, profile[code]), code
            assert not is_setting(profile, profile[code]), code
    for reference in profile.data.references:
        assert not is_setting(profile, profile[reference.parameter])


@pytest.mark.parametrize("family", FAMILIES)
def test_settings_can_be_written_in_some_state(family: str) -> None:
    profile = library.load(family)
    settings = [p for p in profile.parameters if is_setting(profile, p)]
    assert settings
    for parameter in settings:
        found = write_refusal(profile, parameter, "stopped", {parameter.code})
        assert (found is None) != bool(parameter.forbidden), parameter.code
        assert needs_standstill(profile, parameter) or write_refusal(
            profile, parameter, "running", {parameter.code}
        ) == write_refusal(profile, parameter, "stopped", {parameter.code})
    assert "running" not in AT_REST


MARKS = [
    ("atv71", "ACC", {"lost at power-off until saved"}),
    ("atv71", "UNS", {"stopped only", "lost at power-off until saved"}),
    ("atv312", "tbr", {"stopped only", "takes effect after a reset of the drive",
                       "lost at power-off until saved", "changes the line itself"}),
    ("atv21", "F875", {"takes effect after a reset of the drive", "stored at once (EEPROM)"}),
    ("atv21", "F111", {"stopped only", "stored at once (EEPROM)", "unverified"}),
    ("atv71", "CMD", {"lost at power-off"}),
]  # fmt: skip


@pytest.mark.parametrize(("family", "code", "expected"), MARKS)
def test_parameter_has_its_marks(family: str, code: str, expected: set[str]) -> None:
    profile = library.load(family)
    assert set(marks(profile, profile[code])) == expected
    later = "takes effect after a reset of the drive" in expected
    assert waits_for_reset(profile, profile[code]) == later


@pytest.mark.parametrize("family", FAMILIES)
def test_disabling_the_timeout_is_warned_about(family: str) -> None:
    profile = library.load(family)
    watch = profile.data.communication_fault
    assert watch is not None
    timeout = profile[watch.timeout]
    if watch.off is not None:
        assert "timeout" in warning(profile, timeout, watch.off)
    assert warning(profile, timeout, 10) == ""
    for reaction in watch.reactions:
        reported = warning(profile, profile[watch.reaction], reaction.raw) if watch.reaction else ""
        assert bool(reported) == (reaction.motor_keeps_running and bool(watch.reaction))

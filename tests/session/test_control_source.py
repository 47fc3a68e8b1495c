"""Setting up the control source of simulated drives over a real line."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from tests.sweeps import kept
from tui.drive.control_source import SourceChange, source_changes
from tui.session.command import commander
from tui.session.work import OutcomeKind

from .test_command import ALTIVARS, bench


@pytest.mark.parametrize("family", kept(ALTIVARS, "atv21", "atv71"))
async def test_every_configuration_is_written_and_verified(family: str) -> None:
    async with bench(family) as made:
        profile = made.session.profile
        for source in profile.data.control_sources:
            made.commander.configure(source)
            assert source.name in await made.done()
            for setting in source.settings:
                assert made.drive.raw(setting.parameter) == setting.value, setting.parameter


async def test_only_differing_values_are_written() -> None:
    async with bench("atv71") as made:
        source = made.session.profile.data.control_sources[1]
        made.commander.configure(source)
        assert "FR2, RFC" in await made.done()
        made.commander.configure(source)
        assert "no change was necessary" in await made.done()


async def test_settings_that_the_drive_changes_again_are_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with bench("atv71") as made:
        source = made.session.profile.data.control_sources[1]
        found: list[list[SourceChange]] = []

        def changes(*of: Any) -> list[SourceChange]:
            found.append(source_changes(*of))
            return found[-1] if len(found) <= len(source.settings) else found[0]

        monkeypatch.setattr(commander, "source_changes", changes)
        made.commander.configure(source)
        reported = await made.done(OutcomeKind.REFUSED)
        assert reported.endswith(f"{source.name}: the drive has changed FR2, RFC again.")


async def test_control_source_is_not_changed_while_the_motor_turns() -> None:
    async with bench("atv71") as made:
        made.commander.refer("20Hz")
        await made.done()
        await made.order("forward")
        before = made.writes()
        made.commander.configure(made.session.profile.data.control_sources[3])
        assert "with the motor stopped" in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == before


async def test_unreadable_word_changes_nothing() -> None:
    async with bench("atv71", protects=frozenset({"RFC"})) as made:
        before = made.writes()
        made.commander.configure(made.session.profile.data.control_sources[1])
        assert "RFC cannot be read" in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == before


async def test_value_out_of_range_is_not_written() -> None:
    async with bench("atv71") as made:
        before = made.writes()
        source = made.session.profile.data.control_sources[1]
        settings = [msgspec.structs.replace(setting, value=999) for setting in source.settings]
        made.commander.configure(msgspec.structs.replace(source, settings=settings))
        assert "999" in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == before

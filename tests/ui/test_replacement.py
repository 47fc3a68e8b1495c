"""A drive that replaces another one: offer, differences, and nothing written without a command."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet, SetHead, dump_set
from tui.screens.parameters.set_keys import Skipped, about_set

from .test_command_flows import Bench, bench, writes
from .test_flows import until

OLD = {"Inr": 1, "ACC": 55, "dEC": 42, "HSP": 450, "SP2": 120, "COd": 1234, "UnS": 400}


def stored(folder: Path, **raws: int) -> tuple[Path, ParameterSet]:
    """The set of a predecessor as a file."""
    identity = {"reference": "ATV31HU09M3", "version": "1.7"}
    head = SetHead("atv31", time="2026-11-20T10:00:00+01:00", device=1, identity=identity)
    values = ParameterSet(head, raws)
    path = folder / "old.toml"
    path.write_text(dump_set(library.load("atv31"), values), "utf-8")
    return path, values


async def event(made: Bench, *parts: str) -> None:
    """Wait for an event with these texts."""

    def reported() -> bool:
        return any(all(p in event.text for p in parts) for event in made.app.events.events)

    await until(made.pilot, reported)


async def test_replacement_is_offered_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = stored(tmp_path, **OLD)
    monkeypatch.setattr("tui.session.settings.predecessor.predecessor_set", lambda *_: found)
    async with bench("atv312") as made:
        await event(made, "may be new: 3 of 3 settings", "2026-11-20 10:00", "Press Ctrl+D")
        await made.pilot.press("2", "ctrl+d")
        await event(made, "old.toml: 4 can be staged", "Rating: the same model.")
        about = about_set(found[0], library.load("atv312"), {})
        assert (about.reported, about.alarm) == ("predecessor", False)
        await event(
            made, "Predecessor: Altivar 31, ATV31HU09M3", "model. Firmware: another version"
        )
        await event(made, "drivepanel accept")
        assert len(made.app.chosen.editor.staging.edits) == 0  # type: ignore[union-attr]
        await made.pilot.press("i")
        await until(made.pilot, lambda: isinstance(made.app.screen, Skipped))
        skipped = made.app.screen
        assert isinstance(skipped, Skipped)
        assert {item.code: item.reason for item in skipped._left} == {
            "atv31 COd": "no counterpart", "UnS": "rating",
        }  # fmt: skip
        assert len(made.app.chosen.editor.staging.edits) == 4  # type: ignore[union-attr]
        assert writes(made.app) == []


@pytest.mark.sweep
@pytest.mark.parametrize("raws", [{}, {"ACC": 30, "HSP": 500, "dEC": 30, "SP2": 100}])
async def test_drive_is_not_offered_a_set_without_changes(
    raws: dict[str, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = stored(tmp_path, **raws) if raws else None
    sought: list[object] = []
    monkeypatch.setattr(
        "tui.session.settings.predecessor.predecessor_set",
        lambda *where: sought.append(where) or found,  # type: ignore[func-returns-value]
    )
    async with bench("atv312") as made:
        await until(made.pilot, lambda: bool(sought))
        await made.pilot.press("2", "3")
        assert not any("may be new" in event.text for event in made.app.events.events)

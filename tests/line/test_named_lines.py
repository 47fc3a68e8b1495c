"""The panel in a terminal, opened by a line's name and by the environment."""

from __future__ import annotations

import pytest

from tui.session.connect.named_lines import settings_file

from .pty_panel import panel_on_a_pty


def pump(line: str) -> None:
    """`pump` is the first drive of a line from now on."""
    settings_file().parent.mkdir(parents=True, exist_ok=True)
    settings_file().write_text(f'[lines.pump]\nline = "{line}"\ndevice = 1\n', "utf-8")


@pytest.mark.parametrize("words", [("pump",), ()], ids=["named", "left out"])
def test_panel_opens_on_the_drive_of_a_name(words: tuple[str, ...]) -> None:
    def named(line: str) -> tuple[str, ...]:
        pump(line)
        return words

    with panel_on_a_pty(named=named, environment={"DRIVEPANEL_LINE": "pump"}) as panel:
        before = len(panel.log.writes)
        panel.type(" ")
        panel.stopped(before)

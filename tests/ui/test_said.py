"""What work on a drive has come to gives way to what the next key has come to."""

from __future__ import annotations

from tui.screens.blocks.screen import BlocksScreen
from tui.session.console import DriveConsole

from . import fakes
from .test_block_pictures import scanner
from .test_flows import shown


async def test_a_refusal_gives_way_to_what_is_proposed_next() -> None:
    block_editor = scanner()
    block_editor.refuse("NMA1 differs.")
    app = fakes.app_of()
    app.opened = fakes.opened()
    console = DriveConsole(block_editor.session, block_editor.journal)
    console.blocks = block_editor
    async with app.run_test(size=(80, 24)) as pilot:
        screen = BlocksScreen(console)
        await app.push_screen(screen)
        await pilot.pause()
        screen.look()
        assert "NMA1 differs" in shown(app, "message")
        await pilot.press("delete")
        assert "1 slots proposed otherwise" in shown(app, "message")
        block_editor.refuse("No output slot is in use.")
        screen.look()
        assert "No output slot" in shown(app, "message")

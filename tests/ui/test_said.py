"""What work on a drive has come to gives way to what the next key has come to."""

from __future__ import annotations

from tui.screens.blocks.screen import BlocksScreen
from tui.screens.parameters.screen import ParametersScreen
from tui.session.console import DriveConsole
from tui.session.work import OutcomeKind

from . import fakes
from .test_block_pictures import scanner
from .test_flows import shown
from .test_parameter_pictures import editor_of, say


async def test_a_refusal_gives_way_to_what_the_next_key_says() -> None:
    console = editor_of(fakes.READY)
    say(console.editor, OutcomeKind.REFUSED, "HSP: the drive refused with exception 4.")
    app = fakes.app_of()
    app.opened = fakes.opened()
    async with app.run_test(size=(80, 24)) as pilot:
        screen = ParametersScreen(console)
        await app.push_screen(screen)
        await pilot.pause()
        screen.look()
        assert "exception 4" in shown(app, "message")
        await pilot.press("w")
        assert "exception 4" not in shown(app, "message")
        assert "Nothing is staged" in shown(app, "message")
        say(console.editor, OutcomeKind.DONE, "1 written and read back")
        screen.look()
        assert "1 written and read back" in shown(app, "message")


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

"""Keys of Scanner other than those of its tables: files, user words, writing through outputs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from tui.drive.blocks.assignment import MappingError, no_blocks
from tui.drive.blocks.user_words import COUNT, UserWord, UserWords, format_named, word_named
from tui.drive.errors import DriveError
from tui.drive.small_file import read_small_text
from tui.session.blocks.editor import BlockEditor
from tui.session.paths import state_folder

from ..command.arming import ArmingKeys
from ..dialogs.ask import Ask, fault_of_new


class BlockKeys(ArmingKeys):
    """Actions of these keys; the block editor does the work."""

    @property
    def block_editor(self) -> BlockEditor:
        """Present and staged assignments."""
        return self.console.blocks

    def _try(self, work: Callable[[], None]) -> None:
        self.passed = self.block_editor.message
        try:
            work()
        except DriveError as refused:
            self.block_editor.refuse(str(refused))
        self.look()

    def _refuse(self, text: str) -> None:
        self.block_editor.refuse(text)
        self.look()

    def action_exchange(self) -> None:
        """Write values through the outputs."""
        block_editor = self.block_editor
        if not self._may_write():
            return

        try:
            held = block_editor.example() or "not read yet"
            about = f"CODE=VALUE for one or more output slots. Present values: {held}"
        except DriveError as refused:
            self._refuse(str(refused))
            return

        def wrong(text: str) -> str:
            try:
                block_editor.intended(text)
            except DriveError as refused:
                return str(refused)
            return ""

        def given(text: str | None) -> None:
            if not text:
                return
            try:
                agreed = block_editor.intended(text)
            except DriveError as refused:
                self._refuse(str(refused))
                return

            question = "Write through the outputs?"
            work = partial(block_editor.exchange, agreed)
            self._ask(question, agreed.follows, "Write", "Cancel", work)

        requested = Ask("Write through the outputs", wrong, about=about, takes="Continue")
        self.app.push_screen(requested, given)

    # Files and user words

    def action_save_file(self) -> None:
        """Ask for a file, and save the assignment with its staged changes."""
        plans = self.block_editor.proposals.assignments
        if not plans:
            self._refuse("Nothing to save: no slot has been read yet.")
            return

        def given(name: str | None) -> None:
            if name:
                self._try(lambda: self._save(Path(name).expanduser()))

        proposed = f"{self.session.profile.id}-{self.session.device}-blocks.toml"
        about = "The assignment with its staged changes, one slot per line (TOML)."
        text = str(Path.cwd() / proposed)
        requested = Ask("Save to", fault_of_new, text=text, about=about, takes="Save")
        self.app.push_screen(requested, given)

    def _save(self, path: Path) -> None:
        from tui.drive.blocks.file import dump_blocks
        from tui.drive.settings.set_file import write_file

        block_editor, profile = self.block_editor, self.session.profile
        plans = block_editor.proposals.assignments
        note = f"{profile.name}, device {self.session.device}, {self.session.line_text}"
        write_file(path, dump_blocks(profile, plans, note))
        self.app.notify(f"Saved: {path}", timeout=5)

    def action_load_file(self) -> None:
        """Choose a file, and stage its assignment."""
        from ..dialogs.pick_file import PickFile

        if not self.block_editor.proposals.blocks:
            self._refuse(no_blocks(self.session.profile))
            return

        def given(name: str | None) -> None:
            if name:
                self._try(lambda: self._load(Path(name).expanduser()))

        question = "Open an assignment. It is staged, not written."
        self.app.push_screen(PickFile(question, [], [Path.cwd(), state_folder()]), given)

    def _load(self, path: Path) -> None:
        from tui.drive.blocks.file import load_blocks

        try:
            text = read_small_text(path)
        except OSError as error:
            raise MappingError(f"{path} cannot be read: {error.strerror}.") from error
        except UnicodeDecodeError as error:
            raise MappingError(f"{path}: byte {error.start} is not UTF-8 text.") from error
        for plan in load_blocks(text, path.name, self.session.profile).values():
            self.block_editor.proposals.propose(plan)

    def action_words(self) -> None:
        """Choose the four user words."""
        profile = self.session.profile

        def wrong(text: str) -> str:
            try:
                self._words_typed(text)
            except DriveError as refused:
                return str(refused)
            return ""

        def given(text: str | None) -> None:
            if text is not None:
                self.block_editor.assign_words(self._words_typed(text))
                self.look()

        def spelled(word: UserWord) -> str:
            parameter = profile.at(word.address) if word.address else None
            name = parameter.code if parameter else f"W{word.address}"
            return f"{name if word.address else 'none'} {word.format}"

        about = (
            "Four words with commas between. Each is a code or address, then hex, signed,"
            " unsigned or bits. ----- means: not assigned, unknown to the drive, or protected."
        )
        text = ", ".join(spelled(word) for word in self.block_editor.words)
        self.app.push_screen(Ask("User words", wrong, text=text, about=about), given)

    def _words_typed(self, text: str) -> UserWords:
        """Parse four words such as `LCR signed, W7121 hex, none`. Raises DriveError."""
        found: list[UserWord] = []
        for part in text.split(",")[:COUNT]:
            name, _, format = part.strip().partition(" ")
            found.append(
                word_named(
                    self.session.profile, name or "none", format_named(format.strip() or "hex")
                )
            )
        return (*found, *(UserWord(),) * (COUNT - len(found)))

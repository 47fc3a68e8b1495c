"""Keys of the Parameters screen that handle parameter sets: back up, compare, stage a set."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from tui.bus.errors import LineError
from tui.drive.errors import DriveError
from tui.drive.plain import plain
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.settings.parameter_set import ParameterSet, dump_set
from tui.drive.settings.restore_plan import RestoreItem, RestorePlan
from tui.drive.settings.selection import Choice
from tui.drive.settings.set_file import read_set, write_file
from tui.drive.settings.writable import is_setting
from tui.session.paths import state_folder
from tui.session.read.upload import Upload, head_of, setting_codes
from tui.widgets.palette import PLAIN, STRONG
from tui.widgets.plain import Plain

from ..dialogs.ask import Ask, fault_of_new
from ..dialogs.pick_file import FileAbout, PickFile
from ..dialogs.question import KeyQuestion, hint
from .parameter_list import ParameterKeys

SKIPPED_KEYS = hint(("Enter or Esc", "Close"), ("Up, Down", "Scroll"))


class Skipped(KeyQuestion[None]):
    """A list that scrolls."""

    BINDINGS: ClassVar = [Binding("enter", "no", show=False)]

    def __init__(self, staged: int, label: str, left: Sequence[RestoreItem]) -> None:
        super().__init__()
        self._head = f"{staged_text(staged, label)} Skipped {len(left)}."
        self._left = left

    def dialog(self) -> ComposeResult:
        """The number of staged values, and each skipped value with its reason."""
        table = Table.grid(padding=(0, 2, 0, 0))
        for item in self._left:
            table.add_row(
                Text(plain(item.code), STRONG, no_wrap=True), Text(plain(item.text), PLAIN)
            )
        with Vertical(id="dialog"):
            yield Plain(self._head, id="question")
            with VerticalScroll(id="says"):
                yield Plain(table)
            yield Plain(SKIPPED_KEYS, id="hint")


def staged_text(count: int, label: str) -> str:
    """Return how many values were staged from a file or a drive."""
    return f"Staged {count} from {label}." if count else f"Nothing staged from {label}."


def difference_text(label: str, writes: int, equal: int, skips: int) -> str:
    """Return how a set differs from the drive; only counts that are not zero."""
    counts = ((writes, "can be staged"), (equal, "equal"), (skips, "skipped"))
    parts = [f"{count} {text}" for count, text in counts if count]
    if not writes:
        parts.insert(0, "nothing can be staged")
    return f"{label}: {', '.join(parts)}."


def about_set(path: Path, profile: Profile, raws: Mapping[str, int]) -> FileAbout:
    """Return the drive of a parameter set, and the number of settings that differ.

    `raws` holds the values read so far; settings that are not read yet count as equal.
    """
    try:
        values = read_set(path, path.name)
    except DriveError:
        return FileAbout(reported="invalid file", alarm=True)
    head = values.head
    named = head.identity.get("name") or head.family or head.profile
    drive = f"{head.device:>2} {named}" if head.device else named
    if head.profile != profile.id:
        from tui.drive.settings.replacement import predecessor_families

        if head.profile in predecessor_families(profile):
            return FileAbout(drive, "predecessor")
        return FileAbout(drive, "other family", alarm=True)
    known = [code for code in values.raws if code in raws and profile.get(code)]
    different = [code for code in known if raws[code] != values.raws[code]]
    count = sum(is_setting(profile, profile[code]) for code in different)
    if not known:
        return FileAbout(drive, "not compared")
    differences = "1 difference" if count == 1 else f"{count} differences"
    return FileAbout(drive, differences if count else "equal")


NO_BACKUP = "No backup of this drive on this line in this folder or in the backup folder."
TEST_AFTERWARDS = "After writing, test the drive with drivepanel accept."
SAVED_ALL = "Saved: {count} parameters, in {path}"
SAVED_SOME = "Saved: {count} parameters, without {absent} that the drive does not report, in {path}"


class SetKeys(ParameterKeys):
    """Reads and writes files of parameter sets; differences of a set are staged, not written."""

    # Back up and report

    def action_save_file(self) -> None:
        """Ask for a file, read the settings, write them."""
        about = "Every setting, in units and raw, one per line (TOML)."
        self._ask_for_file("Back up to", "toml", about, self._set_text, self._setting_codes)

    def action_back_up_now(self) -> None:
        """Read the settings and write them to a new file; ask for its name if it exists already."""
        path = self._new_path("toml")
        if fault_of_new(str(path)):
            self.action_save_file()
        else:
            work = self._read_to_file(path, self._set_text, self._setting_codes)
            self.run_worker(work, exclusive=True, group="sets")

    def _set_text(self, values: ParameterSet, _path: Path) -> str:
        return dump_set(self.session.profile, values)

    @property
    def _setting_codes(self) -> list[str]:
        return setting_codes(self.session.profile)

    def _new_path(self, suffix: str) -> Path:
        when = time.strftime("%Y%m%d-%H%M")
        return Path.cwd() / f"{self.session.profile.id}-{self.session.device}-{when}.{suffix}"

    def action_report(self) -> None:
        """Ask for a file, read everything, and write a report for a customer."""
        from tui.session.journal_reading import entries_of
        from tui.session.report import report_text
        from tui.session.report_page import PAGE_SUFFIXES, page_text
        from tui.session.report_trends import linked, report_trend_lines, report_trends, trend_files
        from tui.session.startup.progress import start_up_lines

        session, profile = self.session, self.session.profile
        device, line = session.device, self.app.line_text
        recorder = self.app.opened.recorder if self.app.opened is not None else None
        now = self.app.clock.wall()

        def text(values: ParameterSet, path: Path) -> str:
            entries = entries_of(self.editor.journal, self.session.line_text, device)
            if path.suffix.casefold() in PAGE_SUFFIXES:
                return page_text(profile, values, entries, path)
            files = recorder.files() if recorder is not None else []
            trends = report_trends(files, device, profile, entries, now)
            drawn = trend_files(trends, path.stem)
            for name, svg in drawn.values():
                write_file(path.with_name(name), svg)
            lines = report_trend_lines(trends, linked(drawn))
            return report_text(profile, values, entries, lines, start_up_lines(session, line))

        about = (
            "Identity, line, changed settings, control source, communication loss reaction, faults,"
            " last trip and run (as SVG files), writes by Drive Panel (Markdown). A name ending in"
            " .html or .txt: one page for the customer."
        )
        self._ask_for_file("Report to", "md", about, text, [])

    def _ask_for_file(
        self,
        question: str,
        suffix: str,
        about: str,
        text: Callable[[ParameterSet, Path], str],
        codes: list[str],
    ) -> None:
        """Ask for a file, read these codes (all if empty), and write the text to it."""

        def reported(name: str | None) -> None:
            if name:
                work = self._read_to_file(Path(name).expanduser(), text, codes)
                self.run_worker(work, exclusive=True, group="sets")

        proposed = str(self._new_path(suffix))
        requested = Ask(question, fault_of_new, text=proposed, about=about, takes="Save")
        self.app.push_screen(requested, reported)

    async def _read_to_file(
        self, path: Path, text: Callable[[ParameterSet, Path], str], codes: list[str]
    ) -> None:
        def progress(done: int, count: int) -> None:
            self._tell_reading(f"{path.name}: {done} of {count}")

        upload = Upload(self.session, codes, progress)
        try:
            await upload.run()
            values = upload.parameter_set()
            # the disk may hang
            await asyncio.to_thread(lambda: write_file(path, text(values, path)))
        except (LineError, DriveError) as error:
            self._refuse(f"Not saved: {error}")
        else:
            text_of_result = SAVED_SOME if upload.absent else SAVED_ALL
            count, absent = len(upload.raws), len(upload.absent)
            self.note(text_of_result.format(count=count, absent=absent, path=path))
        finally:
            self._tell_reading("")

    def _tell_reading(self, text: str) -> None:
        self.reading = text
        self.look()

    # Compare

    def action_load_file(self) -> None:
        """Choose what to compare with: a file, another drive, or the factory settings."""

        def reported(text: str | None) -> None:
            if text:
                self.run_worker(self._compare(text), exclusive=True, group="sets")

        others = [("factory", "factory settings")]
        consoles = self.app.fleet.consoles if self.app.fleet else []
        others += [
            (str(console.device), f"drive {console.device}, {console.session.profile.name}")
            for console in consoles
            if console is not self.console
        ]
        question = "Compare with a file. Press i to stage its differences."
        folders = [Path.cwd(), state_folder()]
        profile, raws = self.session.profile, dict(self.editor.values.raws)

        def about(path: Path) -> FileAbout:

            return about_set(path, profile, raws)

        self.app.push_screen(PickFile(question, others, folders, about), reported)

    def action_compare_newest(self) -> None:
        """Compare with the newest backup of this drive on this line."""
        self.run_worker(self._compare_newest(), exclusive=True, group="sets")

    async def _compare_newest(self) -> None:
        from tui.session.settings.predecessor import predecessor_set

        session = self.session
        where = session.profile, session.line_text, session.device
        newest = await asyncio.to_thread(predecessor_set, *where)
        if newest is None:
            self.note(NO_BACKUP, "Press Ctrl+O to choose a file.")
        else:
            await self._compare(str(newest[0]))

    async def _compare(self, text: str) -> None:
        editor = self.editor
        typed = text.strip()
        editor.source = None
        try:
            if typed.casefold() == "factory":
                editor.other, editor.other_label = {}, "factory"
                self.note("Compared with the factory settings. Changed lists the differences.")
                return
            if typed.isdecimal():
                await self._compare_drive(int(typed))
            else:
                await self._compare_file(typed)
            if editor.source is not None:
                await self._look_at_source()
        except (LineError, DriveError) as error:
            self._refuse(str(error))
        finally:
            self._tell_reading("")

    async def _compare_file(self, name: str) -> None:
        path = Path(name)
        # errors name the file without its folders: a long path leaves no room for the error
        self.editor.source = await asyncio.to_thread(lambda: read_set(path.expanduser(), path.name))
        self.editor.other_label = path.name

    async def _compare_drive(self, device: int) -> None:
        found = self.app.fleet.console(device) if self.app.fleet else None
        if found is None:
            return
        other = found.session

        def progress(done: int, count: int) -> None:
            self._tell_reading(f"reading drive {device}: {done} of {count}")

        upload = Upload(other, setting_codes(other.profile), progress)
        await upload.run()
        self.editor.source = upload.parameter_set()
        self.editor.other_label = f"device {device}"

    async def _look_at_source(self) -> None:
        """Read the drive's settings, and report what can be staged and what is skipped."""
        editor = self.editor
        assert editor.source is not None
        self._tell_reading("reading the settings")
        plan = await editor.plan()
        same_family = editor.source.head.profile == self.session.profile.id
        editor.other = dict(editor.source.raws) if same_family else plan_values(plan)
        if not editor.other:
            editor.other = {"": 0}
        writes, skips = plan.count("write"), plan.count("skip")
        rating = self._report_predecessor()
        found = difference_text(editor.other_label, writes, plan.count("equal"), skips)
        self.note(f"{found} {rating}".rstrip(), "Press i to stage." if writes else "")
        self.listed.choose(Choice("differs"))
        self.clear_search()

    def _report_predecessor(self) -> str:
        """Report how rating and firmware compare, if the set is of another drive at this address.

        Return the sentence about the rating; empty for a set of this drive.
        """
        from tui.drive.settings.replacement import identity_lines, is_of_another_drive

        source, session = self.editor.source, self.session
        now = head_of(session)
        if source is not None and is_of_another_drive(now, source.head):
            old = library.load(source.head.profile)
            held = self.editor.values.raws
            rows = identity_lines(session.profile, now, held, old, source)
            self.note(" ".join((*rows, TEST_AFTERWARDS)))
            return rows[2]
        return ""

    def action_stage_set(self) -> None:
        """Stage the differences of the set; nothing is written."""
        if self.editor.source is None:
            self.note("Nothing to stage from.", "Press Ctrl+O to choose a file or another drive.")
            return
        self.run_worker(self._stage_set(), exclusive=True, group="sets")

    async def _stage_set(self) -> None:

        editor = self.editor
        try:
            plan = await editor.plan()
        except (LineError, DriveError) as error:
            self._refuse(str(error))
            return
        editor.staging.take_plan(plan)
        left = [item for item in plan.items_of_kind("skip") if item.reason != "no setting"]
        count = len(plan.edits)
        keys = self.how_to_write("all" if count > 1 else "it") if count else ""
        self.note(staged_text(count, editor.other_label), keys)
        if left:
            self.app.push_screen(Skipped(len(plan.edits), editor.other_label, left))


def plan_values(plan: object) -> dict[str, int]:
    """The raw values that a plan would write, by code."""
    assert isinstance(plan, RestorePlan)
    return {edit.code: edit.new for edit in plan.edits}

"""List of frames, decoded or as bytes, with pause, scrolling, filter, search and saving."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import ClassVar, Literal, Protocol

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.widgets import Input

from tui.bus.api import Frame
from tui.bus.link import Link, TcpLink, label
from tui.drive.profile.profile import Profile
from tui.drive.sentences import counted
from tui.widgets.drawing import rule
from tui.widgets.fields import JOINS_KEY, WordField
from tui.widgets.lines import Lines
from tui.widgets.plain import Plain

from ..base import PanelScreen
from .choice import choice_of, chosen, decoded
from .frame_view import BESIDE_BYTES, frame_line, frames_text, gaps
from .saving import KeptFrames, ask_where

Page = Literal["words", "bytes", "sum"]
PAGES: tuple[Page, ...] = ("words", "bytes", "sum")
FEW = 6
"""Maximum frames shown on a slow link while the list is not paused."""
HEADINGS = {
    (False, False): "{heading}",
    (False, True): "{heading} (paused)",
    (True, False): "{heading}, filter: {filter}",
    (True, True): "{heading}, filter: {filter} (paused)",
}
"""Heading of the list; the keys are (filtered, paused)."""
FILTER_HINT = "drive, function, error or text, for example 2-read-error"
FIND_HINT = "drive, function, error or text; Enter finds the next older frame"


def count_text(matches: int, kept: int, *, filtered: bool) -> str:
    """Return how many frames are kept, and with a filter, how many match."""
    if not kept:
        return "no frame yet"
    if filtered:
        return f"{matches or 'none'} of {counted(kept, '1 frame', '{count} frames')}"
    return counted(kept, "1 frame", "{count} frames")


class KeptLine(Protocol):
    """Line with its recorded frames, and the profiles that decode them."""

    @property
    def link(self) -> Link:
        """Line on which the frames were recorded."""

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The recorded frames, oldest first; older ones are dropped."""

    def profile(self, device: int) -> Profile | None:
        """Return the profile that decodes the frames of a drive; None if it is unknown."""

    def raws(self, device: int) -> Mapping[str, int]:
        """Return the known raw values of a drive by code; some scale other values."""


class FrameListScreen(PanelScreen):
    """Frames of a line, the newest at the bottom; the last page summarizes them."""

    LOOK = 0.5
    AUTO_FOCUS: ClassVar = ""
    """Empty: in a focused field, Space would be text instead of a stop."""

    def __init__(self) -> None:
        super().__init__()
        self._source: KeptLine
        """Line whose frames are listed; each subclass sets it."""
        self._heading = "Frames on the line"
        self._held: tuple[Frame, ...] | None = None
        self._up = 0
        """Number of chosen frames below the last visible one."""
        self._page: Page = "words"
        self._filter = ""
        self._asking: Literal["", "filter", "find"] = ""
        self._found: Frame | None = None
        self._room = 1
        self._since_epoch = 0.0
        """Seconds to add to a frame's time to get seconds since 1970.

        Computed once, so that shown times do not change when the clock is set.
        """

    def body(self) -> ComposeResult:
        """Yield the list, and below it the field for a filter or search."""
        yield Lines(id="frames")
        with Horizontal(id="wanted"):
            yield Plain("", id="which")
            yield WordField(id="typed")

    def on_mount(self) -> None:
        """Compute the clock offset, and hide the field."""
        self._since_epoch = self.app.clock.wall() - self.app.clock.monotonic()
        self.query_one("#wanted").display = False

    # For subclasses

    def sum_lines(self, width: int, height: int) -> list[Text]:
        """Return the current last page in at most `height` rows."""
        raise NotImplementedError

    def _begin_sum(self) -> None:
        """Prepare the last page, which is now shown; does nothing by default."""

    def _scroll_sum(self, lines: int) -> None:
        """Scroll the last page by a number of rows; does nothing by default."""

    @property
    def _shows_sum(self) -> bool:
        """True if the last page replaces the frames."""
        return self._page == "sum"

    def draw(self, width: int) -> None:
        """Show the last page, or the newest frames that fit."""
        super().draw(width)
        self._room = max(1, self.size.height - (6 if self._asking else 5))
        if self._shows_sum:
            self.put("frames", self.sum_lines(width, self._room + 1))
            return
        frames = self._kept
        room, columns, few = self._room, width, ""
        if self.app.low_bandwidth and self._held is None:
            # a slow link cannot carry a full list on each refresh
            room, columns, few = min(room, FEW), min(width, BESIDE_BYTES - 1), "h for all, "
        places = self._places(frames)
        self._up = min(self._up, max(0, len(places) - room))
        end = len(places) - self._up
        count = count_text(len(places), len(frames), filtered=bool(self._filter))
        lines = [rule(self._title(), width, f"{few}{count}, j to find")]
        shown = places[max(0, end - room) : end]
        self.put("frames", lines + self._lines(frames, shown, columns))

    def _title(self) -> str:
        title = HEADINGS[bool(self._filter), self._held is not None]
        return title.format(heading=self._heading, filter=self._filter)

    @property
    def _kept(self) -> tuple[Frame, ...]:
        return self._held if self._held is not None else self._source.frames

    def _places(self, frames: Sequence[Frame]) -> list[int]:
        """Return the places of the frames that match the filter."""
        return chosen(frames, choice_of(self._filter), self._texts_of, tcp=self._is_tcp)

    def _lines(self, frames: Sequence[Frame], places: Sequence[int], width: int) -> list[Text]:
        between, reported = (
            gaps(frames),
            dict(zip(places, self._words(frames, places), strict=True)),
        )
        return [
            frame_line(
                frames[at],
                self._since_epoch + frames[at].time,
                between[at],
                width,
                reported[at] if self._page == "words" else "",
                found=frames[at] is self._found,
            )
            for at in places
        ]

    def _words(self, frames: Sequence[Frame], places: Sequence[int]) -> list[str]:
        """Decode the frames at these places; a request that is not shown still helps its reply."""
        if not places:
            return []
        first = places[0] - 1 if places[0] else 0
        reported = self._texts_of(frames[first : places[-1] + 1])
        return [reported[at - first] for at in places]

    def _texts_of(self, frames: Sequence[Frame]) -> list[str]:
        source = self._source
        return decoded(frames, source.profile, source.raws, self._guesses, tcp=self._is_tcp)

    def _guesses(self, device: int) -> Collection[str]:
        """Return the codes that a simulated drive makes by a guess; none of a real drive."""
        return ()

    @property
    def _is_tcp(self) -> bool:
        return isinstance(self._source.link, TcpLink)

    # Pausing, scrolling, pages

    def action_hold(self) -> None:
        """Pause or resume the list; show the newest frames."""
        self._held = self._source.frames if self._held is None else None
        self._up, self._found = 0, None
        self.look()

    def action_scroll(self, frames: int) -> None:
        """Scroll by a number of frames, negative for older ones; this pauses the list."""
        if self._shows_sum:
            self._scroll_sum(frames)
            return
        if self._held is None:
            self._held = self._source.frames
        self._up = max(0, self._up - frames)
        self.look()

    def action_other_page(self) -> None:
        """Show the next page: text, bytes, the last page."""
        self._page = PAGES[(PAGES.index(self._page) + 1) % len(PAGES)]
        if self._shows_sum:
            self._end_asking()
            self._begin_sum()
        self.look()

    # Filtering and finding

    def action_only(self) -> None:
        """Ask for a filter by drive, function, errors or text."""
        self._ask_for("filter", " only ", self._filter, FILTER_HINT)

    def action_find_frame(self) -> None:
        """Ask for frames to find; Enter pauses the list and marks the newest match."""
        self._found = None
        self._ask_for("find", " find ", "", FIND_HINT)

    def _ask_for(self, what: Literal["filter", "find"], title: str, text: str, hint: str) -> None:
        if self._shows_sum:
            self._page = "words"
        self._asking = what
        self.query_one("#wanted").display = True
        self.query_one("#which", Plain).update(title)
        field = self.query_one("#typed", Input)
        field.placeholder = hint
        with field.prevent(Input.Changed):
            field.value = text
        self.set_focus(field)
        self.call_after_refresh(self.look)

    def typing_keys(self) -> Sequence[tuple[str, str]]:
        """Return the effects of keys in the field of the filter, or of the search."""
        if self._asking == "find":
            return ("Enter", "next older"), JOINS_KEY, ("Esc", "end")
        return ("Enter", "keep filter"), JOINS_KEY, ("Esc", "clear")

    def _end_asking(self) -> None:
        self._asking = ""
        self.set_focus(None)
        self.query_one("#wanted").display = False
        self.call_after_refresh(self.look)

    @property
    def _wanted(self) -> str:
        """Typed text, with spaces for the hyphens that join words."""
        return self.query_one(WordField).words

    def on_input_changed(self) -> None:
        """Apply a typed filter at once."""
        if self._asking == "filter":
            self._filter = " ".join(self._wanted.split())
            self._up = 0
            self.look()

    def on_input_submitted(self) -> None:
        """Keep the filter, or find the next older frame that matches."""
        if self._asking == "filter":
            self._end_asking()
        elif wanted := self._wanted.strip():
            self._find(wanted)

    def _find(self, text: str) -> None:
        if self._held is None:
            self._held = self._source.frames
        frames = self._held
        places = self._places(frames)
        shown = [frames[at] for at in places]
        fits = chosen(shown, choice_of(text), self._texts_of, tcp=self._is_tcp)
        before = next((at for at, frame in enumerate(shown) if frame is self._found), len(shown))
        older = [at for at in fits if at < before]
        if not older:
            self.app.tell("No older frame matches." if self._found else "No frame matches.")
            self._found = None
            self.look()
            return
        self._found = shown[older[-1]]
        # center the match, so that frames before and after it are visible
        self._up = max(0, len(shown) - older[-1] - 1 - self._room // 2)
        self.look()

    def action_leave(self) -> None:
        """Close the field and clear the filter; without either, leave the screen."""
        if self._asking or self._filter:
            if self._asking != "find":
                self._filter = ""
            self._end_asking()
            return
        self._go_out()

    def _go_out(self) -> None:
        """Return to the screen below."""
        super().action_leave()

    # Saving

    def action_save_file(self) -> None:
        """Ask for a file, and save the frames that match the filter: for tshark, or as text."""
        frames = self._kept
        places = self._places(frames)
        line = label(self._source.link)
        count = count_text(len(places), len(frames), filtered=len(places) < len(frames))
        heading = [line, self._title(), count]
        text = frames_text(
            frames, places, self._all_words(frames, places), self._since_epoch, heading
        )
        shown = [frames[at] for at in places]
        ask_where(self.app, KeptFrames(shown, text, line, self._is_tcp, self._since_epoch))

    def _all_words(self, frames: Sequence[Frame], places: Sequence[int]) -> list[str]:
        reported = self._texts_of(frames)
        return [reported[at] for at in places]

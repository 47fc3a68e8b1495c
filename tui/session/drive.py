"""One drive on a line: what it is, what is known of it, what is being done to it, who may."""

from __future__ import annotations

import math
import weakref
from collections.abc import Mapping
from threading import Lock
from typing import Annotated

import msgspec
from msgspec import Meta

from tui.bus.api import ModbusLine
from tui.bus.bounds import MOST_CARE
from tui.bus.line_events import ControlDenied, DevicesStopped, LineEvent
from tui.bus.link import label
from tui.drive.chart import UNKNOWN, ChartState, fault_code, read_chart
from tui.drive.profile.profile import Profile

from .arming import Arming
from .byte_order import ByteOrder
from .clock import REAL_CLOCK, Clock
from .connect.contradiction import contradiction
from .connect.identify import DriveIdentity
from .connect.limits import limits_of
from .connect.prepared_stop import prepared_stop
from .image import RegisterImage
from .reading import Reading
from .shown import Rating
from .starts.keeper import StartKeeper
from .timeout_report import Timeout
from .work import WorkQueue

OWN_PROFILE = "Nothing is written by a profile that is not the drive's own."


class DriveSession:
    """A drive with its profile; the one owner of its registers, its work and its arming.

    It knows none of those who read, watch, command or edit the drive. For any thread.
    """

    def __init__(
        self,
        line: ModbusLine,
        device: int,
        profile: Profile,
        identity: DriveIdentity | None = None,
        clock: Clock = REAL_CLOCK,
    ) -> None:
        self.line = line
        self.device = device
        self.family = profile
        """Facts about every drive of its family."""
        self.profile = profile
        """The same, with what a person has taught of this drive."""
        self.identity = identity
        self.clock = clock
        """Clock of all work with the drive."""
        self.image = RegisterImage(profile, clock)
        """Known values of its registers."""
        self.arming = Arming(line, clock, device, self.care)
        """True if it may be written to from here."""
        self.guessed = False
        """True if its family was neither named nor told by the drive: never told as stopped."""
        self.contradiction = contradiction(identity, profile)
        """Contradiction between the drive's reported identity and its profile; empty if none."""
        if self.contradiction:
            self.arming.barred = f"Not armed: {self.contradiction} {OWN_PROFILE}"
        self.byte_order = ByteOrder(device)
        """True if the bytes of its words arrive as they should."""
        self.arming.trouble = lambda: self.byte_order.text
        self.work = WorkQueue(line, device, self.arming, clock)
        """Work in progress on it; a stop ends it."""
        self.work.on_change = self.request_full_read
        self.ratings: dict[str, Rating] = {}
        """Value of 100 %, by code, that a person entered from the nameplate."""
        self.commanded_at: float | None = None
        """When a command or reference was last sent to the drive from here (monotonic)."""
        self.timeout: Timeout | None = None
        """Its communication timeout; None before it was read."""
        self.reported_by_line = False
        """True if a command or reference word was written to it from here, a stop among them."""
        self.unsaved_settings = UnsavedSettings()
        """Settings written by this program that are lost at power-off until the drive saves
        them."""
        self.followed: tuple[str, ...] = ()
        """Codes of words that were written from here and are polled on."""
        self.prepared = prepared_stop(line, device, [profile])
        """The frames that stop it in any chart, for when its usual stop fails by an error here."""
        self.starts: StartKeeper | None = None
        """Records of its motor's starts; None if they are not kept."""
        self.rest_seen = -math.inf
        """When the motor was last seen at rest, or in an unknown state (monotonic)."""
        self.stirs = 0
        """Counts the moments after which every value is worth a new look."""
        line.describe(device, limits_of(profile))
        self._hear_others()

    def _hear_others(self) -> None:
        """Obey the stops of other programs on the line, and lose the drive to another commander.

        A session that nobody holds any more hears nothing.
        """
        held = weakref.ref(self)

        def hear(event: LineEvent) -> None:
            if (session := held()) is None:
                return
            match event:
                case DevicesStopped(devices, by, program) if session.device in devices:
                    session.work.stop(f"{by}, {program.text}")
                    if session.starts is not None:
                        session.starts.withdraw(session)
                    session.request_full_read()
                case ControlDenied(device, why) if session.device == device:
                    session.arming.disarm(why)

        weakref.finalize(self, self.line.facts.events.subscribe(hear))

    def care(self) -> bytes:
        """The care for the drive: how another process can stop it, should this one end."""
        return packed_care(self.family, self.identity, guessed=self.guessed)

    @property
    def known_identity(self) -> DriveIdentity:
        """Identity that the drive reports; empty if it reports none."""
        return self.identity or DriveIdentity(self.device, "", "", "", "", None, ())

    @property
    def unsaved(self) -> frozenset[str]:
        """Codes of settings written by this program that are lost at power-off until saved."""
        return self.unsaved_settings.codes

    @property
    def commanded(self) -> bool:
        """True if a command or reference was sent to the drive from here."""
        return self.commanded_at is not None

    def learn(self, profile: Profile) -> None:
        """Go by the family's profile with what was taught of this drive."""
        self.profile = profile
        self.request_full_read()

    def note_command(self) -> None:
        """A command or reference was sent."""
        self.reported_by_line = True
        self.commanded_at = self.clock.monotonic()

    def note_given(self) -> None:
        """Another program commands the drive: what its motor does is no longer from here."""
        self.commanded_at = None

    def take(self, found: Mapping[str, Reading]) -> None:
        """Keep what was read. Raises BytesSwapped, and forgets all, while words arrive swapped."""
        self.byte_order.note(self.profile, found, self.clock.monotonic())
        if (error := self.byte_order.error) is not None:
            self.image.forget()
            raise error
        self.image.take(found)

    def request_full_read(self) -> None:
        """Make every monitor re-read the whole drive."""
        self.stirs += 1

    def note_state(self, kind: str, time: float) -> None:
        """The drive was seen in a state: what needs a motor at rest may be changed in it."""
        if kind in ("running", "stopping"):
            return
        self.rest_seen = max(self.rest_seen, time)
        if self.starts is not None and kind != "unknown":
            self.starts.standing(self, time)

    @property
    def line_text(self) -> str:
        """The line as it is written."""
        return label(self.line.link)

    def state(self, longest: float) -> ChartState:
        """The drive's state by its words; unknown where its status is older than so many s.

        An old fault word shows nothing: the fault may have been reset since.
        """
        raws = self.image.trusted
        chart = self.profile.chart(raws)
        if chart is None or self.image.age(chart.status) > longest:
            return ChartState(UNKNOWN)
        fault = fault_code(self.profile)
        if fault and self.image.age(fault) > longest:
            raws = {code: raw for code, raw in raws.items() if code != fault}
        return read_chart(self.profile, raws)


class UnsavedSettings:
    """Raw values of settings that the drive keeps until power-off only, unless it saves them.

    What is saved is the value read before the first write from here, as long as nothing else has
    changed it since. If that value is not known, the setting counts as unsaved. For any thread.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._saved: dict[str, int | None] = {}
        self._held: dict[str, int | None] = {}
        self._known = True

    @property
    def codes(self) -> frozenset[str]:
        """The settings whose value is not known to be the saved one."""
        with self._lock:
            held = self._held.items()
            return frozenset(c for c, raw in held if raw is None or raw != self._saved[c])

    def note_write(self, code: str, before: int | None, now: int | None) -> None:
        """Note a write: what the drive held before it, and holds now; None if not known."""
        with self._lock:
            if code not in self._saved:
                self._saved[code] = before if self._known else None
            elif self._held[code] != before:
                self._saved[code] = None  # changed by another source, which may have saved it
            self._held[code] = now

    def note_value(self, code: str, raw: int) -> None:
        """Note what a setting holds that was written without a sure reply."""
        with self._lock:
            if code in self._held:
                self._held[code] = raw

    def forget_values(self) -> None:
        """Many settings may have changed: from now on no value read is known to be saved."""
        with self._lock:
            self._known = False
            self._saved = dict.fromkeys(self._saved)

    def clear(self) -> None:
        """The drive has saved all settings, or lost what was not saved."""
        with self._lock:
            self._saved, self._held, self._known = {}, {}, True


class CareData(msgspec.Struct, frozen=True):
    """The care for one drive, as it goes to the holder of its line."""

    profile: Annotated[bytes, Meta(max_length=MOST_CARE)]
    """As Profile.packed."""
    identity: DriveIdentity | None
    guessed: bool


def packed_care(profile: Profile, identity: DriveIdentity | None, *, guessed: bool) -> bytes:
    """The bytes of the care for a drive."""
    return msgspec.msgpack.encode(CareData(profile.packed, identity, guessed))

"""One drive on a line: its identity, its known values, the work on it, its arming."""

from __future__ import annotations

import json
import logging
import math
import weakref
from collections.abc import Mapping, Sequence
from threading import Lock
from typing import Annotated

import msgspec
from msgspec import Meta

from tui.bus.api import ModbusLine
from tui.bus.bounds import MOST_CARE
from tui.bus.line_events import ControlDenied, DevicesStopped, LineEvent
from tui.bus.link import label
from tui.bus.notes import LineNote
from tui.bus.prepared import PreparedWrite, prepared_write
from tui.drive.chart import UNKNOWN, ChartState, fault_code, read_chart
from tui.drive.first_stop import blind_stops
from tui.drive.profile.profile import Profile, digest_of, proof_text
from tui.drive.profile.schema import Parameter
from tui.drive.profile.stop_profile import stop_profile_of
from tui.drive.site_proof import is_proved_write, unproved_commands

from .arming import Arming
from .byte_order import ByteOrder
from .clock import REAL_CLOCK, Clock
from .connect.contradiction import contradiction
from .connect.identify import DriveIdentity
from .connect.limits import limits_of
from .event_notes import PROFILE_OF_DRIVE
from .image import RegisterImage
from .reading import Reading
from .shown import Rating
from .starts.keeper import StartKeeper
from .timeout_report import Timeout
from .work import WorkQueue

OWN_PROFILE = "Drive Panel does not write with the profile of another drive."


UNPROVED = (
    "the profile of {name} is written from public documents, and {proof}. A wrong word may start"
    " the motor."
)
"""Why a drive of an unproved profile is not armed, until a person confirms."""
UNPROVED_WRITE = (
    "Not written: {code} = this value is not proved on this site, and the profile of {name} is"
    " written from public documents. Confirm the profile first."
)

log = logging.getLogger(__name__)


class DriveSession:
    """A drive with its profile; the only owner of its registers, its work and its arming.

    It knows no reader, monitor, commander or editor of the drive. For any thread.
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
        """The same, with the scales that were learned for this drive."""
        self.identity = identity
        self.clock = clock
        """Clock of all work with the drive."""
        self.image = RegisterImage(profile, clock)
        """Known values of its registers."""
        self.arming = Arming(line, clock, device, self.care)
        """Until when this program may write to it."""
        self.guessed = False
        """True if its family was neither named nor reported by the drive; it is then never
        reported as stopped."""
        self.contradiction = ""
        """Contradiction between the drive's reported identity and its profile; empty if none."""
        compare_identity(self)
        self.is_unconfirmed = profile.data.profile.unproved
        """True if only stops and what this site has proved are written, because its profile is
        unproved, and no person has confirmed it."""
        if self.is_unconfirmed and not self.contradiction:
            self.bar_unconfirmed()
        self.byte_order = ByteOrder(device)
        """Evidence that the bytes of its words arrive swapped."""
        self.arming.trouble = lambda: self.byte_order.text
        self.work = WorkQueue(line, device, self.arming, clock)
        """Work in progress on it; a stop ends it."""
        self.work.on_change = self.request_full_read
        self.ratings: dict[str, Rating] = {}
        """Value of 100 %, by code, that a person entered from the nameplate."""
        self.commanded_at: float | None = None
        """When this program last sent it a command or reference (monotonic); None if never."""
        self.timeout: Timeout | None = None
        """Its communication timeout; None until it is read."""
        self.reported_by_line = False
        """True if this program has written a command, reference or stop word to it."""
        self.unsaved_settings = UnsavedSettings()
        """Settings written by this program that are lost at power-off until the drive saves
        them."""
        self.followed: tuple[str, ...] = ()
        """Codes of command words that this program has written; they are polled."""
        self.prepared = prepared_stop(line, device, [profile])
        """Frames that stop it in any chart, sent if an internal error prevents its usual stop."""
        self.starts: StartKeeper | None = None
        """Records of its motor's starts; None if they are not kept."""
        self.rest_seen = -math.inf
        """When it was last read in a state other than running or stopping (session's clock)."""
        self.reads_blocks = True
        """False in a replay: the line knows which parameters the recorded words of a block are."""
        self.full_reads_requested = 0
        """Number of requests to re-read every value."""
        line.describe(device, limits_of(profile))
        self.note_profile()
        self._hear_others()

    def bar_unconfirmed(self) -> None:
        """Allow arming, unless the profile is unproved, not confirmed, and its commands are not
        proved on this site."""
        barred = self.is_unconfirmed and unproved_commands(self.profile)
        self.arming.barred = unproved_text(self) if barred else ""

    def confirm_profile(self) -> None:
        """Allow arming although the profile is unproved.

        A person has confirmed it, or this process itself simulates the motor. A simulated drive of
        another process looks like a real one.
        """
        self.is_unconfirmed = False
        self.bar_unconfirmed()

    def note_profile(self) -> None:
        """Have the recorder of the line know by which profile this program reads the drive."""
        identity = self.known_identity
        note = {"profile": self.profile.id, "hash": digest_of(self.profile)}
        note |= {"reference": identity.reference, "version": identity.version}
        data = json.dumps(note).encode()
        self.line.facts.notes.leave(LineNote(self.device, PROFILE_OF_DRIVE, data))

    def _hear_others(self) -> None:
        """Obey the stops of other programs, and disarm if another program commands the drive.

        The subscription ends with the session.
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
        """Return the data by which another process can stop the drive if this one ends."""
        return packed_care(self.family, self.identity, guessed=self.guessed)

    @property
    def known_identity(self) -> DriveIdentity:
        """Identity that the drive reports; with empty fields if it reports none."""
        return self.identity or DriveIdentity(self.device, "", "", "", "", None, ())

    @property
    def unsaved(self) -> frozenset[str]:
        """Codes of settings written by this program that are lost at power-off until saved."""
        return self.unsaved_settings.codes

    @property
    def commanded(self) -> bool:
        """True if this program has sent the drive a command or reference."""
        return self.commanded_at is not None

    def learn(self, profile: Profile) -> None:
        """Use a profile with the scales that were learned for this drive."""
        self.profile = profile
        self.request_full_read()

    def note_command(self) -> None:
        """Remember that this program has sent a command or reference now."""
        self.reported_by_line = True
        self.commanded_at = self.clock.monotonic()

    def note_given(self) -> None:
        """Remember that another program commands the drive now."""
        self.commanded_at = None

    def take(self, found: Mapping[str, Reading]) -> None:
        """Store readings. While bytes arrive swapped, forget all values and raise BytesSwapped."""
        self.byte_order.note(self.profile, found, self.clock.monotonic())
        if (error := self.byte_order.error) is not None:
            self.image.forget()
            raise error
        self.image.take(found)

    def request_full_read(self) -> None:
        """Make every monitor re-read the whole drive."""
        self.full_reads_requested += 1

    def note_state(self, kind: str, time: float) -> None:
        """Note the kind of state in which the drive was seen at a time (monotonic).

        Settings that need standstill may have been changed in any state but a running one.
        """
        if kind in ("running", "stopping"):
            return
        self.rest_seen = max(self.rest_seen, time)
        if self.starts is not None and kind != "unknown":
            self.starts.standing(self, time)

    @property
    def line_text(self) -> str:
        """The line as a person types it."""
        return self.line.facts.simulated_as or label(self.line.link)

    def state(self, longest: float) -> ChartState:
        """Return the drive's state; unknown if its status is older than `longest` seconds.

        An old fault word is ignored: the fault may have been reset since.
        """
        raws = self.image.trusted
        chart = self.profile.chart(raws)
        if chart is None or any(self.image.age(code) > longest for code in chart.status_codes):
            return ChartState(UNKNOWN)
        fault = fault_code(self.profile)
        if fault and self.image.age(fault) > longest:
            raws = {code: raw for code, raw in raws.items() if code != fault}
        return read_chart(self.profile, raws)


def compare_identity(session: DriveSession) -> None:
    """Bar arming if the reported identity contradicts the profile."""
    session.contradiction = contradiction(session.identity, session.family)
    if session.contradiction:
        session.arming.barred = f"Not armed: {session.contradiction} {OWN_PROFILE}"


def replaced_by(session: DriveSession, identity: DriveIdentity) -> str:
    """Take the identity of another drive that answers now; return it as text, empty if none.

    No value of the drive before it counts any more, and nothing is written without arming.
    """
    before = session.known_identity
    same_profile = bool(identity.reference) or identity.profile == before.profile
    if identity.reference == before.reference and same_profile:
        return ""
    session.identity, session.arming.barred = identity, ""
    compare_identity(session)
    if session.is_unconfirmed and not session.contradiction:
        session.bar_unconfirmed()
    named = before.reference and identity.reference  # else it did not identify itself before
    another = f"Device {session.device} is another drive now: {identity.text}."
    text = session.contradiction or (another if named else "")
    if text:
        session.arming.disarm(text)
        session.commanded_at = None  # that was the other one
        session.image.forget()
        session.request_full_read()
    return text


class UnsavedSettings:
    """Settings that the drive loses at power-off, unless it saves them.

    The saved value is the one read before the first write of this program, unless another source
    has changed it since. If that value is not known, the setting counts as unsaved. For any thread.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._saved: dict[str, int | None] = {}
        self._held: dict[str, int | None] = {}
        self._known = True

    @property
    def codes(self) -> frozenset[str]:
        """Settings whose value is not known to be the saved one."""
        with self._lock:
            held = self._held.items()
            return frozenset(c for c, raw in held if raw is None or raw != self._saved[c])

    def note_write(self, code: str, before: int | None, now: int | None) -> None:
        """Note a write, with the raw values before and after it; None if not known."""
        with self._lock:
            if code not in self._saved:
                self._saved[code] = before if self._known else None
            elif self._held[code] != before:
                self._saved[code] = None  # changed by another source, which may have saved it
            self._held[code] = now

    def note_value(self, code: str, raw: int) -> None:
        """Note the value of a setting whose write had no clear reply."""
        with self._lock:
            if code in self._held:
                self._held[code] = raw

    def note_saved(self, code: str, raw: int) -> None:
        """Note that the drive has saved this value of a setting."""
        with self._lock:
            self._saved[code] = raw

    def forget_values(self) -> None:
        """Count no value as saved from now on, because many settings may have changed."""
        with self._lock:
            self._known = False
            self._saved = dict.fromkeys(self._saved)

    def clear(self) -> None:
        """Forget all, because the drive has saved its settings, or lost the unsaved ones."""
        with self._lock:
            self._saved, self._held, self._known = {}, {}, True


class CareData(msgspec.Struct, frozen=True):
    """Data by which the owner of the line can stop a drive without its program.

    It contains the profile: the owner may have other profile files, or the file may have changed.
    """

    profile: Annotated[bytes, Meta(max_length=MOST_CARE)]
    """As Profile.packed."""
    identity: DriveIdentity | None
    guessed: bool


def packed_care(profile: Profile, identity: DriveIdentity | None, *, guessed: bool) -> bytes:
    """Encode the data by which another process can stop a drive."""
    return msgspec.msgpack.encode(CareData(profile.packed, identity, guessed))


def unproved_text(session: DriveSession) -> str:
    """Return why a drive of an unproved profile is not armed."""
    profile = session.profile
    return f"Not armed: {UNPROVED.format(name=profile.name, proof=proof_text(profile))}"


def why_unproved(session: DriveSession, parameter: Parameter, raw: int) -> str:
    """Return why a write needs a person who confirms the profile; empty if it does not."""
    if not session.is_unconfirmed or is_proved_write(session.profile, parameter, raw):
        return ""
    return UNPROVED_WRITE.format(code=parameter.code, name=session.profile.name)


def prepared_stop(
    line: ModbusLine, device: int, families: Sequence[Profile]
) -> tuple[PreparedWrite, ...]:
    """Prepare the words that stop a drive of any of these families in any of their charts.

    Empty if there is no such word; an error must not keep a drive from being opened.
    """
    try:
        words = blind_stops([stop_profile_of(family) for family in families])
        limits = limits_of(families[0])
        return tuple(
            prepared_write(line.link, limits, device, word.address, word.values) for word in words
        )
    except Exception:
        log.exception("no stop is prepared for device %s", device)
        return ()

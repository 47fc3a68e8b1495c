"""Comparison of one drive with the statements of its profile; it only reads.

Each result is an `EvidenceFinding`. An answer proves an address, and a value can only contradict a
range. The display alone proves the meaning of a value, and only a person sees it.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial

from tui.bus.errors import DeviceException, ExchangeError, RequestRefused
from tui.bus.expectation import IDENTIFY
from tui.drive.errors import ValueRefused
from tui.drive.profile.evidence import statement_of
from tui.drive.profile.example_frames import ExampleFrame, FramePair, example_frames_of
from tui.drive.profile.schema import (
    Confidence,
    EvidenceFinding,
    EvidenceResult,
    Parameter,
    Quantity,
)
from tui.drive.sentences import counted, first_of
from tui.drive.shown import depends_on, number_of, shown_text
from tui.drive.teaching import parse_display
from tui.drive.values import check_raw, is_enumeration
from tui.wire.frames import BIT_READS, SPACES

from .drive import DriveSession
from .read.retrying_reader import RetryingReader
from .read.upload import ReadProgress, Upload

COMPARED_QUANTITIES: tuple[Quantity, ...] = (
    "mains_voltage",
    "dc_bus",
    "drive_thermal",
    "high_speed",
    "low_speed",
    "max_frequency",
    "acceleration",
    "deceleration",
    "rated_frequency",
    "rated_current",
    "output_frequency",
    "motor_current",
)
"""Quantities that a display shows and that are seldom 0, in the order in which they are asked."""
QUESTIONS_AT_MOST = 8
"""Values that a person is asked about, unless they are named."""
MOVED_AT_MOST = Decimal("0.1")
"""Share of a value by which it may move during a question. Else a display between the two reads
shows nothing about its scale."""
FROM_A_MANUAL: frozenset[Confidence] = frozenset({"site", "manual", "manual+public"})

AskDisplay = Callable[[Parameter], Awaitable[str]]
"""Ask what the display shows for a parameter; empty or `-` leaves it open."""


@dataclass(slots=True)
class Conformance:
    """A test of one drive; `findings` grow with each step."""

    session: DriveSession
    findings: list[EvidenceFinding] = field(default_factory=list)

    async def run(self, progress: ReadProgress | None = None) -> None:
        """Compare identity, example frames, and every readable parameter.

        Raises the line's errors.
        """
        self._compare_identity()
        for pair in example_frames_of(self.session.profile):
            self.findings.append(await self.send_frame(pair))
        upload = Upload(self.session, progress=progress)
        await upload.run()
        for code in upload.codes:
            self._compare_value(code, upload)

    def codes_to_ask(self) -> list[str]:
        """Return the codes whose meaning a display can prove, the least certain first."""
        profile = self.session.profile
        read = {f.name for f in self.findings if f.subject == "address" and f.result == "confirmed"}
        wanted = [
            p
            for q in COMPARED_QUANTITIES
            if (p := profile.quantity(q)) is not None and p.code in read
        ]
        wanted.sort(key=lambda p: p.confidence in FROM_A_MANUAL)
        return [p.code for p in wanted][:QUESTIONS_AT_MOST]

    async def compare_display(self, code: str, ask: AskDisplay) -> EvidenceFinding:
        """Compare a value with what the drive's display shows, and keep the finding.

        The value is read before and after the answer, because a measurement changes meanwhile. The
        question must not show it. Raises ValueRefused for an answer that is not a value, and the
        line's errors.
        """
        parameter = self.session.profile[code]
        before = await self._read(code)
        typed = (await ask(parameter)).strip()
        if typed in ("", "-"):
            finding = self._finding(parameter, "open", "The display was not compared.")
        else:
            seen = [raw for raw in (before, await self._read(code)) if raw is not None]
            result = self._compare(parameter, seen, typed)
            values = ", ".join(dict.fromkeys(self._text(parameter, raw) for raw in seen))
            raws = ", ".join(dict.fromkeys(map(str, seen)))
            text = f"Display {typed}, read {values} (raw {raws})."
            if not seen:
                text = f"Display {typed}. The value could not be read."
            finding = self._finding(parameter, result, text)
        self.findings = [f for f in self.findings if (f.subject, f.name) != ("value", code)]
        self.findings.append(finding)
        return finding

    def _finding(self, parameter: Parameter, result: EvidenceResult, seen: str) -> EvidenceFinding:
        names = self.session.profile.names(parameter).items()
        statement = statement_of(parameter, names)
        return EvidenceFinding(
            subject="value", name=parameter.code, statement=statement, result=result, seen=seen
        )

    def _compare(self, parameter: Parameter, seen: Sequence[int], typed: str) -> EvidenceResult:
        """Compare the display with the reads before and after it, between which a value may move.

        Raises ValueRefused as `_agrees`.
        """
        agreeing = [raw for raw in seen if self._agrees(parameter, raw, typed)]
        if agreeing:
            # 0 agrees with every scale
            return "confirmed" if any(agreeing) or is_enumeration(parameter) else "open"
        if not seen:
            return "open"
        if is_enumeration(parameter):
            return "open" if len(set(seen)) > 1 else "contradicted"
        image, profile = self.session.image, self.session.profile
        found = (number_of(profile, parameter, raw, image.raws, image.lacking) for raw in seen)
        values = [value for value in found if value is not None]
        number, unit = parse_display(typed)
        if unit and parameter.unit and unit.casefold() != parameter.unit.casefold():
            return "contradicted"
        if not values:
            return "open"
        least, most = min(values), max(values)
        if most - least > MOVED_AT_MOST * max(abs(least), abs(most)):
            # it may have been beyond the two reads, too
            moved = most - least
            return "open" if least - moved <= number <= most + moved else "contradicted"
        return "confirmed" if least < number < most else "contradicted"

    def _agrees(self, parameter: Parameter, raw: int, typed: str) -> bool:
        """Return True if a raw value means what was typed, to the decimals of the display.

        A display may show the number of a named value. Raises ValueRefused for an unknown name,
        because the profile may have the same value in other words.
        """
        profile, image = self.session.profile, self.session.image
        if is_enumeration(parameter):
            names = profile.names(parameter)
            known = {name.casefold(): value for value, name in names.items()}
            known |= {str(value): value for value in names}
            if typed.casefold() not in known:
                choices = first_of([f"{value} {name}" for value, name in names.items()], 8)
                raise ValueRefused(
                    f"{typed!r} is not a value of {parameter.code}. Use the number or the name of"
                    f" one: {choices}."
                )
            return known[typed.casefold()] == raw
        value = number_of(profile, parameter, raw, image.raws, image.lacking)
        if value is None:
            return False
        number, unit = parse_display(typed)
        if unit and parameter.unit and unit.casefold() != parameter.unit.casefold():
            return False
        step = Decimal(1).scaleb(int(number.as_tuple().exponent))
        return abs(value - number) < step

    def _text(self, parameter: Parameter, raw: int) -> str:
        image = self.session.image
        return shown_text(self.session.profile, parameter, raw, image.raws, image.lacking)

    async def _read(self, code: str) -> int | None:
        parameter = self.session.profile[code]
        found = await RetryingReader(self.session).ask([*depends_on(parameter), code])
        return found[code].raw if code in found else None

    def _compare_identity(self) -> None:
        identity, family = self.session.known_identity, self.session.profile
        if not identity.text:
            result: EvidenceResult = "open"
            seen = "The drive reports no identity."
        elif self.session.contradiction:
            result, seen = "contradicted", self.session.contradiction
        else:
            known = family.id in identity.candidates
            result, seen = ("confirmed" if known else "open"), f"It reports {identity.text}."
        self.findings.append(EvidenceFinding(subject="identity", name="", result=result, seen=seen))

    def _compare_value(self, code: str, upload: Upload) -> None:
        profile, image = self.session.profile, self.session.image
        parameter, raw = profile[code], upload.raws.get(code)
        address = f"{parameter.number}, function {parameter.function}, {parameter.type}"
        found = partial(EvidenceFinding, name=code, statement=address)
        if raw is None:
            # of another model, or of an option that is not fitted
            absent = upload.absent.get(code, "It was not read.")
            self.findings.append(found(subject="address", result="open", seen=absent))
            return
        text = f"{self._text(parameter, raw)} (raw {raw})"
        self.findings.append(found(subject="address", result="confirmed", seen=text))
        scale = profile.scale(parameter, image.raws, image.lacking)
        try:
            check_raw(parameter, raw, profile.names(parameter), scale)
        except ValueRefused as refused:
            self.findings.append(
                found(subject="range", result="contradicted", seen=f"Read {text}. {refused}")
            )

    async def send_frame(self, pair: FramePair) -> EvidenceFinding:
        """Repeat the request of a manual if it only reads, and compare the form of the reply."""
        printed = [_form(reply) for reply in pair.replies]
        result: EvidenceResult = "open"
        try:
            form = await self._form_of_reply(pair.request)
        except ExchangeError as error:
            form = str(error)
        if isinstance(form, tuple):
            # the objects of an identification depend on the model
            differs: EvidenceResult = "open" if form[0] == IDENTIFY else "contradicted"
            result = "confirmed" if form in printed else differs
            form = f"The drive gives {_form_text(form)}."
        return EvidenceFinding(
            subject="frame",
            name=pair.request.section,
            statement="".join(f"{frame.hex} " for frame in (pair.request, *pair.replies)).rstrip(),
            result=result,
            seen=form,
        )

    async def _form_of_reply(self, request: ExampleFrame) -> tuple[int, int] | str:
        """Return function and size of the reply, or function and exception; a reason if not sent.

        Raises the line's errors.
        """
        session, data = self.session, request.data
        device, function = session.device, data[1]
        try:
            if function in SPACES:
                if not self._is_own(function, data):
                    return "Not sent: it is for a card with its own address."
                address, count = (int.from_bytes(data[at : at + 2]) for at in (2, 4))
                reply = await session.line.read(device, address, count, function=function)
                bits = function in BIT_READS
                return function, (len(reply.words) + 7) // 8 if bits else len(reply.words)
            if function == IDENTIFY:
                return function, len((await session.line.identify(device)).objects)
            if function == 8 and data[2:4] == b"\0\0":
                word = int.from_bytes(data[4:6])
                return function, int(await session.line.diagnose(device, 0, word) == word)
        except RequestRefused as refused:
            return f"Not sent: {refused}"
        except DeviceException as error:
            return error.function | 0x80, error.code
        return "Not sent: it writes."

    def _is_own(self, function: int, data: bytes) -> bool:
        """Return True if a read is of the drive itself, not of a card with its own address."""
        address, count = (int.from_bytes(data[at : at + 2]) for at in (2, 4))
        profile = self.session.profile
        words = range(address, address + count)
        blocks = any(b.address <= address < b.address + b.max_words for b in profile.data.blocks)
        return blocks or any(profile.at(word, function) for word in words)


def _form(reply: ExampleFrame) -> tuple[int, int]:
    """Return function and size of a printed reply, or function and exception."""
    data = reply.data
    function = data[1]
    if function & 0x80:
        return function, data[2]
    if function in SPACES:
        return function, data[2] if function in BIT_READS else data[2] // 2
    return function, data[7] if function == 43 else 1


def _form_text(form: tuple[int, int]) -> str:
    function, size = form
    if function & 0x80:
        return f"exception {size}"
    if function in BIT_READS:
        return counted(size, "1 byte of bits", "{count} bytes of bits")
    if function in SPACES:
        return counted(size, "1 word", "{count} words")
    return f"{size} objects" if function == 43 else "the echo of the request"

"""Diagnosis of a drive that does not answer, in one sentence, with the next steps.

Pure functions of the evidence. The first check whose test holds is the verdict.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from tui.bus.errors import LineLost, NotShared, PortBusy, PortMissing, PortRefused
from tui.bus.limits import STANDARD_EXCEPTIONS
from tui.drive.sentences import all_of, counted

from ..connect.other_masters import Overheard
from . import next_steps as steps
from .evidence import DiagnosticEvidence
from .gateway_probe import GATEWAY_CODES, gateway_codes
from .next_steps import speed_text
from .sick_rungs import (
    CERTAIN,
    GATEWAY_RUNGS,
    NOISE_CAUSE,
    POSSIBLE,
    SICK_RUNGS,
    Check,
    first_sentence,
)

HELD_BACK = 8
"""Latency of an adapter in ms from which it is reported."""
SEEN_OF_IT = 0.75
"""Share of that latency by which the answers must be late before the adapter is blamed."""


def _not_there(sight: DiagnosticEvidence) -> bool:
    missing = isinstance(sight.trouble, PortMissing)
    gone = sight.port is not None and not sight.port.there
    return missing or (gone and not sight.heard.answered)


def _renumbered(sight: DiagnosticEvidence) -> bool:
    return bool(sight.adapter.was) and (bool(sight.adapter.now) or not _not_there(sight))


_RENUMBERED = {
    (True, True): "{path} is not there: the adapter that it was is {now} now.",
    (True, False): "{path} is not there: the adapter that it was is not plugged in.",
    (False, True): "{path} is another adapter than it was; the one that it was is {now} now.",
    (False, False): "{path} is another adapter than it was; the one that it was is not plugged in.",
}
"""By whether the port is missing, and whether its adapter has another port."""


def _says_renumbered(sight: DiagnosticEvidence) -> str:
    text = _RENUMBERED[_not_there(sight), bool(sight.adapter.now)]
    return text.format(path=sight.path, now=sight.adapter.now)


def _busy(sight: DiagnosticEvidence) -> bool:
    if isinstance(sight.trouble, PortBusy | NotShared) or sight.owner_frozen:
        return True
    port = sight.port
    if port is None:
        return False
    lost = isinstance(sight.trouble, LineLost) and bool(port.holder)
    return lost or (bool(port.others) and not sight.heard.answered)


def _describe_busy(sight: DiagnosticEvidence) -> str:
    port = sight.port
    if isinstance(sight.trouble, PortBusy):
        by = sight.trouble.holder or (port.holder if port else "")
        if not by:
            return f"{sight.path} is in use by another program."
        return f"{sight.path} is in use by {by}."
    if isinstance(sight.trouble, NotShared) or port is None or sight.owner_frozen:
        return first_sentence(str(sight.trouble))
    if port.others:
        return f"{port.others} has {sight.path} open too, and takes what the drive answers."
    return f"{sight.path} is in use by {port.holder}."


def _forbidden(sight: DiagnosticEvidence) -> bool:
    port = sight.port
    return port is not None and port.there and not port.permitted


_GROUP_FROM_LOGIN = (
    "{port.path} may be used by the group {port.group} alone, and {port.user} is in it since the"
    " next log-in only."
)
_NOT_IN_GROUP = (
    "{port.path} may be used by the group {port.group} alone, and {port.user} is not in it."
)


def _says_forbidden(sight: DiagnosticEvidence) -> str:
    port = sight.port
    assert port is not None
    if not port.group:
        return f"{port.user or 'This user'} may not use {port.path}, and no group of users may."
    text = _GROUP_FROM_LOGIN if port.in_group else _NOT_IN_GROUP
    return text.format(port=port)


def _slow_adapter(sight: DiagnosticEvidence) -> bool:
    held = sight.port.latency if sight.port is not None else None
    late = sight.turnaround
    if held is None or late is None or held < HELD_BACK or not sight.heard.answered:
        return False
    return not sight.heard.damaged and late * 1000 >= held * SEEN_OF_IT


def _says_slow(sight: DiagnosticEvidence) -> str:
    assert sight.port is not None
    assert sight.turnaround is not None
    return (
        f"The drive usually answers {sight.turnaround * 1000:.0f} ms after a request: the adapter"
        f" keeps bytes back for up to {sight.port.latency} ms (its latency timer)."
    )


def _garbled(sight: DiagnosticEvidence) -> bool:
    heard = sight.heard
    if heard.answered or heard.others or heard.exceptions or heard.functions or heard.misshapen:
        return False
    return bool(heard.garbage) or bool(sight.broken)


_WRONG_SPEED = {
    (False, False): "The baud or the format of the line is not that of the drive: {count} bytes"
    " came back that form no frame.",
    (True, False): "The baud or the format of the line is not that of the drive: the port counted"
    " {port}.",
    (False, True): "The baud or the format of the line is not that of the drive: {reported}.",
    (True, True): "The baud or the format of the line is not that of the drive: the port counted"
    " {port}; {reported}.",
}
"""By whether the port has counted errors, and whether the number of bytes indicates a speed."""


def _says_garbled(sight: DiagnosticEvidence) -> str:
    errors, reported = sight.errors, speed_text(sight)
    counts = (
        (errors.framing, "{count} without a stop bit"),
        (errors.parity, "{count} with a wrong parity"),
        (errors.breaks, "{count} breaks"),
    )
    port = [text.format(count=count) for count, text in counts if count]
    text = _WRONG_SPEED[bool(port), bool(reported)]
    return text.format(port=all_of(port), reported=reported, count=sight.heard.garbage)


def _has_values(sight: DiagnosticEvidence) -> bool:
    """True if the drive answered a later read with values."""
    return sight.measure is not None and sight.measure.has_values


def _late(sight: DiagnosticEvidence) -> bool:
    return bool(sight.heard.late) and not sight.heard.answered and not _has_values(sight)


def _silent(sight: DiagnosticEvidence) -> bool:
    heard = sight.heard
    return bool(heard.requested) and heard.nothing and not heard.echoed


_NEIGHBORS_ANSWER = (
    "No device answers at address {device}, while address {others} on this line does.",
    "No device answers at address {device}, while addresses {others} on this line do.",
)


def _says_silent(sight: DiagnosticEvidence) -> str:
    if sight.neighbors:
        others = all_of([str(neighbor) for neighbor in sight.neighbors])
        return counted(len(sight.neighbors), *_NEIGHBORS_ANSWER, device=sight.device, others=others)
    return f"No device answers at address {sight.device}: not one byte came back."


def _damaged(sight: DiagnosticEvidence) -> bool:
    heard = sight.heard
    return bool(heard.damaged) or bool(heard.answered and (heard.garbage or sight.broken))


_DAMAGED = "The drive answers, and {count} of {of} answers came damaged: the checksum does not fit."
_DAMAGED_AT_PORT = (
    "The drive answers, and {count} of {of} answers came damaged: the checksum does not fit"
    " ({broken} characters the port itself saw broken)."
)


def _says_damaged(sight: DiagnosticEvidence) -> str:
    heard = sight.heard
    text = _DAMAGED_AT_PORT if sight.broken else _DAMAGED
    return text.format(count=heard.damaged or 1, of=heard.requested, broken=sight.broken)


def _gateway_codes(sight: DiagnosticEvidence) -> list[int]:
    """Exception codes of a gateway, unless the family has its own meaning for them."""
    codes = gateway_codes(sight.profile)
    return [code for code in sight.heard.exceptions if code in codes]


def _refused(sight: DiagnosticEvidence) -> bool:
    refused = bool(sight.heard.exceptions) and not sight.heard.answered
    return refused and not _has_values(sight) and not _gateway_codes(sight)


_REFUSES = "The drive is there, and refuses what is asked with exception {code}."
_REFUSES_BECAUSE = "The drive is there, and refuses what is asked with exception {code}: {meaning}."


def _says_refused(sight: DiagnosticEvidence) -> str:
    code = sight.heard.exceptions[-1]
    known = sight.profile.data.exceptions if sight.profile is not None else []
    meaning = next((e.meaning for e in known if e.code == code), STANDARD_EXCEPTIONS.get(code, ""))
    text = _REFUSES_BECAUSE if meaning else _REFUSES
    return text.format(code=code, meaning=meaning.removesuffix("."))


_OTHER_FUNCTION = (
    "Address {sight.device} sent an unexpected reply: function {sight.heard.functions[0]}."
)
_OTHER_COUNT = (
    "Address {sight.device} sent an unexpected reply: not the requested number of registers."
)

LADDER: tuple[Check, ...] = (
    Check("renumbered", _renumbered, _says_renumbered, steps.find_adapter),
    Check(
        "changed",
        lambda s: bool(s.changed) and bool(s.heard.answered),
        lambda s: first_sentence(s.changed),
        steps.accept_change,
    ),
    Check("no-port", _not_there, lambda s: f"There is no port {s.path}.", steps.plug_in),
    Check("no-permission", _forbidden, _says_forbidden, steps.get_permission),
    *GATEWAY_RUNGS,
    Check("busy", _busy, _describe_busy, steps.free_port),
    Check(
        "port-refused",
        lambda s: isinstance(s.trouble, PortRefused),
        lambda s: first_sentence(str(s.trouble)),
        steps.other_port,
    ),
    Check(
        "line-lost",
        lambda s: s.trouble is not None,
        lambda s: first_sentence(str(s.trouble)),
        steps.reach_line,
    ),
    Check("withheld", lambda s: bool(s.withheld), lambda s: first_sentence(s.withheld), steps.wait),
    *SICK_RUNGS,
    Check("slow-adapter", _slow_adapter, _says_slow, steps.hurry_adapter),
    Check("wrong-settings", _garbled, _says_garbled, steps.mend_settings),
    Check("silence", _silent, _says_silent, steps.end_silence),
    Check(
        "late",
        _late,
        lambda s: f"Address {s.device} answers, but after the timeout.",
        steps.wait_longer,
    ),
    Check(
        "echo",
        lambda s: bool(s.heard.echoed) and not s.heard.answered and s.heard.nothing,
        lambda s: (
            f"Only the adapter's own echo came back: no device answers at address {s.device}."
        ),
        steps.end_echo,
    ),
    Check("checksum", _damaged, _says_damaged, steps.end_damage),
    Check(
        "other-address",
        lambda s: bool(s.heard.others) and not s.heard.answered,
        lambda s: (
            f"Address {', '.join(map(str, s.heard.others))} answers what address {s.device} was"
            " asked."
        ),
        steps.sort_addresses,
    ),
    Check(
        "wrong-function",
        lambda s: bool(s.heard.functions or s.heard.misshapen),
        lambda s: (_OTHER_FUNCTION if s.heard.functions else _OTHER_COUNT).format(sight=s),
        steps.find_second_master,
    ),
    Check(
        "gateway",
        lambda s: bool(_gateway_codes(s)) and not s.heard.answered,
        lambda s: f"The gateway answers {GATEWAY_CODES[_gateway_codes(s)[-1]]}.",
        steps.ask_gateway,
    ),
    Check("exception", _refused, _says_refused, steps.ask_otherwise),
    Check(
        "other-master",
        lambda s: bool(s.loose),
        lambda s: Overheard(loose=s.loose).text,
        steps.find_sender,
        lambda _: POSSIBLE,
        (NOISE_CAUSE,),
    ),
)
"""All checks, in the order in which they are tried; each test but the first ones' works alone."""


ANSWERS = "answers"
"""Verdict for a drive that answers, with no fault on the way."""

UNOPENED = "not-open"
NOTHING_SEEN = "Nothing is wrong with this line as far as it is seen while it is not open."
OPEN_IT = "Open it, then try again: a drive is polled only on an open line."


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Verdict of a diagnosis, with its sentence and the next steps."""

    rung: str
    text: str
    steps: tuple[str, ...]
    sight: DiagnosticEvidence
    certainty: str = CERTAIN
    """Certainty of the verdict: `certain`, `likely` or `possible`."""
    others: tuple[str, ...] = field(default=())
    """Other possible causes."""

    @property
    def well(self) -> bool:
        """True if the drive answers and no fault was found."""
        return self.rung == ANSWERS


def diagnosed(sight: DiagnosticEvidence) -> Diagnosis:
    """Return the verdict of the first check whose test holds."""
    for rung in LADDER:
        if rung.fails(sight):
            sure = rung.certainty(sight)
            others = () if sure == CERTAIN else rung.others
            return Diagnosis(
                rung.id, rung.says(sight), tuple(rung.steps(sight)), sight, sure, others
            )
    heard = sight.heard
    if not heard.requested:
        return Diagnosis(UNOPENED, NOTHING_SEEN, (OPEN_IT,), sight)
    measure = sight.measure
    sent = heard.requested + (measure.requested if measure is not None else 0)
    answered = heard.answered + (measure.answered if measure is not None else 0)
    text = f"Address {sight.device} answers: {answered} of {sent} requests."
    if sight.turnaround:
        text = (
            f"Address {sight.device} answers: {answered} of {sent} requests,"
            f" usually {sight.turnaround * 1000:.0f} ms after a request."
        )
    if sight.idle:
        text = f"{text} The gateway kept the connection for {sight.idle:.0f} s without a request."
    return Diagnosis(ANSWERS, text, (), sight)

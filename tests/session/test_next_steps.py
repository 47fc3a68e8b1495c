"""Next steps of the diagnosis: each a sentence, for every step and all kinds of evidence."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import product

import pytest

from tui.bus.errors import OWNER_SILENT, LineError, LineLost, PortMissing
from tui.bus.link import Link, SerialLink, TcpLink
from tui.bus.transport.port_errors import PortErrors
from tui.bus.transport.ports import PortSeen
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.session.diagnosis import next_steps
from tui.session.diagnosis.evidence import AdapterSeen, DiagnosticEvidence
from tui.session.diagnosis.gateway_probe import Works
from tui.session.diagnosis.reply_evidence import ReplyEvidence

PORT = "/dev/ttyUSB7"
STEPS: dict[str, Callable[[DiagnosticEvidence], Iterable[str]]] = {
    name: step
    for name, step in vars(next_steps).items()
    if inspect.isgeneratorfunction(step) and step.__module__ == next_steps.__name__
}
LINKS: tuple[Link, ...] = (SerialLink(PORT), TcpLink("10.0.0.9", 502))
PROFILES: tuple[Profile | None, ...] = (None, library.load("atv71"))
TROUBLES: tuple[LineError | None, ...] = (
    None,
    PortMissing(PORT),
    PortMissing(PORT, ["/dev/ttyS0", "/dev/ttyS1"]),
    LineLost(f"panel (pid 7) {OWNER_SILENT}."),
)
PORTS = (
    None,
    PortSeen(PORT, permitted=False),
    PortSeen(PORT, permitted=False, group="dialout", user="anna"),
    PortSeen(PORT, permitted=False, group="dialout", user="anna", in_group=True),
)
ADAPTERS = (AdapterSeen(), AdapterSeen("/dev/x-adapter"), AdapterSeen("/dev/x-adapter", "/dev/new"))
EVIDENCE = DiagnosticEvidence(
    LINKS[0],
    5,
    changed="Another adapter.",
    works=Works("tcp:10.0.0.9", 1),
    heard=ReplyEvidence(requested=3, others=(7, 8), exceptions=(2,)),
)


def evidence() -> Iterable[DiagnosticEvidence]:
    """Every kind of evidence that a step depends on, one beside the other."""
    for link, profile in product(LINKS, PROFILES):
        base = replace(EVIDENCE, link=link, profile=profile)
        yield from (replace(base, trouble=trouble) for trouble in TROUBLES)
        yield from (replace(base, port=port) for port in PORTS)
        yield from (replace(base, adapter=adapter) for adapter in ADAPTERS)
        for code in (1, 4, 5, 6, 10, 11):
            yield replace(base, heard=replace(base.heard, exceptions=(code,)))
        yield replace(base, errors=PortErrors(3, 0, 0, 0))
        yield replace(base, overheard="Another master uses the line. It asks device 3.")


ALL_EVIDENCE = tuple(evidence())


@pytest.mark.parametrize("name", STEPS)
def test_each_next_step_is_a_sentence_or_a_command(name: str) -> None:
    # the adapter is looked for only if its permanent name is known
    seen = [s for s in ALL_EVIDENCE if s.adapter.was or name != "find_adapter"]
    found = {text for sight in seen for text in STEPS[name](sight)}
    assert found
    for text in found:
        assert text == text.strip()
        assert len(text.split()) >= 3, text
        assert text[-1] in ".?" or text.startswith("echo "), text
        assert "None" not in text
        assert "  " not in text


@pytest.mark.parametrize("name", STEPS)
def test_no_next_step_is_given_twice(name: str) -> None:
    for sight in ALL_EVIDENCE:
        steps = list(STEPS[name](sight))
        assert len(steps) == len(set(steps))


@pytest.mark.parametrize(
    ("name", "sight", "words"),
    [
        ("plug_in", replace(EVIDENCE, trouble=TROUBLES[1]), ["No serial port was found"]),
        ("plug_in", replace(EVIDENCE, trouble=TROUBLES[2]), ["/dev/ttyS0, /dev/ttyS1"]),
        ("plug_in", replace(EVIDENCE, adapter=ADAPTERS[1]), ["/dev/x-adapter", "not plugged in"]),
        ("find_adapter", replace(EVIDENCE, adapter=ADAPTERS[2]), ["Open /dev/new", "x-adapter"]),
        ("find_adapter", replace(EVIDENCE, adapter=ADAPTERS[1]), ["Plug the adapter in again"]),
        ("find_adapter", EVIDENCE, ["accept the line"]),
        ("get_permission", EVIDENCE, ["-G dialout $USER"]),
        ("get_permission", replace(EVIDENCE, port=PORTS[1]), ["chmod g+rw /dev/ttyUSB7"]),
        ("get_permission", replace(EVIDENCE, port=PORTS[2]), ["-G dialout anna"]),
        ("get_permission", replace(EVIDENCE, port=PORTS[3]), ["Log out", "anna is in dialout"]),
        ("free_port", replace(EVIDENCE, trouble=TROUBLES[3]), ["kill -9"]),
        ("free_port", EVIDENCE, ["Close that program"]),
        ("reach_line", EVIDENCE, ["adapter's plug"]),
        ("reach_line", replace(EVIDENCE, link=LINKS[1]), ["gateway's supply"]),
        ("search", EVIDENCE, ["drivepanel scan", "--all-settings"]),
        ("search", replace(EVIDENCE, link=LINKS[1]), ["drivepanel scan"]),
        ("sort_addresses", EVIDENCE, ["address 7, 8"]),
        ("part_drives", EVIDENCE, ["address 5"]),
        ("set_unit", EVIDENCE, ["tcp:10.0.0.9", "address 5"]),
        ("open_what_works", EVIDENCE, ["open tcp:10.0.0.9"]),
        (
            "ask_gateway",
            replace(EVIDENCE, heard=ReplyEvidence(exceptions=(10,))),
            ["address 5 routed"],
        ),
        ("ask_gateway", replace(EVIDENCE, heard=ReplyEvidence(exceptions=(11,))), ["serial side"]),
        (
            "ask_otherwise",
            replace(EVIDENCE, heard=ReplyEvidence(exceptions=(4,))),
            ["has a trouble"],
        ),
        ("ask_otherwise", replace(EVIDENCE, heard=ReplyEvidence(exceptions=(6,))), ["Ask again"]),
        (
            "ask_otherwise",
            replace(EVIDENCE, heard=ReplyEvidence(exceptions=(3,))),
            ["Name the drive's"],
        ),
    ],
)
def test_next_step_names_what_the_evidence_shows(
    name: str, sight: DiagnosticEvidence, words: list[str]
) -> None:
    text = " ".join(STEPS[name](sight))
    for word in words:
        assert word in text

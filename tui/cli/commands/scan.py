"""`drivepanel scan`: which drives answer on a line, at which addresses, baud and format."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import click

from ..shared.errors import INTERRUPTED, LINE_TROUBLE, REFUSED_HERE, Failure
from ..shared.options import hold_option, json_option, line_argument, on_line, read_only_option
from ..shared.registration import ON_LINE, command

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine

    from ..documents.drive_documents import ScanEndDocument
    from ..running.scanning import Scan

ALL_ADDRESSES = "1-247"


@command("Scan a line for drives.", group="Troubleshoot", statuses=ON_LINE)
@line_argument
@click.option(
    "--addresses",
    default=ALL_ADDRESSES,
    show_default=True,
    metavar="LIST",
    help="Scan these slave addresses: 1-31, or 1,3,5-7.",
)
@click.option(
    "--all-settings",
    is_flag=True,
    help="Try every baud rate and format that drives can have.",
)
@click.option(
    "--yes",
    is_flag=True,
    help="Try them even if drives found react when polling stops.",
)
@hold_option
@read_only_option
@json_option
def scan(
    line_text: str,
    addresses: str,
    all_settings: bool,
    yes: bool,
    hold: float | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Find the drives on a line. It reads, and writes nothing. Ctrl-C ends it.

    It listens first: if another master polls drives, it ends before it sends anything. Drives found
    are polled until the end, so that their communication timeout does not expire.
    """
    from tui.session.connect.addresses import parse_addresses

    from ..running.scan_telling import ScanTelling

    devices = parse_addresses(addresses)
    tell = ScanTelling(line_text, as_json=as_json)
    scans: list[Scan] = []

    async def work(opened: OpenLine) -> None:
        from ..running.scanning import Scan
        from ..shared.holding import hold_on

        item = Scan(opened, line_text, devices, tell, yes=yes)
        await _prepare(item, all_settings=all_settings)
        scans.append(item)
        await item.run()
        await hold_on(opened, item.sessions, hold)

    try:
        on_line(line_text, work, read_only=read_only)
    except KeyboardInterrupt:
        raise Failure(f"Ended by Ctrl-C. {_end(scans, addresses)}", INTERRUPTED) from None
    except click.ClickException:
        raise  # nothing was sent
    except Exception:
        tell.note(_end(scans, addresses))
        raise
    text = _end(scans, addresses)
    if not scans[0].hits:
        raise Failure(f"{text} {_hint(scans[0])}", LINE_TROUBLE)
    tell.note(text)


async def _prepare(scan: Scan, *, all_settings: bool) -> None:
    """Which settings are tried; raises UsageError and Failure where others cannot be."""
    from tui.bus.link import SerialLink
    from tui.bus.transport.ports import is_pseudo_terminal
    from tui.session.connect.address_prober import settings_worth_a_try
    from tui.session.connect.scan_estimate import scan_estimate

    line, here = scan.opened.line, scan.setting
    if not all_settings:
        scan.settings = [here] if here is not None else []
        return
    if not isinstance(line.link, SerialLink) or here is None:
        raise click.UsageError("--all-settings is for serial ports: this line has no baud.")
    if others := line.facts.others:
        who = ", ".join(other.text for other in others)
        raise Failure(
            f"--all-settings needs the line for itself, and {who} uses it. Nothing was sent.",
            REFUSED_HERE,
        )
    parity = not is_pseudo_terminal(line.link.path)
    scan.settings = await asyncio.to_thread(settings_worth_a_try, here, parity=parity)
    scan.costs = await asyncio.to_thread(
        scan_estimate,
        line.link,
        line.timing.scan_timeout,
        scan.settings,
        len(scan.devices),
        patient=scan.opened.simulation is not None,
    )


_FOUND = {
    (True, 0): "No drives found at addresses {addresses}.",
    (True, 1): "1 drive found at addresses {addresses}.",
    (True, 2): "{count} drives found at addresses {addresses}.",
    (False, 0): "No drives found at addresses {addresses}, not all of which were asked.",
    (False, 1): "1 drive found at addresses {addresses}, not all of which were asked.",
    (False, 2): "{count} drives found at addresses {addresses}, not all of which were asked.",
}
"""By whether all addresses were asked, and the count up to 2."""


def _end(scans: list[Scan], addresses: str) -> str:
    """Report the end as JSON, if requested; the result, in a sentence."""
    if not scans:
        return "Nothing was sent."
    (scan,) = scans
    count = len(scan.hits)
    found = _FOUND[scan.done, min(count, 2)].format(count=count, addresses=addresses)
    text = " ".join([found, *_settings_text(scan)])

    def document(line_text: str) -> ScanEndDocument:
        from ..documents.drive_documents import LineSettingField, ScanEndDocument

        return ScanEndDocument(
            line=line_text,
            done=scan.done,
            found=count,
            addresses=addresses,
            settings=[LineSettingField(baud=item.baud, format=item.format) for item in scan.tried],
            not_tried=len(scan.settings) - len(scan.tried),
            held_back=scan.held_back or None,
            remarks=scan.remarks,
            text=text,
        )

    scan.tell.ended(document)
    return " ".join((text, *scan.remarks))


def _settings_text(scan: Scan) -> list[str]:
    """Return a sentence about the settings that were tried, if any."""
    if len(scan.settings) > 1:
        return [f"Tried {len(scan.tried)} of {len(scan.settings)} settings."]
    return [f"Tried {scan.tried[0]}."] if scan.tried else []


def _hint(scan: Scan) -> str:
    """Return what to check if no drive answers."""
    if scan.remarks:
        return "drivepanel why LINE -d ADDRESS names the cause and the next steps."
    from tui.drive.profile import library

    look = "Are the drives on, and are the two wires those of the line?"
    if scan.setting is not None and len(scan.settings) == 1:
        look = f"{look} --all-settings tries other baud rates and formats."
    return "\n".join((look, *library.factory_notes()))

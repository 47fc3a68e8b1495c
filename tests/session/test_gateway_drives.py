"""Drive that a gateway assumes at a device after its line was lost."""

from __future__ import annotations

from tui.bus.fake import FakeLine
from tui.bus.model import LineStatus
from tui.bus.requests import Identify
from tui.session.gateway.drives import GatewayDrives


async def test_drive_is_identified_again_after_a_lost_line() -> None:
    line = FakeLine({1: {}})
    noted: list[int] = []

    def lose_line(device: int, *_: object) -> None:
        """The line is lost in its own thread, just before the drive counts as found."""
        noted.append(device)
        if len(noted) == 1:
            line.become(LineStatus.LOST)
            line.become(LineStatus.CONNECTED)

    drives = GatewayDrives(line, lose_line, {1: "atv71"})
    session = await drives.found(1)
    assert session is drives.known(1)
    count = line.requests.count(Identify(1))
    assert count == 2, "another drive may answer since"
    assert await drives.found(1) is session
    assert line.requests.count(Identify(1)) == count
    drives.close()

"""Drive that a gateway assumes at a device after its line was lost."""

from __future__ import annotations

from pathlib import Path

from tui.bus.fake import FakeLine
from tui.bus.model import LineStatus
from tui.bus.requests import Identify
from tui.drive.profile import library
from tui.session.gateway.drives import GatewayDrives

COILS = Path(__file__).parents[1] / "drive" / "coils.toml"
IDENTIFIED = """
[identification]
reference_prefixes = ["EXCOIL"]
objects = [{ id = 1, meaning = "reference", example = "EXCOIL-1" }]

[[functions]]
code = 17
name = "Report id"

[link]
"""


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


async def test_drive_that_has_only_function_17_is_identified() -> None:
    """Without an identity nothing may be written to it, not even its stop."""
    folder = library.user_folder()
    folder.mkdir(parents=True)
    text = COILS.read_text("utf-8").replace("\n[link]\n", IDENTIFIED, 1)
    (folder / "coils.toml").write_text(text, "utf-8")
    line = FakeLine({1: {}})
    line.devices[1].called = b"EXCOIL-1"
    drives = GatewayDrives(line, lambda *_: None, {})
    session = await drives.found(1)
    assert session is not None
    assert session.profile.id == "example-coils"
    drives.close()

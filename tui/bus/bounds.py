"""The bounds of values that come from another program, as types that msgspec checks on decoding."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

MOST_NUMBERS = 1 << 62
STOPS_WRAP = 1 << 32
"""Counts of stops are below this; the next after the highest is 0."""
MOST_TEXT, MOST_NOTICE = 4096, 500
"""Characters of a text: of a whole message for a person, and of one that all programs keep."""
MOST_DEVICES, MOST_PROGRAMS = 256, 64
"""Devices on one line, and programs attached to its owner."""
MOST_STOPPERS = 4 * MOST_PROGRAMS
"""Programs whose stops of one device are counted by name; the owner keeps to fewer."""
MOST_FRAMES, MOST_BYTES = 200, 4096
"""Frames in one message, and bytes of one of them."""
MOST_CARE = 1 << 20
"""Bytes of the description with which the holder of a line can stop a device."""
MOST_SHARE = 1000.0
"""The share of a line's time that polls of one device may request."""
MOST_STRETCH = 1e6
"""The factor by which the periods of polls may be lengthened."""

DeviceId = Annotated[int, Meta(ge=0, le=MOST_DEVICES - 1)]
"""0 is a broadcast."""
Number = Annotated[int, Meta(ge=0, le=MOST_NUMBERS)]
StopCount = Annotated[int, Meta(ge=0, lt=STOPS_WRAP)]
ByteValue = Annotated[int, Meta(ge=0, le=0xFF)]
RegisterAddress = Annotated[int, Meta(ge=0, le=0xFFFF)]
WrittenPlace = Annotated[int, Meta(ge=0, le=0x2FFFF)]
"""A register, or a coil; see wire_place in tui.wire.frames."""
RegisterValue = Annotated[int, Meta(ge=0, le=0xFFFF)]
RegisterCount = Annotated[int, Meta(ge=0, le=0xFFFF)]
Seconds = Annotated[float, Meta(ge=-1e9, le=1e9)]
MonotonicTime = Annotated[float, Meta(ge=0.0, le=1e10)]
"""Seconds of the machine's monotonic clock."""
Share = Annotated[float, Meta(ge=0.0, le=MOST_SHARE)]
ProgramId = Annotated[str, Meta(min_length=1, max_length=40, pattern="^[ -~]*$")]
StopperId = Annotated[str, Meta(max_length=40, pattern="^[ -~]*$")]
"""A program's id, or nothing: of programs that have left."""
Word = Annotated[str, Meta(max_length=200)]
Notice = Annotated[str, Meta(max_length=MOST_NOTICE)]
Text = Annotated[str, Meta(max_length=MOST_TEXT)]
ByteString = Annotated[bytes, Meta(max_length=MOST_BYTES)]
CareBytes = Annotated[bytes, Meta(max_length=MOST_CARE)]
StopTimes = Annotated[dict[DeviceId, MonotonicTime], Meta(max_length=MOST_DEVICES)]
"""When each device was stopped last."""
DeviceIds = Annotated[tuple[DeviceId, ...], Meta(max_length=MOST_DEVICES)]
Shares = Annotated[dict[DeviceId, Share], Meta(max_length=MOST_DEVICES)]
ProgramShares = Annotated[dict[ProgramId, Share], Meta(max_length=MOST_PROGRAMS)]
ByProgram = Annotated[dict[StopperId, StopCount], Meta(max_length=MOST_STOPPERS)]
StopsByDevice = Annotated[dict[DeviceId, ByProgram], Meta(max_length=MOST_DEVICES)]

"""A file of frames for other programs, whole at every moment: each packet is one write."""

from __future__ import annotations

import errno
import os
from io import FileIO
from pathlib import Path

import tui
from tui.bus.api import Frame
from tui.wire.capture.forms import (
    ModbusTcpForm,
    Packet,
    PacketForm,
    RtuForm,
    interface_block,
    packet_block,
    section_block,
)
from tui.wire.frames import MBAP_BYTES, is_whole, pdu_of


class CaptureFile:
    """Frames in a pcapng file: as Modbus/TCP, or `raw` as bytes with their checksums.

    A file that is there is replaced with `force` only. Raises OSError, FileExistsError.
    """

    def __init__(
        self,
        path: Path,
        line: str,
        *,
        raw: bool = False,
        force: bool = False,
        output: FileIO | None = None,
    ) -> None:
        """`output` takes the file instead of `path`, such as standard output."""
        self.path = path
        self.packets = 0
        self._form: PacketForm = RtuForm() if raw else ModbusTcpForm()
        self._is_own = output is None
        """True if the file has nothing but these frames, so that half a packet is cut off."""
        self._file = output or path.open("wb" if force else "xb", buffering=0)
        self._size = 0
        try:
            self._write(section_block(f"drivepanel {tui.__version__}"))
            self._write(interface_block(self._form.link_type, line))
        except OSError:
            self._file.close()
            raise

    def add_seen(self, frame: Frame, wall: float, *, tcp: bool) -> None:
        """Add a frame of a line, which is Modbus `tcp` or RTU; or its bytes if they form none."""
        pdu = pdu_of(frame.data, tcp=tcp)
        whole = len(frame.data) > MBAP_BYTES if tcp else is_whole(frame.data)
        if pdu is None or not whole:
            self.add_noise(frame.data, wall)
            return
        body = bytes([pdu.function]) + pdu.body
        self.add_frame(pdu.device, body, wall, request=frame.direction == "out")

    def add_frame(self, device: int, pdu: bytes, wall: float, *, request: bool) -> None:
        """Add a whole frame; `wall` is its time in seconds since 1970."""
        self._add(self._form.frame_packet(device, pdu, request=request), wall)

    def add_noise(self, data: bytes, wall: float) -> None:
        """Add bytes that form no frame."""
        if (packet := self._form.noise_packet(data)) is not None:
            self._add(packet, wall)

    def close(self) -> None:
        """Close the file; nothing waits to be written."""
        self._file.close()

    def _add(self, packet: Packet, wall: float) -> None:
        self._write(packet_block(packet.data, wall, packet.comment))
        self.packets += 1

    def _write(self, block: bytes) -> None:
        """Write a block whole, or not at all."""
        try:
            written = self._file.write(block)
            if written != len(block):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            if self._is_own:
                self._file.truncate(self._size)
            raise
        self._size += len(block)

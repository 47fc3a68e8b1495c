"""The example frames of the manuals, and the setup of a drive that gives their answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tui.drive.profile.example_frames import all_frames
from tui.simulator import DriveSpec, SimulatedDrive


@dataclass(frozen=True)
class Frame:
    """One example frame: the correct form, and the printed form if it differs."""

    number: int
    family: str
    section: str
    direction: str
    data: bytes
    printed: bytes | None
    meaning: str


def _frames() -> list[Frame]:
    return [
        Frame(
            number,
            row.family,
            row.section,
            row.direction,
            row.data,
            bytes.fromhex(row.printed) if row.printed else None,
            row.meaning,
        )
        for number, row in enumerate(all_frames())
    ]


FRAMES = _frames()


@dataclass(frozen=True)
class Example:
    """A request of a manual, its drive, and the answer."""

    request: int
    response: int | None
    """Number of the answering frame; None if no drive would answer as printed."""
    spec: DriveSpec
    busy: bool = False
    answer: str = ""
    """Actual answer of a drive, in hexadecimal; the reason is beside the example."""

    @property
    def name(self) -> str:
        return f"{self.spec.profile}-{self.request}-{self.response or self.answer}"

    def prepare(self, drive: SimulatedDrive) -> None:
        """Setup that a specification cannot express."""
        drive.busy = self.busy


_READ_BLOCK = {
    **{f"F{875 + place}": place + 1 for place in range(5)},
    "FD01": 0x6404,
    "FD00": 6000,
    "FE03": 0,
    "FE05": 0x26FB,
    "FC91": 0x0080,
}
_WRITE_BLOCK = {"F870": 1, "F871": 3}
_SPEEDS = {"SFR": 40, "TFR": 600, "HSP": 500, "LSP": 0}
_OLD_IDENTITY = {0: "TELEMECANIQUE", 1: "ATV31HU09M3S232", 2: "0201"}
_SCANNER = {
    **{f"NMA{i}": a for i, a in enumerate((3201, 8604, 3204, 3205, 3207, 3209, 9630, 7121), 1)},
    **{f"NCA{i}": a for i, a in enumerate((8501, 8602, 3104, 3105, 9001, 9002), 1)},
    "ETA": 0x0007,
    "RFRD": 5000,
    "LCR": 100,
    "OTR": 69,
    "ULN": 240,
    "THD": 101,
    "THR": 50,
    "LFT": 0,
}


def _drive(
    profile: str, address: int, sets: Mapping[str, int] | None = None, **more: object
) -> DriveSpec:
    return DriveSpec(profile, address, sets=sets or {}, **more)  # type: ignore[arg-type]


def _altivar_21() -> list[Example]:
    plain, read = _drive("atv21", 1, {"FD00": 6000}), _drive("atv21", 1, _READ_BLOCK)
    write = _drive("atv21", 1, _WRITE_BLOCK)
    return [
        *(Example(number, number + 1, plain) for number in (0, 2)),
        *(Example(number, number + 1, read) for number in (4, 6, 8, 10)),
        *(Example(number, number + 1, plain) for number in (12, 14, 16)),
        Example(18, 19, write),
        Example(20, 21, write, busy=True),
        Example(20, 21, _drive("atv21", 1, {"F870": 0, "F871": 3})),
        *(Example(number, number + 1, write) for number in (22, 24, 26)),
        Example(28, 29, plain),
    ]


def _leroy_somer() -> list[Example]:
    sets = {"1.05": 45, "1.06": 1500, "1.07": 0}
    return [
        Example(30, 31, _drive(profile, 1, sets))
        for profile in ("powerdrive", "proxidrive", "varmeca")
    ]


def _altivar_31_312() -> list[Example]:
    examples: list[Example] = []
    for profile, first in (("atv31", 32), ("atv312", 40)):
        spec = _drive(profile, 2, _SPEEDS, identity=_OLD_IDENTITY)
        examples += [Example(number, number + 1, spec) for number in range(first, first + 6, 2)]
    # 4043 and 4044 are not parameters (ACC and DEC are 9001 and 9002): the checksums are right,
    # so a drive understands the request, and refuses the addresses.
    examples.append(Example(38, None, _drive("atv31", 2), answer="029002"))
    examples.append(Example(46, 47, _drive("atv312", 2)))
    return examples


def _altivar_71() -> list[Example]:
    ip = {"IPC1": 0x8B, "IPC2": 0xA0, "IPC3": 0x45, "IPC4": 0xF1, "AMOC": 104}
    memory = {"%MW20": 0x54, "%MW21": 0x123, "%MW22": 0x1A3, "%MW23": 0x1AD5, "%MW24": 0x9E}
    speeds = _drive("atv71", 2, _SPEEDS)
    profile = {"CHCF": 3, "COP": 2}
    return [
        Example(48, 49, speeds),
        Example(50, 51, _drive("atv71", 2, {**memory, "AMOA": 54})),
        Example(52, 53, _drive("atv71", 2, ip)),
        Example(54, 55, speeds),
        Example(56, 57, _drive("atv71", 4)),
        Example(58, 59, speeds),
        Example(60, 61, _drive("atv71", 2, name="MACHINE 4")),
        Example(62, 63, speeds),
        Example(64, 65, _drive("atv71", 20, _SCANNER)),
        Example(66, 67, _drive("atv71", 4)),
        Example(68, 69, _drive("atv71", 12, profile)),
        Example(68, 70, _drive("atv71", 12, profile, protects=frozenset({"CHCF"}))),
        Example(68, 71, _drive("atv71", 12, profile, protects=frozenset({"CHCF", "COP"}))),
    ]


EXAMPLES = [*_altivar_21(), *_leroy_somer(), *_altivar_31_312(), *_altivar_71()]
NEVER_ANSWERED = frozenset({39})
"""Responses that no drive gives: the answer printed to the request for 4043 and 4044."""

"""Words that an Altivar 31, 312 or 71 stores when a fault occurs.

Source: ATV71 communication parameters list (DP0 and its record); ATV312 communication
variables (EP1 to EP4).
"""

from __future__ import annotations

from collections.abc import Mapping

from ..body import Body

RECORDED: Mapping[str, str] = {
    "EP": "ETA",
    "IP": "ETI",
    "CMP": "CMD",
    "ULP": "ULN",
    "LCP": "LCR",
    "RFP": "RFR",
    "THP": "THR",
    "RTP": "RTH",
}
"""Code prefixes of a fault's record, and the word that each stores; 0 is the last fault."""
RECORDS = 9


class FaultRecords:
    """States of the drive at its last faults, the last first."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._records: list[dict[str, int]] = []

    def take(self) -> None:
        """Store the present words as the record of a fault."""
        registers = self._body.registers
        record = {
            start: registers.present(parameter)
            for start, code in RECORDED.items()
            if (parameter := registers.named(code))
        }
        self._records = [record, *self._records][:RECORDS]
        for number, kept in enumerate(self._records):
            for start, raw in kept.items():
                self._body.show_code(f"{start}{number}", raw)

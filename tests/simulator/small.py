"""Small profiles for tests of the simulator: few parameters, every rule of their family."""

from __future__ import annotations

from typing import Any

import msgspec

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import ProfileData


def parameter(code: str, address: int, access: str = "rw", **more: Any) -> dict[str, Any]:
    """One parameter, as a profile file would give it."""
    number = more.pop("number", f"W{address}")
    return {
        "code": code,
        "name": code,
        "number": number,
        "address": address,
        "access": access,
        "group": "Test",
        "source": "test",
        "confidence": "manual",
        **more,
    }


def profile(data: dict[str, Any]) -> Profile:
    """A profile from plain data, checked as a file would be."""
    base = {"sources": [{"id": "test", "title": "Test"}], "monitoring": {"values": []}}
    return Profile(msgspec.convert({**base, **data}, ProfileData))


def head(profile_id: str) -> dict[str, str]:
    return {"id": profile_id, "name": profile_id.upper(), "vendor": "Test", "version": "1"}


def ramps() -> list[dict[str, Any]]:
    follow = {"parameter": "INR", "scales": {"0": "0.01", "1": "0.1", "2": "1"}}
    time: dict[str, Any] = {
        "scale": "0.1",
        "unit": "s",
        "scale_by": follow,
        "factory": 30,
        "min": 0,
        "max": 9999,
    }
    return [
        parameter("INR", 9020, quantity="ramp_increment", factory=1, values=_names(3)),
        parameter("ACC", 9001, quantity="acceleration", storage="ram-until-saved", **time),
        parameter("DEC", 9002, quantity="deceleration", storage="ram-until-saved", **time),
    ]


def _names(count: int) -> dict[str, str]:
    return {str(raw): f"choice {raw}" for raw in range(count)}


_BAUD = [{"raw": 28, "text": "9.6", "baud": 9600}, {"raw": 32, "text": "19.2", "baud": 19200}]
_FORMAT = [{"raw": 3, "text": "8E1", "format": "8E1"}, {"raw": 5, "text": "8N2", "format": "8N2"}]
_FRAMED: dict[str, Any] = {"storage": "ram-until-saved", "effective": "after-reset"}
_CONFIG: dict[str, Any] = {"storage": "ram-until-saved"}


def altivar_parameters() -> list[dict[str, Any]]:
    hz: dict[str, Any] = {"scale": "0.1", "unit": "Hz", **_CONFIG}
    return [
        *ramps(),
        parameter("CMD", 8501, quantity="command_word", storage="ram"),
        parameter("LFR", 8502, type="int16", scale="0.1", unit="Hz", storage="ram")
        | {"quantity": "command_frequency"},
        parameter("CMI", 8504, quantity="extended_command_word", storage="ram"),
        parameter("LFRD", 8602, type="int16", unit="rpm", storage="ram", quantity="command_speed"),
        parameter("ETA", 3201, "r", quantity="status_word"),
        parameter("ETI", 3206, "r", quantity="extended_status_word"),
        parameter("RFR", 3202, "r", type="int16", scale="0.1", unit="Hz")
        | {"quantity": "output_frequency"},
        parameter("RFRD", 8604, "r", type="int16", unit="rpm", quantity="speed"),
        parameter("LCR", 3204, "r", scale="0.1", unit="A", quantity="motor_current"),
        parameter("THR", 9630, "r", unit="%", quantity="motor_thermal"),
        parameter("SFR", 3102, "rw-stopped", factory=40, min=10, max=160, **hz),
        parameter("TFR", 3103, "rw-stopped", factory=600, quantity="max_frequency", **hz),
        parameter("HSP", 3104, factory=500, max_from="TFR", quantity="high_speed", **hz),
        parameter("LSP", 3105, factory=0, max_from="HSP", quantity="low_speed", **hz),
        parameter("LFF", 7080, factory=100, **hz),
        parameter("LFT", 7121, "r"),
        parameter("DP1", 7201, "r"),
        parameter("DP2", 7202, "r"),
        *(parameter(f"EP{n}", 7210 + n, "r") for n in (0, 1)),
        *(parameter(f"LCP{n}", 7240 + n, "r") for n in (0, 1)),
        parameter("SCS", 8001, quantity="save_settings", values=_names(2), storage="ram"),
        parameter("CHCF", 8401, "rw-stopped", values=_names(4), factory=1, **_CONFIG),
        parameter("COP", 8402, "rw-stopped", values=_names(4), factory=0, **_CONFIG),
        parameter("FR1", 8413, "rw-stopped", factory=1, **_CONFIG),
        parameter("CD1", 8423, "rw-stopped", factory=1, **_CONFIG),
        parameter("RSF", 7124, "rw-stopped", factory=0, **_CONFIG),
        parameter("STT", 11201, "rw-stopped", values=_names(4), factory=0, **_CONFIG),
        parameter("ADD", 6001, factory=1, min=1, max=247, quantity="line_address", **_FRAMED),
        parameter("TBR", 6003, factory=32, **_FRAMED),
        parameter("TFO", 6004, factory=3, **_FRAMED),
        parameter("TTO", 6005, scale="0.1", unit="s", factory=100, min=1, max=300, **_CONFIG),
        parameter("SLL", 7010, "rw-stopped", factory=1, **_CONFIG),
        parameter("M1EC", 6010, "r"),
        parameter("M1CT", 6011, "r"),
    ]


def altivar_data() -> dict[str, Any]:
    reactions = [(0, "no"), (1, "YES"), (2, "Stt"), (3, "LFF"), (4, "rLS")]
    reactions += [(5, "rMP"), (6, "FSt"), (7, "dCI")]
    return {
        "link": {
            "baud": 19200,
            "format": "8E1",
            "turnaround_ms": "5",
            "settings": [
                {"parameter": "ADD", "role": "address"},
                {"parameter": "TBR", "role": "baud", "choices": _BAUD},
                {"parameter": "TFO", "role": "format", "choices": _FORMAT},
            ],
        },
        "faults": {
            "parameter": "LFT",
            "shows_last": True,
            "history": ["DP1", "DP2"],
            "codes": [
                {"raw": 5, "code": "SLF1", "name": "Modbus"},
                {"raw": 18, "code": "ObF", "name": "Overbraking"},
                {"raw": 9, "code": "OCF", "name": "Overcurrent"},
            ],
        },
        "communication_fault": {
            "timeout": "TTO",
            "reaction": "SLL",
            "reactions": [
                {"raw": raw, "code": code, "name": code, "does": code, "trips": raw not in (0, 2)}
                for raw, code in reactions
            ],
            "starts": "after an order",
            "needs_write": True,
            "fault": 5,
        },
        "charts": [
            {
                "id": "drivecom",
                "name": "Drivecom",
                "kind": "drivecom",
                "status": "ETA",
                "states": [],
            }
        ],
    }


def _functions(*limits: tuple[int, int | None, int | None, bool]) -> list[dict[str, Any]]:
    return [
        {"code": c, "name": str(c), "max_read": r, "max_write": w, "broadcast": b}
        for c, r, w, b in limits
    ]


def atv71() -> Profile:
    """A small Altivar 71: scanner, cards, unknown words, function 8 and 23."""
    functions = _functions(
        (3, 63, None, False),
        (6, None, 1, True),
        (16, None, 61, True),
        (23, 20, 20, False),
        (43, None, None, False),
    )
    functions.append({"code": 8, "name": "8", "subfunctions": [0, 10, 12, 14]})
    scanner = [
        parameter(f"N{kind}A{i}", 12700 + 20 * (kind == "C") + i, "rw-stopped", **_CONFIG)
        for kind in "MC"
        for i in range(1, 9)
    ]
    values = [
        parameter(f"N{kind}{i}", 12740 + 20 * (kind == "C") + i, "r")
        for kind in "MC"
        for i in range(1, 9)
    ]
    return profile(
        {
            "profile": head("atv71"),
            **altivar_data(),
            "identification": {
                "objects": [
                    {"id": 0, "meaning": "vendor", "example": "Telemecanique"},
                    {"id": 1, "meaning": "reference", "example": "ATV71HU15M3"},
                    {"id": 2, "meaning": "version", "example": "0201"},
                    {"id": 6, "meaning": "name", "example": "MACHINE 4"},
                ],
                "conformity": 2,
                "exception_has_mei_byte": True,
            },
            "addresses": {
                "servers": [
                    {"parameter": "AMOA", "name": "Programmable card"},
                    {"parameter": "AMOC", "name": "Communication card"},
                ]
            },
            "functions": functions,
            "reading": {"unknown_word": 0x8000, "unknown_exception": 2},
            "blocks": [
                {
                    "id": "scanner-read",
                    "name": "Read",
                    "direction": "read",
                    "address": 12741,
                    "max_words": 8,
                    "slots": [f"NMA{i}" for i in range(1, 9)],
                    "values": [f"NM{i}" for i in range(1, 9)],
                    "selects_by": "address",
                },
                {
                    "id": "scanner-write",
                    "name": "Write",
                    "direction": "write",
                    "address": 12761,
                    "max_words": 8,
                    "slots": [f"NCA{i}" for i in range(1, 9)],
                    "values": [f"NC{i}" for i in range(1, 9)],
                    "selects_by": "address",
                },
            ],
            "parameters": [
                *altivar_parameters(),
                *scanner,
                *values,
                parameter("AMOA", 6041, min=0, max=247, **_CONFIG),
                parameter("AMOC", 6042, min=0, max=247, **_CONFIG),
            ],
        }
    )


def atv312() -> Profile:
    """A small Altivar 312: access levels, no words for gaps."""
    data = altivar_data()
    data["faults"]["history"].insert(0, "LFT")
    return profile(
        {
            "profile": head("atv312"),
            **data,
            "functions": _functions((3, 29, None, False), (6, None, 1, True), (16, None, 27, True)),
            "parameters": [
                *altivar_parameters(),
                parameter("LAC", 3006, "rw-stopped", values=_names(3), factory=0, **_CONFIG),
            ],
        }
    )


def atv21() -> Profile:
    """A small Altivar 21: single words, blocks with fixed start."""
    block: dict[str, Any] = {
        "effective": "after-reset",
        "storage": "eeprom",
        "min": 0,
        "max": 11,
        "factory": 0,
    }
    hz: dict[str, Any] = {"scale": "0.01", "unit": "Hz"}
    choices = ["FD01", "FD00", "FE03", "FE05", "FC91"]
    return profile(
        {
            "profile": head("atv21"),
            "link": {
                "baud": 19200,
                "format": "8E1",
                "settings": [
                    {"parameter": "F802", "role": "address"},
                    {"parameter": "F829", "role": "protocol", "factory": 1},
                ],
            },
            "functions": [
                {"code": 3, "name": "3", "max_read": 5},
                {"code": 6, "name": "6", "broadcast": True},
                {"code": 16, "name": "16", "max_write": 2, "broadcast": True},
                {"code": 43, "name": "43"},
            ],
            "reading": {"single_words_only": True},
            "identification": {
                "highest_read_device_id": 3,
                "objects": [
                    {"id": 0, "meaning": "vendor", "example": "Telemecanique"},
                    {"id": 1, "meaning": "reference", "example": "ATV21HU40N4"},
                    {"id": 2, "meaning": "version", "example": "0201"},
                ],
            },
            "blocks": [
                {
                    "id": "read",
                    "name": "Read",
                    "direction": "read",
                    "address": 0x1875,
                    "min_words": 2,
                    "max_words": 5,
                    "slots": [f"F{n}" for n in range(875, 880)],
                    "selects_by": "choice",
                    "choices": [
                        {"raw": raw, "parameter": code} for raw, code in enumerate(choices, 1)
                    ],
                    "fixed_start": True,
                    "effective": "after-reset",
                },
                {
                    "id": "write",
                    "name": "Write",
                    "direction": "write",
                    "address": 0x1870,
                    "min_words": 2,
                    "max_words": 2,
                    "slots": ["F870", "F871"],
                    "selects_by": "choice",
                    "choices": [
                        {"raw": 1, "parameter": "FA00"},
                        {"raw": 3, "parameter": "FA01"},
                    ],
                    "fixed_start": True,
                    "effective": "after-reset",
                },
            ],
            "charts": [
                {
                    "id": "atv21",
                    "name": "ATV21",
                    "kind": "altivar21",
                    "status": "FD01",
                    "states": [],
                }
            ],
            "faults": {
                "parameter": "FC90",
                "history": ["FE10", "FE11"],
                "codes": [
                    {"raw": 1, "code": "OC1", "name": "Overcurrent"},
                    {"raw": 17, "code": "E", "name": "Emergency stop"},
                    {"raw": 24, "code": "Err5", "name": "Communication"},
                ],
            },
            "communication_fault": {
                "timeout": "F803",
                "off": 0,
                "reaction": "F603",
                "starts": "with the first frame",
                "fault": 24,
            },
            "parameters": [
                parameter("ACC", 9, scale="0.1", unit="s", factory=100, storage="eeprom")
                | {"quantity": "acceleration"},
                parameter("CMOD", 3, factory=0),
                parameter("FMOD", 4, factory=1),
                parameter("FH", 0x11, factory=8000, quantity="max_frequency", **hz),
                parameter("FA00", 0xFA00, storage="ram", quantity="command_word"),
                parameter("FA01", 0xFA01, storage="ram", max=40000, max_from="FH", **hz)
                | {"quantity": "command_frequency"},
                parameter("FA20", 0xFA20, storage="ram", quantity="command_word_2"),
                parameter("FD00", 0xFD00, "r", quantity="output_frequency", **hz),
                parameter("FE00", 0xFE00, "r", **hz),
                parameter("FD01", 0xFD01, "r", quantity="status_word"),
                parameter("FE01", 0xFE01, "r"),
                parameter("FC90", 0xFC90, "r", quantity="fault"),
                parameter("FE10", 0xFE10, "r"),
                parameter("FE11", 0xFE11, "r"),
                parameter("FC91", 0xFC91, "r", quantity="alarm_word"),
                parameter("FE03", 0xFE03, "r", scale="0.01", unit="%", quantity="motor_current"),
                parameter("FE05", 0xFE05, "r", scale="0.01", unit="%", quantity="motor_voltage"),
                parameter("FE45", 0xFE45, "r", quantity="command_channel"),
                parameter("FE46", 0xFE46, "r", quantity="reference_channel"),
                parameter("F603", 0x603, factory=0, storage="eeprom"),
                parameter("F802", 0x802, factory=1, min=0, max=247, storage="eeprom")
                | {"quantity": "line_address"},
                parameter("F829", 0x829, factory=1, effective="after-reset", storage="eeprom"),
                parameter("F803", 0x803, unit="s", factory=3, min=0, max=100, storage="eeprom"),
                *(parameter(f"F{n}", int(f"0{n}", 16), **block) for n in (870, 871)),
                *(parameter(f"F{n}", int(f"0{n}", 16), **block) for n in range(875, 880)),
            ],
        }
    )


def powerdrive() -> Profile:
    """A small Powerdrive: silence instead of exceptions, control word, group addresses."""
    bits = ["6.15", "6.30", "6.31", "6.32", "6.33", "6.34", "1.42", "10.33"]
    status = [f"10.{n:02}" for n in range(1, 16)]
    return profile(
        {
            "profile": head("powerdrive"),
            "link": {
                "baud": 19200,
                "format": "8N2",
                "settings": [
                    {"parameter": "15.03", "role": "address"},
                    {"parameter": "15.06", "role": "delay"},
                ],
            },
            "addresses": {"zero_digit_is_group": True},
            "functions": [
                {"code": 3, "name": "3", "max_read": 20, "past_limit": "silence"},
                {"code": 6, "name": "6", "broadcast": True},
                {"code": 16, "name": "16", "max_write": 12, "past_limit": "silence"},
                {"code": 23, "name": "23", "max_read": 20, "max_write": 10}
                | {"past_limit": "silence"},
            ],
            "charts": [
                {
                    "id": "px",
                    "name": "PX",
                    "kind": "leroy-somer",
                    "status": "10.40",
                    "states": [],
                }
            ],
            "communication_fault": {"timeout": "15.07", "off": 0, "starts": "with a frame"},
            "parameters": [
                *(_menu(code, storage="ram") for code in bits),
                *(_menu(code, "r") for code in status),
                _menu("6.42", storage="ram", quantity="command_word"),
                _menu("6.43", "rw-stopped", min=0, max=1),
                _menu("10.40", "r", quantity="status_word"),
                _menu("1.05", type="int16"),
                _menu("1.06", type="int16"),
                _menu("1.07", type="int16"),
                _menu("5.01", "r", quantity="output_frequency"),
                _menu("15.03", factory=1, min=0, max=247, quantity="line_address"),
                _menu("15.06", factory=10, min=0, max=250, unit="ms"),
                _menu("15.07", factory=0, min=0, max=250, scale="0.1", unit="s"),
            ],
        }
    )


def _menu(code: str, access: str = "rw", **more: Any) -> dict[str, Any]:
    menu, number = code.split(".")
    return parameter(code, int(menu) * 100 + int(number) - 1, access, number=code, **more)


PROFILES = {
    "atv71": atv71(),
    "atv312": atv312(),
    "atv21": atv21(),
    "powerdrive": powerdrive(),
}

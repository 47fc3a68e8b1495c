"""Defects of learned scales: the lesson, its storage, the reference."""

from __future__ import annotations

from .defect import Defect

LEARNT = ("tests/drive/test_teaching.py",)
KEPT = ("tests/session/test_teaching.py",)

DEFECTS = (
    Defect(
        "one-look-teaches",
        "tui/drive/teaching.py",
        "if len({look.word for look in looks}) < 2:\n        return None",
        "if not looks:\n        return None",
        "One accidental match decides the scale of a current.",
        LEARNT,
    ),
    Defect(
        "look-that-disagrees-unheard",
        "tui/drive/teaching.py",
        "    if not scales_that_fit(looks):\n",
        "    if known is None and not scales_that_fit(looks):\n",
        "A value is shown in a scale that the drive's own display contradicts.",
        LEARNT,
    ),
    Defect(
        "unknown-sign-guessed",
        "tui/drive/teaching.py",
        "        if self.signed is None:\n            return None\n",
        "",
        "A motor in reverse is shown at an impossible speed.",
        (*LEARNT, *KEPT),
    ),
    Defect(
        "taught-of-another-drive-used",
        "tui/session/teaching/teacher.py",
        "        if self.stated:\n            others =",
        "        if not self.stated:\n            others =",
        "A replaced drive is shown in the scale of the earlier one.",
        KEPT,
    ),
    Defect(
        "damaged-file-written-over",
        "tui/session/teaching/teacher.py",
        "        _set_aside_if_damaged(drive, path)\n",
        "",
        "All learned scales of a drive are lost because its file could not be read once.",
        KEPT,
    ),
    Defect(
        "taught-by-another-program-lost",
        "tui/session/teaching/teacher.py",
        "        if not self._unkept:\n            self._known = on_disk\n",
        "",
        "A scale that a colleague taught in the meantime is overwritten.",
        KEPT,
    ),
    Defect(
        "preset-takes-the-reference-unconfirmed",
        "tui/session/teaching/teacher.py",
        "self._taught_scales(), self._known.reference)",
        "self._taught_scales(), self._known.reference or self.proposal())",
        "An undocumented word gives a motor its reference.",
        KEPT,
    ),
    Defect(
        "confirmation-outlives-its-scale",
        "tui/session/teaching/teacher.py",
        "            self._known = TaughtLooks(self._known.looks)\n",
        "            pass\n",
        "A reference is sent in a scale that no person has confirmed.",
        KEPT,
    ),
)

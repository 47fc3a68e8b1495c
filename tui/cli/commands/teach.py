"""`drivepanel teach`: the scale of a raw value, from what the drive's own display shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ..shared.completion import complete_code
from ..shared.errors import DIFFERENT, end_with
from ..shared.options import (
    Target,
    connect_drive,
    drive_options,
    json_option,
    line_argument,
    never_forced,
    on_line,
)
from ..shared.registration import ON_LINE, command
from ..shared.rows import say_row, titled
from ..shared.say import say

if TYPE_CHECKING:
    from tui.drive.teaching import TaughtScale
    from tui.session.connect.open_line import OpenLine
    from tui.session.teaching.teacher import Teacher

    from ..documents.setting_documents import ScaleField, TaughtField


@command(
    "Learn a raw value's scale from the drive's display.",
    group="Profiles",
    statuses=(DIFFERENT, *ON_LINE),
    acts=True,
    context_settings={"ignore_unknown_options": True},
)  # -12.5 is a VALUE
@line_argument
@click.argument("code", required=False, shell_complete=complete_code)
@click.argument("value", required=False)
@click.argument("unit", required=False)
@drive_options
@click.option(
    "--forget", is_flag=True, help="Delete the learned scale of CODE and show it raw again."
)
@click.option(
    "--reference",
    is_flag=True,
    help="Use CODE to write the drive's reference.",
)
@click.option("--no-reference", is_flag=True, help="Stop using a learned code for the reference.")
@json_option
@never_forced
def teach(
    target: Target,
    code: str | None,
    value: str | None,
    unit: str | None,
    forget: bool,
    reference: bool,
    no_reference: bool,
    as_json: bool,
) -> None:
    """Learn the scale and unit of a raw value from what the drive's display shows now.

    VALUE is what the display shows while CODE is read: 50.3 Hz. Two readings at different values
    give scale and sign; a reading that contradicts them ends with 1. Without VALUE, the learned
    scales are listed. Nothing is written to the drive.
    """
    wishes = sum((forget, reference, no_reference, value is not None))
    if wishes > 1:
        raise click.UsageError("Either VALUE, --forget, --reference or --no-reference.")
    if (forget or reference) and code is None:
        raise click.UsageError("Which CODE?")

    async def work(opened: OpenLine) -> int:
        teacher = await _teacher(opened, target)
        found = teacher.family.find(code).code if code is not None else ""
        if value is not None:
            return await _look(teacher, found, value, unit or "", as_json=as_json)
        if not (forget or reference or no_reference):
            _tell_all(teacher, found, as_json=as_json)
        else:
            if forget:
                known = teacher.forget(found)
                text = f"{found}: shown raw again." if known else f"{found}: was not taught."
            elif reference:
                text = _confirm(teacher, found)
            else:
                teacher.drop_reference()
                text = "No taught parameter takes the reference."
            _tell_change(teacher, text, as_json=as_json)
        _tell_trouble(teacher)
        return 0

    end_with(on_line(target, work, read_only=True))


async def _teacher(opened: OpenLine, target: Target) -> Teacher:
    """The teacher of the drive; `connect_drive` has reported scales that cannot be read."""
    from tui.session.teaching.teacher import Teacher

    teacher = Teacher(await connect_drive(opened, target))
    teacher.recall()
    teacher.trouble = ""
    return teacher


async def _look(teacher: Teacher, code: str, value: str, unit: str, *, as_json: bool) -> int:
    from ..documents.setting_documents import LessonDocument
    from ..shared.output import print_json

    lesson = await teacher.look(code, value, unit)
    if as_json:
        print_json(
            LessonDocument(
                line=teacher.session.line_text,
                device=teacher.session.device,
                profile=teacher.session.profile.id,
                code=code,
                lesson=str(lesson.kind),
                text=lesson.text,
                taught=_scale_field(lesson.scale),
            )
        )
    else:
        say(lesson.text)
        if teacher.proposal() == code:
            say(f"{code} may take the reference: drivepanel teach with {code} --reference.")
    _tell_trouble(teacher)
    return DIFFERENT if lesson.went_wrong else 0


def _confirm(teacher: Teacher, code: str) -> str:
    from tui.session.teaching.teacher import reference_asks

    message = teacher.confirm_reference(code)
    return f"{message} {reference_asks(teacher.family, code)}"


def _tell_change(teacher: Teacher, text: str, *, as_json: bool) -> None:
    from ..documents.setting_documents import TeachChangeDocument
    from ..shared.output import print_json

    if as_json:
        print_json(
            TeachChangeDocument(
                line=teacher.session.line_text,
                device=teacher.session.device,
                profile=teacher.session.profile.id,
                text=text,
                reference=teacher.reference or None,
            )
        )
    else:
        say(text)


_ROW = "{name}: {scale} ({looks})"
_REFERENCE_ROW = "{name}: {scale}, takes the reference ({looks})"


def _tell_all(teacher: Teacher, only: str, *, as_json: bool) -> None:
    """Report taught scales and begun lessons, of one parameter or of all."""
    from ..documents.setting_documents import TaughtDocument
    from ..shared.output import print_json

    codes = [p.code for p in teacher.family.parameters if teacher.looks(p.code)]
    rows = [code for code in codes if only in ("", code)]
    if as_json:
        print_json(
            TaughtDocument(
                line=teacher.session.line_text,
                device=teacher.session.device,
                profile=teacher.session.profile.id,
                taught={code: _taught_field(teacher, code) for code in rows},
                reference=teacher.reference or None,
            )
        )
        return
    for code in rows:
        scale = teacher.scales.get(code)
        what = scale.text if scale is not None else "not known yet"
        seen = ", ".join(look.text for look in teacher.looks(code))
        row = _REFERENCE_ROW if code == teacher.reference else _ROW
        text = row.format(name=teacher.family[code].name, scale=what, looks=seen)
        say_row(titled(7), (code, text))
    if not rows:
        say(f"Of {only} nothing is taught." if only else "Nothing is taught.")


def _tell_trouble(teacher: Teacher) -> None:
    if teacher.trouble:
        say(f"drivepanel: {teacher.trouble}", err=True)


def _taught_field(teacher: Teacher, code: str) -> TaughtField:
    from ..documents.setting_documents import ReadingField, TaughtField

    looks = [
        ReadingField(raw=look.word, shown=float(look.shown), unit=look.unit or None)
        for look in teacher.looks(code)
    ]
    return TaughtField(scale=_scale_field(teacher.scales.get(code)), looks=looks)


def _scale_field(scale: TaughtScale | None) -> ScaleField | None:
    from ..documents.setting_documents import ScaleField

    if scale is None:
        return None
    return ScaleField(scale=float(scale.scale), unit=scale.unit or None, signed=scale.signed)

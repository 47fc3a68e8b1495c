"""Dialogs for a new value: a typed number, a name from a list, the bits of a word."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.widgets import Input, OptionList

from tui.drive.errors import DriveError
from tui.drive.profile.schema import Parameter
from tui.drive.settings.factory import factory_is_sure, factory_raw
from tui.drive.settings.in_force import limit_passed
from tui.drive.shown import number_of, raw_of_text
from tui.drive.values import hexadecimal, is_enumeration, word_count
from tui.session.settings.editor import Editor
from tui.widgets.fields import NumberInput
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain, entry

from ..dialogs.question import KeyQuestion, Question, hint
from .value_text import factory_text, limits_now, step_text, value_text

if TYPE_CHECKING:
    from ..dialogs.now import MotorStates

ROUNDED = "rounded to the drive's resolution"
STAGES_NOTHING = ("Esc", "Cancel")


class EditNumber(Question[str | None]):
    """A number with its unit: checked while typed, and shown as the drive will store it."""

    BINDINGS: ClassVar = [
        Binding("up", "step(1)", "one step up", show=False),
        Binding("down", "step(-1)", "one step down", show=False),
        Binding("pageup", "step(10)", "ten steps up", show=False),
        Binding("pagedown", "step(-10)", "ten steps down", show=False),
    ]

    def __init__(
        self,
        editor: Editor,
        parameter: Parameter,
        now: MotorStates | None = None,
        proposed: int | None = None,
    ) -> None:
        super().__init__(now)
        self._editor, self._parameter, self._proposed = editor, parameter, proposed

    def dialog(self) -> ComposeResult:
        """The field, the resulting value, and facts about the parameter."""
        editor, parameter = self._editor, self._parameter
        raw = first_raw(editor, parameter.code, self._proposed)
        value = editor.values.value_of(parameter.code, raw) if raw is not None else None
        with Vertical(id="dialog"):
            yield Plain(f"{parameter.code}  {parameter.name}", id="question")
            yield from self.now_lines()
            yield NumberInput(value.text if value else "", id="answer", select_on_focus=True)
            yield Plain("", id="held")
            yield Plain(about_number(editor, parameter), id="about")
            steps = (("Up, Down", "1 step"), ("PgUp, PgDn", "10 steps"))
            keys = (("Enter", "Stage"), *steps, STAGES_NOTHING)
            yield Plain(hint(*keys), id="hint")

    def on_mount(self) -> None:
        """Show the value of the initial text."""
        self._check(self.query_one(Input).value)

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show the resulting value while typing."""
        self._check(event.value)

    def _check(self, text: str) -> bool:
        """Show the value of the text, or its error; return True if it can be staged."""
        held = self.query_one("#held", Plain)
        editor, parameter = self._editor, self._parameter
        values = editor.values
        try:
            edits = editor.staging.edits.stage(
                editor.session.profile, parameter.code, text, values.raws, values.lacking
            )
        except DriveError as refused:
            held.update(Text(str(refused), ALARM))
            return False
        if past := limit_passed(
            editor.session.profile, editor.staging.edits, edits, editor.values.raws
        ):
            held.update(Text(past, ALARM))
            return False
        edit = edits.get(parameter.code)
        if edit is None:
            same = next(item for item in edits.requested if item.code == parameter.code)
            reported = Text("unchanged: the drive holds this value", FAINT)
            if same.rounded:
                reported.append(f": {same.text}   {ROUNDED}", ALARM)
            held.update(reported)
            return True
        shown = Text(f"→ {edit.text}", STRONG)
        shown.append(f"   raw {edit.new} = {hexadecimal(parameter, edit.new)}", FAINT)
        if edit.rounded:
            shown.append(f"   {ROUNDED}", ALARM)
        if edit.warning:
            shown.append(f"\n{edit.warning}", ALARM)
        held.update(shown)
        return True

    def action_step(self, steps: int) -> None:
        """Go to the next value that the drive can store, so many steps away."""
        editor, parameter = self._editor, self._parameter
        profile, field = editor.session.profile, self.query_one(Input)
        raws, lacking = editor.values.raws, editor.values.lacking
        try:
            raw = raw_of_text(profile, parameter, field.value, raws, lacking).raw
        except DriveError:
            return
        # at a negative scale, the next higher value has the next lower count
        counts = -steps if parameter.scale.startswith("-") else steps
        number = number_of(profile, parameter, raw + counts, raws, lacking)
        if number is None:
            return
        field.value = f"{number:f}"
        field.cursor_position = len(field.value)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer with the text if it is valid."""
        if self._check(event.value):
            self.answer(event.value.strip())


def first_raw(editor: Editor, code: str, proposed: int | None) -> int | None:
    """Return the raw value a dialog begins with: the proposed one, the staged, or the held."""
    staged = editor.staging.edits.get(code)
    if proposed is not None:
        return proposed
    return staged.new if staged else editor.values.raws.get(code)


def about_number(editor: Editor, parameter: Parameter) -> str:
    """Return the present, staged and factory values, the active limits and the step."""
    now = f"drive holds {value_text(editor, parameter.code)}"
    edit, factory = editor.staging.edits.get(parameter.code), factory_text(editor, parameter)
    reported = [now, *([f"staged {edit.text}"] if edit else [])]
    reported += [f"factory {factory}"] if factory else []
    limits = limits_now(editor, parameter, staged=True)
    bounds = f"limits {limits.text}" if limits and limits.text else "limits not documented"
    step = step_text(editor, parameter)
    return f"{'   '.join(reported)}\n{bounds}{f'   step {step}' if step else ''}"


class PickValue(KeyQuestion[int | None]):
    """One of the names of an enumeration."""

    def __init__(
        self,
        editor: Editor,
        parameter: Parameter,
        now: MotorStates | None = None,
        proposed: int | None = None,
    ) -> None:
        super().__init__(now)
        self._editor, self._parameter, self._proposed = editor, parameter, proposed
        profile, values = editor.session.profile, editor.values
        self._names = sorted(profile.names(parameter).items())
        self._factory = factory_raw(profile, parameter, values.raws, values.lacking)

    def dialog(self) -> ComposeResult:
        """The list, with the present value marked."""
        with Vertical(id="dialog"):
            yield Plain(f"{self._parameter.code}  {self._parameter.name}", id="question")
            yield from self.now_lines()
            yield OptionList(
                *(entry(self._line(raw, name)) for raw, name in self._names),
                id="choices",
                compact=True,
            )
            yield Plain(hint(("Enter", "Stage"), STAGES_NOTHING), id="hint")

    def on_mount(self) -> None:
        """Select the first value."""
        raw = first_raw(self._editor, self._parameter.code, self._proposed)
        places = [place for place, (value, _) in enumerate(self._names) if value == raw]
        self.query_one(OptionList).highlighted = places[0] if places else 0

    def _line(self, raw: int, name: str) -> Text:
        held = self._editor.values.raws.get(self._parameter.code) == raw
        text = Text(no_wrap=True)
        text.append(" ● " if held else " · ", STRONG if held else FAINT)
        text.append(f"{raw:>5}  ", FAINT)
        text.append(name, STRONG if held else PLAIN)
        if raw == self._factory:
            sure = factory_is_sure(self._parameter)
            text.append("   factory" if sure else "   factory ?", FAINT)
        return text

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer with the raw value."""
        self.answer(self._names[event.option_index][0])


class EditBits(KeyQuestion[int | None]):
    """The bits of a word, one by one."""

    BINDINGS: ClassVar = [
        Binding("s", "take", "stage", show=False),
    ]

    def __init__(
        self,
        editor: Editor,
        parameter: Parameter,
        now: MotorStates | None = None,
        proposed: int | None = None,
    ) -> None:
        super().__init__(now)
        self._parameter = parameter
        self._all = (1 << 16 * word_count(parameter)) - 1
        self._held = editor.values.raws.get(parameter.code, 0) & self._all
        self._word = (first_raw(editor, parameter.code, proposed) or 0) & self._all

    def dialog(self) -> ComposeResult:
        """All named bits; reserved ones are disabled."""
        parameter = self._parameter
        with Vertical(id="dialog"):
            yield Plain(f"{parameter.code}  {parameter.name}", id="question")
            yield from self.now_lines()
            yield OptionList(id="choices", compact=True)
            yield Plain("", id="held")
            keys = (("Enter", "Toggle bit"), ("s", "Stage the word"), STAGES_NOTHING)
            yield Plain(hint(*keys), id="hint")

    def on_mount(self) -> None:
        """Show the word."""
        self._show(0)

    def _show(self, at: int) -> None:
        options = self.query_one(OptionList)
        options.clear_options()
        for bit in self._parameter.bits:
            on, was = self._word >> bit.bit & 1, self._held >> bit.bit & 1
            text = Text(no_wrap=True)
            text.append(f" {bit.bit:>2} {on} ", STRONG if on else FAINT)
            text.append(f"{bit.name}", STRONG if on != was else PLAIN)
            words = bit.on if on else bit.off
            text.append(f": {words}" if words else "", FAINT)
            options.add_option(entry(text, disabled=bit.bit in self._parameter.reserved))
        options.highlighted = at
        shown = " → ".join(hexadecimal(self._parameter, raw) for raw in (self._held, self._word))
        self.query_one("#held", Plain).update(Text(shown, STRONG))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Toggle the bit."""
        self._word ^= 1 << self._parameter.bits[event.option_index].bit
        self._show(event.option_index)

    def action_take(self) -> None:
        """Answer with the word."""
        self.answer(self._word)


Dialog = EditNumber | PickValue | EditBits


def dialog_for(
    editor: Editor,
    parameter: Parameter,
    now: MotorStates | None = None,
    proposed: int | None = None,
) -> Callable[[], Dialog]:
    """The dialog for a parameter's kind; a stop of the drives of `now` cancels it.

    It begins with the `proposed` raw value, if there is one.
    """
    if parameter.bits:
        return lambda: EditBits(editor, parameter, now, proposed)
    if is_enumeration(parameter):
        return lambda: PickValue(editor, parameter, now, proposed)
    return lambda: EditNumber(editor, parameter, now, proposed)

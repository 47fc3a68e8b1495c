"""Settings lost at power-off: those that differ from their saved values."""

from __future__ import annotations

from tui.session.drive import UnsavedSettings


def written(*writes: tuple[int | None, int | None]) -> UnsavedSettings:
    """Writes of one setting: the raw value before each, and after it."""
    unsaved = UnsavedSettings()
    for before, now in writes:
        unsaved.note_write("ACC", before, now)
    return unsaved


def test_setting_counts_until_it_has_its_saved_value_again() -> None:
    assert written((30, 40)).codes == {"ACC"}
    assert written((30, 40), (40, 30)).codes == set()
    assert written((30, 30)).codes == set()


def test_setting_counts_if_its_value_before_or_after_is_not_known() -> None:
    assert written((None, 40)).codes == {"ACC"}
    assert written((30, None)).codes == {"ACC"}
    assert written((30, None), (None, 30)).codes == set()


def test_setting_that_another_source_changed_counts_whatever_it_holds() -> None:
    assert written((30, 40), (50, 30)).codes == {"ACC"}


def test_value_that_was_read_counts_for_written_settings_only() -> None:
    unsaved = written((30, None))
    unsaved.note_value("DEC", 7)
    assert unsaved.codes == {"ACC"}
    unsaved.note_value("ACC", 30)
    assert unsaved.codes == set()


def test_no_value_is_known_to_be_saved_once_many_may_have_changed() -> None:
    unsaved = written((30, 30))
    unsaved.forget_values()
    assert unsaved.codes == {"ACC"}
    unsaved.note_write("DEC", 5, 5)
    assert unsaved.codes == {"ACC", "DEC"}
    unsaved.clear()
    assert unsaved.codes == set()
    unsaved.note_write("DEC", 5, 5)
    assert unsaved.codes == set()

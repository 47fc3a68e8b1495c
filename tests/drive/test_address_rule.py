"""Addresses by rule, and files that are not plain UTF-8."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.mixer import mixer_text
from tui.drive.profile import library
from tui.drive.profile.address_rule import RuleError, address_by_rule


@pytest.mark.parametrize(
    ("rule", "number", "address"),
    [
        ("10 * number - 1", "3-03", 3029),  # as a Danfoss guide counts
        ("number - 1", "1105", 1104),
        ("256 * menu + item", "01-12", 0x010C),  # as a Delta guide counts
        ("16#1000 + 100 * menu + item", "1.05", 0x1069),
        ("16#100 + number", "16#1F", 0x11F),
        ("number - 1", "2103H", 0x2102),
        ("number - 1", "0xA8", 0xA7),
        ("(number - 1) % 1000 // 2", "2021", 10),
        (" 0x20 + number", "P 3", 0x23),
    ],
)
def test_rule_gives_the_address_of_a_number(rule: str, number: str, address: int) -> None:
    assert address_by_rule(rule, number) == address


@pytest.mark.parametrize(
    ("rule", "reason"),
    [
        ("10 * numbr", "use number, menu, item"),
        ("__import__('os').system('true')", "use number, menu, item"),
        ("2 ** number", "use number, menu, item"),
        ("number if number else 1", "use number, menu, item"),
        ("number / 2", "use number, menu, item"),
        ("1.5 * number", "use number, menu, item"),
        ("True + number", "use number, menu, item"),
        ("10 * number -", "is not a rule"),
        ("(" * 81, "at most 80 characters"),
        ("number // 0", "divides by 0"),
        ("number - 304", "gives -1"),
        ("1000 * number", "gives 303000"),
    ],
)
def test_rule_that_gives_no_address_has_a_reason(rule: str, reason: str) -> None:
    with pytest.raises(RuleError, match=reason):
        address_by_rule(rule, "3-03")


def test_rule_that_needs_a_menu_names_the_number_without_one() -> None:
    with pytest.raises(RuleError, match="needs menu, and '303' has none"):
        address_by_rule("256 * menu", "303")


def checked(tmp_path: Path, data: bytes) -> list[str]:
    path = tmp_path / "own.toml"
    path.write_bytes(data)
    return library.faults_of(path)


def table(rows: str, *, head: str = "", group: str = "") -> bytes:
    text = mixer_text().replace('version = "1.0"\n', f'version = "1.0"\n{head}')
    groups = f'\n[[groups]]\nname = "Settings"\n{group}\n' if group else ""
    return text.replace("\n[[charts]]", f"{groups}\n[[charts]]", 1).encode() + rows.encode()


ROW = """
[[parameters]]
code = "3-03"
name = "Highest reference"
number = "3-03"
access = "rw"
group = "Settings"
source = "guide"
confidence = "manual"
"""


@pytest.mark.parametrize(
    ("head", "group", "own", "address"),
    [
        ('address = "10 * number - 1"\n', "", "", 3029),
        ("", 'address = "256 * menu + item"', "", 771),
        ('address = "number"\n', 'address = "256 * menu + item"', "", 771),
        ('address = "number"\n', 'address = "number + 1"', 'address = "16#1000 + number"\n', 4399),
        ('address = "number"\n', "", "address = 0\n", 0),
    ],
)
def test_nearest_rule_gives_the_address(
    tmp_path: Path, head: str, group: str, own: str, address: int
) -> None:
    path = tmp_path / "own.toml"
    path.write_bytes(table(ROW + own, head=head, group=group))
    assert library.faults_of(path) == []
    assert library.load_file(path)["3-03"].address == address


def test_wrong_rule_is_reported_with_its_line(tmp_path: Path) -> None:
    data = table(ROW + 'address = "number * 1000"\n')
    [fault] = checked(tmp_path, data)
    line = data.count(b"\n")
    assert fault.startswith(f"{tmp_path / 'own.toml'}:{line}: parameter 3-03: ")


def test_two_numbers_with_the_same_address_are_reported(tmp_path: Path) -> None:
    rows = ROW + ROW.replace("3-03", "4-03").replace("Highest", "Lowest")
    [fault] = checked(tmp_path, table(rows, head='address = "number % 100 + 900"\n'))
    assert "address 903 already belongs to 3-03" in fault


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\xef\xbb\xbf" + mixer_text().encode(), ":1: the file begins with a byte order mark"),
        (mixer_text().encode("utf-16"), ":1: the file is UTF-16, not UTF-8"),
        (
            mixer_text().replace("Example", "Modèle", 1).encode("latin-1"),
            ":4: byte 16#E8 is not UTF-8; in Latin-1 or Windows-1252 it is 'è'",
        ),
    ],
)
def test_file_of_another_encoding_is_refused_by_its_name(
    tmp_path: Path, data: bytes, reason: str
) -> None:
    [fault] = checked(tmp_path, data)
    assert reason in fault
    folder = library.user_folder()
    folder.mkdir(parents=True)
    (folder / "own.toml").write_bytes(data)
    [listed] = [item.fault for item in library.listings() if item.own]
    assert reason in listed


def test_line_ends_of_windows_are_accepted(tmp_path: Path) -> None:
    assert checked(tmp_path, mixer_text().replace("\n", "\r\n").encode()) == []

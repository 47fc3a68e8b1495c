"""Planted defects: one at a time, in a copy, and never counted as noticed by mistake."""

from __future__ import annotations

import ast
from contextlib import closing
from pathlib import Path
from types import FunctionType, SimpleNamespace
from typing import Any, cast

import pytest

from tests.defects.defect import Defect
from tests.defects.equivalent import EQUIVALENT
from tests.forked import Forks, Result
from tests.mutants import DEFECTS, ROOT, STALE, SURVIVED, Stale, judge, place_of, planted
from tests.mutator import KINDS, Defaults, Mutant, Mutator
from tests.random_defects import (
    EQUAL,
    UNREACHED,
    Chooser,
    Judge,
    Judged,
    Uses,
    all_sites,
    rate,
    report,
    sample,
)
from tests.reached import Record, new_names, same_lines
from tests.sources import PACKAGE, modules
from tests.swapped import NotSwapped, swap

pytestmark = pytest.mark.sweep  # they test a tool of the developers

WHOLE = "def half(x):\n    return x / 2\n"


def defect(old: str, new: str = "", room: str = "room") -> Defect:
    return Defect("small", room, old, new, "Nobody.", ())


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Make a copy with one folder of two files."""
    (tmp_path / "room" / "deep").mkdir(parents=True)
    (tmp_path / "room" / "one.py").write_text(WHOLE)
    (tmp_path / "room" / "deep" / "two.py").write_text("x = 1\n")
    return tmp_path


def test_defect_is_found_anywhere_in_its_package(copy: Path) -> None:
    assert place_of(defect("x = 1"), copy).name == "two.py"
    assert place_of(defect("x / 2", room="room/one.py"), copy).name == "one.py"


@pytest.mark.parametrize("old", ["x * 2", "x", "return"])
def test_text_that_does_not_occur_once_is_stale(copy: Path, old: str) -> None:
    (copy / "room" / "deep" / "two.py").write_text("return\n")
    with pytest.raises(Stale):
        place_of(defect(old), copy)


def test_defect_in_a_removed_package_is_stale(copy: Path) -> None:
    with pytest.raises(Stale):
        place_of(defect("x / 2", room="gone"), copy)


def test_copy_is_always_restored(copy: Path) -> None:
    path = copy / "room" / "one.py"
    with planted(defect("x / 2", "x * 2"), copy):
        assert "x * 2" in path.read_text()
    assert path.read_text() == WHOLE
    with pytest.raises(ZeroDivisionError), planted(defect("x / 2", "x / 0"), copy):
        raise ZeroDivisionError
    assert path.read_text() == WHOLE


@pytest.mark.parametrize(
    ("status", "output", "by"),
    [
        (0, "3 passed", SURVIVED),
        (1, "FAILED tests/a.py::test_b[x - y] - assert 1 == 2\n1 failed", "tests/a.py::test_b"),
        (1, "ERROR tests/a.py::test_b - OSError\n1 error", "tests/a.py::test_b"),
        (1, "ERROR tests/a.py - SyntaxError\n1 error", STALE),
        (2, "ERROR tests/a.py - SyntaxError\n1 error", STALE),
        (4, "ERROR: not found: tests/a.py::test_gone", STALE),
        (5, "no tests ran in 0.01s", STALE),
        (1, "INTERNALERROR> KeyError", STALE),
        (-1, "", "a hang"),
    ],
)
def test_only_a_test_that_ran_and_failed_detects_a_defect(
    status: int, output: str, by: str
) -> None:
    assert judge(status, output).startswith(by)


def test_text_of_every_defect_occurs_in_its_package() -> None:
    for defect in DEFECTS:
        assert place_of(defect, ROOT).is_file(), defect.name


def test_every_defect_has_a_name_a_sentence_and_existing_tests() -> None:
    assert len({defect.name for defect in DEFECTS}) == len(DEFECTS) >= 44
    for defect in DEFECTS:
        assert defect.suffers.endswith("."), defect.name
        assert defect.old != defect.new, defect.name
        assert defect.tests, defect.name
        for test in defect.tests:
            file, _, function = test.partition("::")
            assert f"def {function}" in (ROOT / file).read_text("utf-8"), test


# -- defects at random -----------------------------------------------------------------------------

MODULE = '''
"""A module."""
from threading import Lock
LONGEST = 0.5

class Pump:
    """A class."""
    speed: "float" = 10

    def __init__(self) -> None:
        self._lock = Lock()

    async def work(self, by: int = 2, *, gently: bool = False) -> bool:
        """A function."""
        with self._lock:
            self.start(by, 7)
        await self.rest()
        if by < 3 and gently:
            raise ValueError(f"by {by}")
        plan = make("a", key="b")
        if not plan:
            return
        return await self.done(plan)
'''


def mutants_of(source: str) -> list[Mutant]:
    found = Mutator("tui/pump.py", source, Defaults([ast.parse(source)])).sites()
    return [mutant for site in found for mutant in site.mutants]


@pytest.mark.parametrize(
    ("kind", "old", "new"),
    [
        ("condition", "by < 3 and gently", "((by < 3) or (gently))"),
        ("condition", "gently", "(not (gently))"),
        ("condition", "not plan", "bool(plan)"),
        ("boundary", "by < 3", "(by <= 3)"),
        ("constant", "0.5", "5.0"),
        ("constant", "0.5", "0.05"),
        ("constant", "0.5", "1.5"),
        ("constant", "10", "1"),
        ("constant", "False", "True"),
        ("text", '"a"', '""'),
        ("text", 'f"by {by}"', '""'),
        ("argument", "self.start(by, 7)", "self.start(7, by)"),
        ("argument", 'make("a", key="b")', 'make("a")'),
        ("call", "self.start(by, 7)", "pass"),
        ("call", 'make("a", key="b")', "None"),
        ("await", "await self.rest()", "pass"),
        ("lock", "with self._lock", "if True"),
        ("raise", 'raise ValueError(f"by {by}")', "pass"),
        ("return", "return", "pass"),
        ("return", "return await self.done(plan)", "return not (await self.done(plan))"),
    ],
)
def test_each_kind_of_defect_is_made(kind: str, old: str, new: str) -> None:
    found = [(mutant.change.kind, mutant.old, mutant.change.new) for mutant in mutants_of(MODULE)]
    assert found.count((kind, old, new)) == 1


def test_every_kind_has_an_example() -> None:
    assert {mutant.change.kind for mutant in mutants_of(MODULE)} == set(KINDS)


def test_docstrings_annotations_and_required_arguments_stay() -> None:
    changed = {mutant.old for mutant in mutants_of(MODULE)}
    assert not changed & {'"""A module."""', '"""A class."""', '"""A function."""', '"float"'}
    required = "def f(a, *, b): ...\nf(1, b=2)\n"
    assert {mutant.change.kind for mutant in mutants_of(required)} == {"constant", "call"}


@pytest.mark.filterwarnings("ignore::SyntaxWarning")
@pytest.mark.parametrize("path", modules(PACKAGE / "bus" / "share"), ids=lambda path: path.stem)
def test_each_random_defect_compiles_and_changes_its_module(path: Path) -> None:
    source = path.read_text("utf-8")
    whole = ast.dump(ast.parse(source))
    found = mutants_of(source)
    assert len({mutant.identity for mutant in found}) == len(found)
    for mutant in found[::10]:
        assert ast.dump(ast.parse(mutant.apply(source))) != whole, mutant.identity


def test_identity_of_a_random_defect_survives_moved_lines() -> None:
    moved = [mutant.identity for mutant in mutants_of(MODULE.replace("LONGEST", "\n\nLONGEST"))]
    assert moved == [mutant.identity for mutant in mutants_of(MODULE)]


def test_random_defects_are_the_same_for_a_seed_and_spread_over_packages() -> None:
    defaults = Defaults([])
    sites = {package: list(all_sites(package, defaults)) for package in ("keeper", "bus")}
    assert sample(sites, 40, 1) == sample(sites, 40, 1) != sample(sites, 40, 2)
    drawn = sample(sites, 40, 1)
    assert sum(mutant.path.startswith("tui/keeper/") for mutant in drawn) == 20
    assert len({(mutant.path, mutant.change.start, mutant.change.end) for mutant in drawn}) > 35


def test_lines_of_a_record_follow_the_source() -> None:
    before, after = ["a", "b", "c"], ["new", "a", "B", "c"]
    assert same_lines(before, after) == [(2, 1), (3, 2), (4, 3)]
    assert same_lines(["a", "b"], ["b"]) == [(1, 2)]


def test_test_that_was_renamed_is_found_by_its_body() -> None:
    before = ["def test_a() -> None:", "    a", "def test_b() -> None:", "    b"]
    new = ["def test_new() -> None:", "    new"]
    assert new_names(before, [*new, "async def test_c() -> None:", *before[1:]]) == {
        "test_a": "test_c"
    }
    assert new_names(before, [*new, *before]) == {}


def test_constant_is_tested_by_functions_that_use_it() -> None:
    path = "tui/session/proof/result.py"
    lines = (ROOT / path).read_text("utf-8").splitlines()
    used = next(n for n, line in enumerate(lines, 1) if "max(LONGEST_SILENCE" in line)
    assert Uses().lines(path, ["LONGEST_SILENCE"]) == {(path, used)}


def test_function_that_runs_at_import_is_tested_by_users_of_its_result() -> None:
    path = "tui/wire/frames.py"
    lines = (ROOT / path).read_text("utf-8").splitlines()
    used = next(n for n, line in enumerate(lines, 1) if "= _CRC, " in line)
    (site, *_) = (
        found
        for found in Mutator(path, "\n".join(lines), Defaults([])).sites()
        if found.mutants[0].function == "_table"
    )
    reached = {path: {used: {"tests/wire/test_frames.py::test_a"}}}
    record = SimpleNamespace(tests={}, lines=lambda of: reached.get(of, {}))
    chooser = Chooser(cast(Record, record))
    assert chooser._reaching(site.mutants[0]) == {"tests/wire/test_frames.py::test_a"}


def test_report_counts_defects_that_no_test_reaches_as_missed() -> None:
    outcomes = ["tests/a.py::test_b", SURVIVED, UNREACHED, EQUAL]
    judged = [Judged(f"d{n}", "bus", 1, by, 1.0, 1) for n, by in enumerate(outcomes)]
    assert rate(judged) == pytest.approx(1 / 3)
    assert "| bus | 4 | 1 | 1 | 1 | 1 | 33.3% |" in report(judged)
    assert rate([]) == 1.0


def test_failure_of_a_busy_computer_disqualifies_no_test_for_good() -> None:
    runs = iter(("hung", "a", "a", "a", "", "a", "a", ""))
    requested: list[tuple[str, ...]] = []

    def run(tests: list[str], defective: bool) -> str:
        requested.append((*tests, "with" if defective else "without"))
        return next(runs)

    judged = Judge(cast(Chooser, None), (), {})
    # a fork hangs before its first test and runs again; then `a` fails without the defect, too
    assert judged._search([["a", "b"]], run) == ""
    assert judged._search([["a"]], run) == "a"
    assert requested == [
        ("a", "b", "with"), ("a", "b", "with"), ("a", "with"), ("a", "without"), ("b", "with"),
        ("a", "with"), ("a", "with"), ("a", "without"),
    ]  # fmt: skip


SWAPPED = """
LIMIT = 3

class Pump:
    def speed(self, by):
        def twice():
            return by * 2
        return twice() + LIMIT

def later(by=1):
    return by
"""


def functions_of(source: str) -> list[FunctionType]:
    names: dict[str, Any] = {}
    exec(compile(source, "pump.py", "exec"), names)
    return [names["Pump"].speed, names["later"]]


def test_swap_gives_functions_the_code_of_the_changed_source() -> None:
    speed, later = functions = functions_of(SWAPPED)
    changed = SWAPPED.replace("by * 2\n", "by * \\\n 20\n")  # later lines move
    assert swap(functions, "pump.py", SWAPPED, changed) == 1
    assert (speed(None, 1), later()) == (23, 1)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("LIMIT = 3", "LIMIT = 30"),
        ("by=1", "by=10"),
        ("    return by\n", "    pass\n" * 2 + "x = 1\n"),
    ],
)
def test_swap_refuses_what_runs_at_import(old: str, new: str) -> None:
    with pytest.raises(NotSwapped):
        swap(functions_of(SWAPPED), "pump.py", SWAPPED, SWAPPED.replace(old, new))


@pytest.mark.sweep
def test_forks_name_the_first_test_that_fails_by_a_defect(tmp_path: Path) -> None:
    (tmp_path / "pump.py").write_text("def speed():\n    return 1\n")
    tests = "from pump import speed\ndef test_a(): pass\ndef test_b(): assert speed() == 1\n"
    (tmp_path / "test_pump.py").write_text(f"{tests}def test_c(): assert speed() < 2\n")
    names = [f"test_pump.py::test_{letter}" for letter in "abc"]
    before, after = "def speed():\n    return 1\n", "def speed():\n    return 2\n"
    with closing(Forks(tmp_path, ["test_pump.py"])) as forks:
        assert forks.run(names, "pump.py", before, after) == Result(names[1], ran=2)
        assert forks.run(names) == Result("", ran=3)
        assert forks.run(["test_pump.py"], "pump.py", before, after).failed == names[1]
        assert forks.run(names, "pump.py", before, "X = 1\n").not_swapped
        hanging = before.replace("return 1", "import time; time.sleep(9)")
        assert forks.run(names, "pump.py", before, hanging, 0.2).failed == names[1]


def test_every_equivalent_defect_has_its_reason() -> None:
    assert all(why.endswith(".") for why in EQUIVALENT.values())
